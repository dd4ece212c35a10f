//! Experiments as users run them: resumable, repeatable, and never mixed.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use tpg_experiments::file::Experiment;
use tpg_experiments::row::{
    Ablation, Access, AccessKind, CurvePoint, Forgets, MemorySection, Row, read_row, read_table,
};
use tpg_tests::process::{finish, start, stderr, text, tpg, tpg_ok};
use tpg_trainer::lower::Mode;
use tpg_trainer::session::Session;

/// Two variants of CartPole, one with memory that outlives agents, twice each.
const TINY: &str = r#"
name = "tiny"
chapter = 2
tasks = ["cartpole"]
variants = ["original", "no-memory"]
repeats = 2
test-episodes = 4
budget = { generations = 2 }
[set]
evolution.population = 20
evolution.children = 20
evaluation.episodes = 2
"#;

struct Place {
    folder: tempfile::TempDir,
}

impl Place {
    fn new(experiment: &str) -> Self {
        let place = Place {
            folder: tempfile::tempdir().expect("a folder"),
        };
        place.write(experiment);
        place
    }

    fn file(&self) -> PathBuf {
        self.folder.path().join("tiny.toml")
    }

    fn write(&self, experiment: &str) {
        fs::write(self.file(), experiment).expect("written");
    }

    fn results(&self) -> PathBuf {
        self.folder.path().join("tiny")
    }

    fn path(&self, name: &str) -> PathBuf {
        self.results().join(name)
    }

    fn run(&self) -> String {
        stderr(&tpg_ok(&["experiment", "run", text(&self.file())]))
    }

    /// Runs it, which must fail with status 2, and returns what it says.
    fn refused(&self, more: &[&str]) -> String {
        let file = self.file();
        let output = tpg([&["experiment", "run", text(&file)], more].concat());
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        stderr(&output)
    }
}

/// Every row of the folder by its run's name, without what differs between equal runs.
fn rows(results: &Path) -> BTreeMap<String, Row> {
    let entries = fs::read_dir(results.join("rows")).expect("rows");
    let mut rows = BTreeMap::new();
    for entry in entries {
        let row = read_row(&entry.expect("an entry").path()).expect("whole");
        let timeless = Row {
            train_seconds: 0.0,
            cpu_seconds: 0.0,
            ..row
        };
        rows.insert(timeless.cell(), timeless);
    }
    rows
}

fn accesses(results: &Path, cell: &str) -> Vec<Access> {
    read_table(&results.join(format!("accesses/{cell}.csv"))).expect("whole")
}

#[test]
fn rows_are_the_same_in_any_order_and_are_computed_once() {
    let place = Place::new(TINY);
    let one = place.folder.path().join("one");
    let (file, out) = (place.file(), text(&one));
    // One at a time, the last of them first.
    for more in [["--only", ".2"], ["--jobs", "1"]] {
        let run = ["experiment", "run", text(&file), "--out", out];
        tpg_ok(&[&run[..], &more[..]].concat());
    }
    let said = place.run();
    assert!(said.contains("[  4/4]"), "{said}");
    let all = rows(&place.results());
    assert_eq!(all.len(), 4);
    assert_eq!(all, rows(&one));
    for cell in all.keys() {
        let curve: Vec<CurvePoint> =
            read_table(&place.path(&format!("curves/{cell}.csv"))).expect("whole");
        assert_eq!(
            curve.iter().map(|p| p.generation).collect::<Vec<_>>(),
            [1, 2]
        );
        let has_memory = cell.contains("original");
        let file = place.path(&format!("accesses/{cell}.csv"));
        assert_eq!(file.exists(), has_memory, "{cell}");
        if has_memory {
            let both = [place.results(), one.clone()].map(|results| accesses(&results, cell));
            assert_eq!(both[0], both[1]);
        }
        assert!(!place.path("work").join(cell).exists(), "{cell} is done");
    }
    let bytes = |cell: &str| fs::read(place.path(&format!("rows/{cell}.csv"))).expect("a row");
    let before: Vec<Vec<u8>> = all.keys().map(|cell| bytes(cell)).collect();
    let said = place.run();
    assert!(said.contains("0 of 4 runs"), "{said}");
    // Not even the seconds have changed.
    let after: Vec<Vec<u8>> = all.keys().map(|cell| bytes(cell)).collect();
    assert!(before == after);
}

#[test]
fn half_written_rows_are_done_again() {
    let place = Place::new(TINY);
    place.run();
    let before = rows(&place.results());
    let row = place.path("rows/cartpole.original.1.csv");
    let whole = fs::read_to_string(&row).expect("a row");
    fs::write(&row, &whole[..whole.len() - 5]).expect("written");
    let other = place.path("rows/cartpole.no-memory.2.csv");
    let returns = fs::read_to_string(&other).expect("a row");
    let (start, end) = returns.rsplit_once(' ').expect("several returns");
    let unstable = end.rsplit_once(',').expect("a last column").1;
    fs::write(&other, format!("{start},{unstable}")).expect("written");
    fs::remove_file(place.path("curves/cartpole.no-memory.1.csv")).expect("removed");
    let said = place.run();
    for name in [
        "rows/cartpole.original.1.csv",
        "rows/cartpole.no-memory.2.csv",
        "curves/cartpole.no-memory.1.csv",
        "3 of 4 runs",
    ] {
        assert!(said.contains(name), "{name}: {said}");
    }
    assert_eq!(rows(&place.results()), before);
}

#[test]
fn results_of_another_experiment_are_refused_with_what_differs() {
    let place = Place::new(TINY);
    tpg_ok(&[
        "experiment",
        "run",
        text(&place.file()),
        "--only",
        "no-memory.1",
    ]);
    place.write(&TINY.replace("population = 20", "population = 21"));
    let said = place.refused(&[]);
    for part in [
        "experiment.set.evolution.population is 20 there and 21 here",
        "configurations.cartpole-original",
        "--out",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    place.write(TINY);
    let manifest = place.path("experiment.toml");
    let made = fs::read_to_string(&manifest).expect("a manifest");
    let version = format!("tpg = \"{}\"", env!("CARGO_PKG_VERSION"));
    fs::write(&manifest, made.replace(&version, "tpg = \"0.0.9\"")).expect("written");
    let said = place.refused(&[]);
    assert!(said.contains("made-with.tpg is \"0.0.9\" there"), "{said}");
    fs::write(&manifest, made).expect("written");
    // A row that was copied from elsewhere.
    let row = place.path("rows/cartpole.no-memory.1.csv");
    let whole = fs::read_to_string(&row).expect("a row");
    fs::write(&row, whole.replace("generations:2", "generations:3")).expect("written");
    let said = place.refused(&[]);
    assert!(
        said.contains("budget is generations:3 there and generations:2 here"),
        "{said}"
    );
}

#[test]
fn mistakes_end_with_2_and_name_the_nearest() {
    let place = Place::new(TINY);
    for (old, new, expected) in [
        ("cartpole", "cartpol", "\"cartpole\""),
        ("no-memory", "no-memroy", "\"no-memory\""),
        ("repeats", "repeat", "\"repeats\""),
        (
            "evolution.children",
            "evolution.childen",
            "evolution.children",
        ),
    ] {
        place.write(&TINY.replace(old, new));
        let said = place.refused(&[]);
        assert!(said.contains(expected), "{new}: {said}");
    }
    place.write(TINY);
    let said = place.refused(&["--only", "cartpole.orignal.2"]);
    assert!(said.contains("cartpole.original.2"), "{said}");
    assert!(!place.results().exists(), "a mistake left something behind");
    let missing = tpg(["experiment", "run", "missing.toml"]);
    assert_eq!(missing.status.code(), Some(3));
}

/// Ctrl-C while generations are long; the second start goes on and ends as if nothing had happened.
#[cfg(unix)]
#[test]
fn an_interrupted_experiment_goes_on() {
    let longer = TINY
        .replace("generations = 2", "generations = 400")
        .replace("\"original\", ", "");
    let place = Place::new(&longer);
    let file = place.file();
    let undisturbed = place.folder.path().join("undisturbed");
    tpg_ok(&[
        "experiment",
        "run",
        text(&file),
        "--out",
        text(&undisturbed),
    ]);
    let child = start(["experiment", "run", text(&file), "--jobs", "1"]);
    let log = place.path("work/cartpole.no-memory.1/log.csv");
    while fs::read_to_string(&log).map_or(0, |text| text.lines().count()) < 3 {
        std::thread::sleep(Duration::from_millis(1));
        assert!(
            !place.path("rows/cartpole.no-memory.2.csv").exists(),
            "it ended too soon to be interrupted"
        );
    }
    let id = child.id().to_string();
    let killed = std::process::Command::new("kill")
        .args(["-INT", &id])
        .status();
    assert!(killed.expect("kill runs").success());
    let output = finish(child);
    assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
    assert!(place.path("work/cartpole.no-memory.1/checkpoint").exists());
    let run = fs::read_to_string(place.path("work/cartpole.no-memory.1/run.toml"));
    let commit = tpg_ok(&["--version"]).stdout;
    let commit = String::from_utf8(commit).expect("text");
    if let Some((_, commit)) = commit.trim().trim_end_matches(')').split_once(" (") {
        assert!(run.expect("a file").contains(commit), "no commit {commit}");
    }
    assert!(!place.path("rows/cartpole.no-memory.1.csv").exists());
    place.run();
    assert_eq!(rows(&place.results()), rows(&undisturbed));
}

/// The same champion's accesses, counted once more from the trace that `tpg eval` writes of it, and what it scores if it forgets.
#[test]
fn accesses_are_those_of_a_trace() {
    let memory = TINY
        .replace("no-memory", "sr-sm")
        .replace("repeats = 2", "repeats = 1");
    let place = Place::new(&memory);
    place.run();
    for cell in Experiment::parse(&memory)
        .expect("valid")
        .cells()
        .expect("valid")
    {
        let mut session = Session::new(cell.config.clone(), cell.seed).expect("valid");
        let mut pool = session.pool(1).expect("a pool");
        for _ in 0..2 {
            session.advance(&mut pool).expect("scored");
        }
        let whole = place.folder.path().join("whole.tpg");
        let blob = session.lower_champion(Mode::Whole).expect("small enough");
        fs::write(&whole, blob).expect("written");
        let trace = place.folder.path().join("whole.trace");
        let seed = cell.seed.to_string();
        let mut eval = vec!["eval", text(&whole), "--episodes", "4", "--seed", &seed];
        eval.extend(["--json", "--trace", text(&trace)]);
        let report: serde_json::Value =
            serde_json::from_slice(&tpg_ok(&eval).stdout).expect("JSON");
        let row = &rows(&place.results())[&cell.name];
        assert_eq!(report["returns"], serde_json::json!(row.test_returns));
        assert_eq!(
            report["instructions_mean"].as_f64(),
            Some(row.instructions_mean)
        );
        let (counted, decisions) = count(&fs::read_to_string(&trace).expect("a trace"));
        let written = accesses(&place.results(), &cell.name);
        assert!(written.iter().all(|access| access.decisions == decisions));
        let written: BTreeMap<_, u64> = written
            .iter()
            .map(|a| ((a.program, a.access, a.section, a.slot), a.count))
            .collect();
        assert!(cell.variant != "original" || written.values().sum::<u64>() > 0);
        assert_eq!(written, counted, "{}", cell.name);
        let ablations = place.path(&format!("ablations/{}.csv", cell.name));
        let ablations: Vec<Ablation> = if ablations.exists() {
            read_table(&ablations).expect("whole")
        } else {
            Vec::new()
        };
        let forgotten: Vec<Forgets> = ablations.iter().map(|a| a.forgets).collect();
        let expected = [Forgets::Registers, Forgets::Memory, Forgets::All];
        assert_eq!(forgotten, expected, "{}", cell.name);
        for ablation in ablations {
            let what = format!("{:?}", ablation.forgets).to_lowercase();
            let mut eval = vec!["eval", text(&whole), "--episodes", "4", "--seed", &seed];
            eval.extend(["--json", "--ablate", &what]);
            let report: serde_json::Value =
                serde_json::from_slice(&tpg_ok(&eval).stdout).expect("JSON");
            let returns = serde_json::json!(ablation.test_returns);
            assert_eq!(
                report["ablation"]["returns"], returns,
                "{}: {what}",
                cell.name
            );
        }
    }
}

type Counts = BTreeMap<(u16, AccessKind, MemorySection, u16), u64>;

/// The accesses of a trace, and its decisions.
fn count(trace: &str) -> (Counts, u64) {
    let (mut counts, mut decisions) = (Counts::new(), 0);
    for line in trace.lines() {
        let line: serde_json::Value = serde_json::from_str(line).expect("JSON");
        let Some(path) = line["decision"]["path"].as_array() else {
            continue;
        };
        decisions += 1;
        for bid in path
            .iter()
            .flat_map(|visit| visit["programs"].as_array().expect("bids"))
        {
            let program = bid["program"].as_u64().expect("a number") as u16;
            for (key, kind) in [("reads", AccessKind::Read), ("writes", AccessKind::Write)] {
                for name in bid[key].as_array().expect("places") {
                    let (section, slot) = place(name.as_str().expect("a name"));
                    *counts.entry((program, kind, section, slot)).or_default() += 1;
                }
            }
        }
    }
    (counts, decisions)
}

/// `sm4`, `vm3`, `mm5` or `cell[49,2]`.
fn place(name: &str) -> (MemorySection, u16) {
    let number = |text: &str| text.parse().expect("a slot");
    if let Some(cell) = name.strip_prefix("cell[") {
        let (row, _) = cell.split_once(',').expect("row and column");
        return (MemorySection::Indexed, number(row));
    }
    let (section, slot) = name.split_at(2);
    let section = match section {
        "sm" => MemorySection::Scalar,
        "vm" => MemorySection::Vector,
        "mm" => MemorySection::Matrix,
        other => panic!("no section is called {other}"),
    };
    (section, number(slot))
}
