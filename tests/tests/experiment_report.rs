//! The report of an experiment over small made-up runs: its numbers, its figures, its refusals.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use tempfile::TempDir;
use tpg_experiments::file::Experiment;
use tpg_experiments::folder::{Folder, Manifest};
use tpg_experiments::report::{self, ReportError};
use tpg_experiments::row::{
    Ablation, Access, AccessKind, CellFiles, CurvePoint, Forgets, MemorySection, Row,
    write_ablations, write_accesses, write_curve, write_row,
};

/// An experiment of chapter 3: two tasks, two variants, five repeats.
const CHAPTER_3: &str = r#"
name = "made-up"
chapter = 3
tasks = ["inverted-double-pendulum-skip1", "hopper-skip1"]
variants = ["sr-b23", "sr-sm-b23"]
repeats = 5
test-episodes = 4
budget = { generations = 30 }
"#;

/// Another of chapter 2, with too many variants for so few repeats.
const CHAPTER_2: &str = r#"
name = "made-up"
chapter = 2
tasks = ["cartpole"]
variants = ["original", "per-generation", "per-agent", "per-episode", "no-memory"]
repeats = 3
test-episodes = 4
budget = { generations = 30 }
"#;

/// A finished run whose champion returns `mean` − 1, `mean`, `mean`, `mean` + 1.
fn row(task: &str, variant: &str, repeat: u32, mean: f64) -> Row {
    Row {
        task: task.into(),
        variant: variant.into(),
        repeat,
        seed: u64::from(repeat),
        config: "0123456789abcdef".into(),
        tpg: "0.1.0".into(),
        fingerprint: "00000001".into(),
        budget: "generations:30".into(),
        threads: 1,
        generations: 30,
        steps: 36_000,
        train_seconds: 120.0,
        cpu_seconds: 90.0,
        train_best: mean + 100.0,
        champion_id: 7,
        champion_bytes: 900,
        champion_teams: 1,
        champion_programs: 6,
        champion_instructions: 80,
        instructions_mean: 50.0 + f64::from(repeat),
        test_episodes: 4,
        test_mean: mean,
        test_sd: (2.0f64 / 3.0).sqrt(),
        test_median: mean,
        test_returns: vec![mean - 1.0, mean, mean, mean + 1.0],
        unstable: 0,
    }
}

/// Writes a run with a curve that ends at `mean` and, for shared memory, some accesses.
fn finish(folder: &Path, row: &Row) {
    let files = CellFiles::new(folder, &row.cell());
    let manifest = Manifest::read(folder).expect("an experiment");
    let hash = manifest
        .configurations
        .get(&format!("{}-{}", row.task, row.variant));
    let made_here = Row {
        config: hash.unwrap_or(&row.config).clone(),
        fingerprint: manifest.made_with.fingerprint,
        tpg: manifest.made_with.tpg,
        ..row.clone()
    };
    let row = &made_here;
    let curve: Vec<CurvePoint> = (1..=row.generations)
        .map(|generation| {
            let part = generation as f64 / row.generations as f64;
            CurvePoint {
                generation,
                steps: generation * 1200,
                seconds: part * row.train_seconds,
                best: row.test_mean * part.sqrt(),
                mean: row.test_mean * part / 2.0,
                instructions_mean: 20.0 + 30.0 * part + f64::from(row.repeat),
                champion_teams: 1,
                champion_programs: 6,
                champion_instructions: 80,
            }
        })
        .collect();
    write_curve(&files.curve, &curve).expect("written");
    if row.variant.starts_with("sr-sm") {
        let mut accesses = Vec::new();
        for slot in 0..8u16 {
            for (program, access, section) in [
                (0, AccessKind::Write, MemorySection::Matrix),
                (2, AccessKind::Read, MemorySection::Matrix),
                (5, AccessKind::Read, MemorySection::Vector),
            ] {
                let count = u64::from(4 * (1 + slot.min(7 - slot)) + program);
                accesses.push(Access {
                    program,
                    access,
                    section,
                    slot,
                    count,
                    decisions: 4000,
                });
            }
        }
        write_accesses(&files.accesses, &accesses).expect("written");
        // Without registers it loses as much in each episode as its repeat's number, without memory nothing.
        let ablations = [(Forgets::Registers, row.repeat), (Forgets::Memory, 0)];
        let ablations = ablations.map(|(forgets, drop)| {
            let returns = row.test_returns.iter().map(|x| x - f64::from(drop));
            Ablation {
                forgets,
                test_mean: row.test_mean - f64::from(drop),
                test_returns: returns.collect(),
            }
        });
        write_ablations(&files.ablations, &ablations).expect("written");
    }
    write_row(&files.row, row).expect("written");
}

fn folder(experiment: &str) -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let experiment = Experiment::parse(experiment).expect("valid");
    let cells = experiment.cells().expect("valid");
    Folder::open(folder.path(), &Manifest::new(&experiment, &cells)).expect("made");
    folder
}

/// Chapter 3, whole: on the pendulum shared memory is always better, on the hopper the variants take turns.
fn chapter_3() -> TempDir {
    let folder = folder(CHAPTER_3);
    for repeat in 1..=5 {
        let n = f64::from(repeat);
        for (task, variant, mean) in [
            ("inverted-double-pendulum-skip1", "sr-b23", 100.0 * n),
            (
                "inverted-double-pendulum-skip1",
                "sr-sm-b23",
                1000.0 + 10.0 * n,
            ),
            ("hopper-skip1", "sr-b23", 20.0 * n),
            ("hopper-skip1", "sr-sm-b23", 20.0 * n + 5.0),
        ] {
            finish(folder.path(), &row(task, variant, repeat, mean));
        }
    }
    folder
}

/// A CSV file as lines of columns by name.
fn table(folder: &Path, name: &str) -> Vec<BTreeMap<String, String>> {
    let text = fs::read_to_string(folder.join("report").join(name)).expect("written");
    let mut lines = text.lines().map(|line| line.split(','));
    let columns: Vec<&str> = lines.next().expect("a header").collect();
    let named = |fields: std::str::Split<'_, char>| {
        let pairs = columns.iter().zip(fields);
        pairs
            .map(|(k, v)| ((*k).to_owned(), v.to_owned()))
            .collect()
    };
    lines.map(named).collect()
}

fn number(line: &BTreeMap<String, String>, column: &str) -> f64 {
    line[column]
        .parse()
        .unwrap_or_else(|_| panic!("{column}: {line:?}"))
}

fn assert_near(a: f64, b: f64) {
    assert!((a - b).abs() <= 1e-9 * b.abs(), "{a} is not {b}");
}

#[test]
fn the_main_table_says_what_the_rows_say() {
    let folder = chapter_3();
    let summary = report::write(folder.path()).expect("a report");
    assert_eq!(summary.runs, "20 of 20 runs");
    let lines = table(folder.path(), "scores.csv");
    assert_eq!(lines.len(), 4);
    let line = &lines[0];
    assert_eq!((&*line["variant"], &*line["runs"]), ("sr-b23", "5"));
    assert_near(number(line, "test_mean"), 300.0);
    assert_near(number(line, "test_median"), 300.0);
    assert_near(number(line, "test_best"), 500.0);
    assert_near(number(line, "train_best"), 600.0);
    assert_near(number(line, "instructions_per_decision"), 53.0);
    assert_near(number(line, "thesis_train_best"), 9349.92);
    // SciPy's percentile bootstrap of 100, 200, 300, 400, 500 gives [180, 420].
    assert!((number(line, "test_mean_low") - 180.0).abs() <= 10.0);
    assert!((number(line, "test_mean_high") - 420.0).abs() <= 10.0);
    assert_near(number(&lines[3], "thesis_train_best"), 3078.25);
    let text = fs::read_to_string(folder.path().join("report/scores.md")).expect("written");
    assert!(
        text.contains("best of 5 repeats") && text.contains("20 of 20 runs."),
        "{text}"
    );
}

/// The p-values are SciPy's: `mannwhitneyu(a, b, method="exact")` over seeds, `method="asymptotic"` over episodes.
#[test]
fn pairs_are_tested_over_episodes_and_over_seeds() {
    let folder = chapter_3();
    report::write(folder.path()).expect("a report");
    let lines = table(folder.path(), "pairs.csv");
    assert_eq!(lines.len(), 2);
    let pendulum = &lines[0];
    assert_near(number(pendulum, "seeds_p"), 2.0 / 252.0);
    assert_near(number(pendulum, "seeds_p_holm"), 2.0 / 252.0);
    assert_near(number(pendulum, "seeds_delta"), -1.0);
    assert_eq!(pendulum["seeds_verdict"], "second is greater");
    assert_near(number(pendulum, "episodes_p"), 0.028_429_535_998_796_527);
    assert_eq!(pendulum["episodes_verdict"], "second is greater");
    let hopper = &lines[1];
    // 20…100 against 25…105: 10 of 25 pairs.
    assert_near(number(hopper, "seeds_u"), 10.0);
    assert_near(number(hopper, "seeds_p"), 0.690_476_190_476_190_5);
    assert_eq!(
        hopper["seeds_verdict"],
        "not distinguishable at this budget"
    );
    assert_eq!(hopper["episodes_verdict"], "second is greater");
}

#[test]
fn what_champions_lose_by_forgetting_is_told_over_runs() {
    let folder = chapter_3();
    report::write(folder.path()).expect("a report");
    let lines = table(folder.path(), "ablations.csv");
    // Of both tasks the variant with memory, without its registers and without its memory.
    assert_eq!(lines.len(), 4);
    let (registers, memory) = (&lines[0], &lines[1]);
    assert_eq!(registers["forgets"], "registers");
    assert_near(number(registers, "drop"), 3.0);
    assert!((number(registers, "drop_low") - 1.8).abs() <= 0.1);
    assert_eq!(registers["losers"], "5 of 5");
    assert_eq!(memory["forgets"], "shared memory");
    assert_eq!([&*memory["drop"], &*memory["losers"]], ["0", "0 of 5"]);
    let text = fs::read_to_string(folder.path().join("report/ablations.md")).expect("written");
    assert!(text.contains("3.00 [1."), "{text}");
}

#[test]
fn throughput_is_totals_over_hours() {
    let folder = chapter_3();
    report::write(folder.path()).expect("a report");
    let lines = table(folder.path(), "throughput.csv");
    assert_near(number(&lines[0], "generations_per_hour"), 900.0);
    assert_near(number(&lines[0], "generations_per_cpu_hour"), 1200.0);
    assert_near(number(&lines[0], "steps_per_cpu_second"), 400.0);
}

#[test]
fn figures_are_drawn_and_the_same_results_give_the_same_bytes() {
    let folder = chapter_3();
    let files = report::write(folder.path()).expect("a report").files;
    let names: Vec<&str> = files
        .iter()
        .filter_map(|f| f.file_name()?.to_str())
        .collect();
    let expected = [
        "scores.md",
        "scores.csv",
        "pairs.md",
        "pairs.csv",
        "ablations.md",
        "ablations.csv",
        "throughput.md",
        "throughput.csv",
        "figure-3.5.svg",
        "figure-3.5.png",
        "score-over-steps.svg",
        "score-over-steps.png",
        "figure-3.6-sr-sm-b23.svg",
        "figure-3.6-sr-sm-b23.png",
        "figure-3.7-sr-sm-b23.svg",
        "figure-3.7-sr-sm-b23.png",
    ];
    assert_eq!(names, expected);
    for file in &files {
        let bytes = fs::read(file).expect("written");
        match file.extension().and_then(|extension| extension.to_str()) {
            Some("svg") => {
                let text = String::from_utf8(bytes).expect("text");
                let document = roxmltree::Document::parse(&text).expect("XML");
                let words: String = document
                    .descendants()
                    .filter_map(|node| node.text())
                    .collect();
                assert!(words.contains("hopper"), "{words}");
                assert!(!text.contains("NaN") && !text.contains("inf"));
            }
            Some("png") => {
                let reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info();
                let size = reader.expect("a PNG file").info().size();
                assert!(size.0 == 1520 && (600..1300).contains(&size.1), "{size:?}");
            }
            _ => {}
        }
    }
    let read = || -> Vec<_> {
        files
            .iter()
            .map(|file| fs::read(file).expect("there"))
            .collect()
    };
    let first = read();
    let again = chapter_3();
    let second: Vec<_> = report::write(again.path()).expect("a report").files;
    let second: Vec<_> = second
        .iter()
        .map(|file| fs::read(file).expect("there"))
        .collect();
    assert!(first == second, "another folder with the same results");
}

#[test]
fn a_part_of_the_runs_makes_a_report_that_says_so() {
    let folder = folder(CHAPTER_2);
    for repeat in 1..=3 {
        for (i, variant) in ["original", "per-generation", "per-agent", "per-episode"]
            .iter()
            .enumerate()
        {
            let mean = 10.0 * i as f64 + f64::from(repeat);
            finish(folder.path(), &row("cartpole", variant, repeat, mean));
        }
    }
    fs::remove_file(folder.path().join("rows/cartpole.original.2.csv")).expect("there");
    let summary = report::write(folder.path()).expect("a report");
    assert_eq!(
        summary.runs,
        "11 of 15 runs; missing: cartpole.original.2, cartpole.no-memory.1, cartpole.no-memory.2, cartpole.no-memory.3"
    );
    let names: Vec<_> = summary
        .files
        .iter()
        .filter_map(|f| f.file_name()?.to_str())
        .collect();
    for figure in ["figure-2.4.svg", "figure-2.5.png", "figure-2.6.svg"] {
        assert!(names.contains(&figure), "{names:?}");
    }
    let lines = table(folder.path(), "scores.csv");
    assert_eq!(
        (
            &*lines[4]["variant"],
            &*lines[4]["runs"],
            &*lines[4]["test_mean"]
        ),
        ("no-memory", "0", "")
    );
    // Six pairs of four variants; 3 runs a side cannot tell any apart.
    let lines = table(folder.path(), "pairs.csv");
    assert_eq!(lines.len(), 6);
    assert!(
        lines
            .iter()
            .all(|line| line["seeds_verdict"] == "not distinguishable at this budget")
    );
    let text = fs::read_to_string(folder.path().join("report/pairs.md")).expect("written");
    assert!(text.contains("no p can be below 0.1000"), "{text}");
    assert!(
        text.contains("too few runs to tell any pair apart"),
        "{text}"
    );
}

#[test]
fn what_cannot_be_reported_is_refused_with_the_reason() {
    let message = |folder: &Path| -> String {
        let error: ReportError = report::write(folder).expect_err("no report");
        with_causes(&error)
    };
    let empty = tempfile::tempdir().expect("a folder");
    assert!(message(empty.path()).contains("no experiment's folder"));
    let unfinished = folder(CHAPTER_3);
    assert!(message(unfinished.path()).contains("no finished run yet"));

    let damaged = chapter_3();
    let file = damaged.path().join("rows/hopper-skip1.sr-b23.2.csv");
    let text = fs::read_to_string(&file).expect("there");
    fs::write(&file, &text[..text.len() - 9]).expect("written");
    let why = message(damaged.path());
    assert!(
        why.contains("hopper-skip1.sr-b23.2.csv") && why.contains("tpg experiment run"),
        "{why}"
    );

    let curveless = chapter_3();
    fs::remove_file(curveless.path().join("curves/hopper-skip1.sr-b23.2.csv")).expect("there");
    assert!(message(curveless.path()).contains("curves/hopper-skip1.sr-b23.2.csv"));

    let strange = chapter_3();
    finish(strange.path(), &row("hopper-skip1", "sl-b23", 1, 1.0));
    assert!(
        message(strange.path()).contains("hopper-skip1.sl-b23.1.csv is no run of this experiment")
    );

    let unlike = chapter_3();
    let other = Row {
        budget: "generations:31".into(),
        ..row("hopper-skip1", "sr-b23", 3, 1.0)
    };
    finish(unlike.path(), &other);
    let why = message(unlike.path());
    assert!(
        why.contains("hopper-skip1.sr-b23.3") && why.contains("budget is generations:31"),
        "{why}"
    );

    let forgetful = chapter_3();
    let file = forgetful
        .path()
        .join("accesses/hopper-skip1.sr-sm-b23.4.csv");
    fs::remove_file(file).expect("there");
    assert!(message(forgetful.path()).contains("accesses/hopper-skip1.sr-sm-b23.4.csv"));
}

/// An error with its causes, as the command prints it.
fn with_causes(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        text += &format!(": {cause}");
        source = cause.source();
    }
    text
}
