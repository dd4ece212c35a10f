//! The test bench: requirements, recordings, bench files, what the system is asked for.
#![cfg(feature = "plant")]

mod support;

use std::os::unix::fs::PermissionsExt as _;
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use clap::Parser;
use serde_json::Value;
use support::{End, Folder, Process, policy};
use tpg_runtime::{Action, HostAgent, Policy, Reset};
use tpg_tasks::eval::{Controller, Reply, evaluate};
use tpg_tasks::score::ScoreArgs;

const HIL: &str = env!("CARGO_BIN_EXE_tpg-hil");
const PLANT: &str = env!("CARGO_BIN_EXE_tpg-plant");
const BENCH: &str = env!("CARGO_BIN_EXE_tpg-bench");
/// A user with no rights.
const NOBODY: u32 = 65_534;

fn cartpole(folder: &Folder) -> PathBuf {
    folder.file("cartpole.tpg", &policy::cartpole(1))
}

fn hil(file: &Path, arguments: &[&str]) -> End {
    Process::start(HIL, file, arguments).end()
}

fn text(path: &Path) -> &str {
    path.to_str().expect("text")
}

#[test]
fn requirements_pass_or_fail_with_a_status_of_their_own() {
    let folder = Folder::new();
    let file = cartpole(&folder);
    let junit = folder.file("result.xml", b"");
    let common = ["--episodes", "3", "--json", "--junit", text(&junit)];
    let run = |requirements: &[&str]| {
        let required = requirements.iter().flat_map(|text| ["--require", text]);
        let all: Vec<&str> = common.iter().copied().chain(required).collect();
        let end = hil(&file, &all);
        let report: Value = serde_json::from_str(&end.stdout).expect("JSON");
        let xml = std::fs::read_to_string(&junit).expect("written");
        (end, report, xml)
    };
    let (end, report, xml) = run(&["mean >= 9", "p99 < 60s", "episodes == 3"]);
    assert_eq!(end.status.code(), Some(0), "{end:?}");
    let met = report["requirements"].as_array().expect("a list");
    assert!(met.iter().all(|checked| checked["met"] == true), "{report}");
    assert_eq!(met[0]["value"], report["mean"]);
    assert!(
        xml.contains("tests=\"4\" failures=\"0\" errors=\"0\""),
        "{xml}"
    );
    let (end, report, xml) = run(&["mean >= 9", "max < 1", "p50 < 1ns"]);
    end.assert_failure(5, &["error: 2 of 3 requirements do not hold: max < 1 ("]);
    assert_eq!(report["requirements"][1]["met"], false);
    assert!(
        xml.contains("tests=\"4\" failures=\"2\" errors=\"0\""),
        "{xml}"
    );
    assert!(xml.contains("<failure message=\"max is "), "{xml}");
}

#[test]
fn what_cannot_be_required_is_refused_before_anything_starts() {
    let folder = Folder::new();
    let file = cartpole(&folder);
    for (requirement, expected) in [
        ("misses == 0", "add --realtime"),
        ("damaged == 0", "add --controller"),
        ("men >= 3", "latency-max (time)"),
        ("p99 < 2", "with ns, us, ms or s behind it"),
        ("mean", "compares nothing"),
    ] {
        let end = hil(&file, &["--require", requirement]);
        end.assert_failure(2, &[expected]);
        assert!(!end.stderr.contains("broke off"), "{end:?}");
    }
}

#[test]
fn a_loop_that_breaks_off_leaves_an_error_for_the_test_server() {
    let folder = Folder::new();
    let file = cartpole(&folder);
    let junit = folder.file("result.xml", b"old");
    let arguments = [
        "--controller",
        "serial:/dev/no-such-tty",
        "--junit",
        text(&junit),
    ];
    hil(&file, &arguments).assert_failure(4, &["cannot open"]);
    let xml = std::fs::read_to_string(&junit).expect("written");
    assert!(
        xml.contains("errors=\"1\"") && xml.contains("<error message="),
        "{xml}"
    );
}

/// What an agent was sent and answered, bit by bit.
struct Noted<'a> {
    inner: &'a mut HostAgent<'static>,
    steps: Vec<(Vec<f32>, Vec<u32>, u32)>,
}

impl Controller for Noted<'_> {
    type Error = tpg_runtime::ObservationError;

    fn reset(&mut self, what: Reset, agent_seed: u64) -> Result<(), Self::Error> {
        Controller::reset(&mut *self.inner, what, agent_seed)
    }

    fn decide(&mut self, observation: &[f32]) -> Result<Reply<'_>, Self::Error> {
        let reply = Controller::decide(&mut *self.inner, observation)?;
        let action = match reply.action {
            Action::Discrete(index) => vec![f32::from(index).to_bits()],
            Action::Continuous(values) => values.iter().map(|v| v.to_bits()).collect(),
        };
        self.steps
            .push((observation.to_vec(), action, reply.instructions));
        Ok(reply)
    }
}

#[derive(Parser)]
struct Score {
    #[command(flatten)]
    score: ScoreArgs,
}

const LOSSY: [&str; 4] = ["--episodes", "3", "--disturb", "loss:1/4"];

/// The same episodes in this process.
fn expected_steps(file: &Path) -> Vec<(Vec<f32>, Vec<u32>, u32)> {
    let args = Score::parse_from(["tpg", text(file)].iter().chain(&LOSSY));
    let setup = args.score.resolve().expect("the arguments fit");
    let blob: &'static [u8] = setup.blob.clone().leak();
    let mut agent = Box::new(HostAgent::new(Policy::load(blob).expect("valid")).expect("fits"));
    let noted = Noted {
        inner: &mut agent,
        steps: Vec::new(),
    };
    let mut arena = setup.arena().expect("the task exists");
    let mut controller = setup
        .disturbed(&arena, noted)
        .expect("the disturbances fit");
    evaluate(&mut arena, &mut controller, setup.episode_seeds()).expect("nothing can fail");
    controller.into_inner().steps
}

#[test]
fn recordings_hold_the_bits_of_every_step() {
    let folder = Folder::new();
    let file = cartpole(&folder);
    let expected = expected_steps(&file);
    let missing = expected
        .iter()
        .filter(|(seen, ..)| seen[0].is_nan())
        .count();
    assert!(missing > 0 && missing < expected.len(), "{missing}");
    let [mcap, csv, latencies] = ["a.mcap", "a.csv", "a.hgrm"].map(|name| folder.file(name, b""));
    for place in [&mcap, &csv] {
        let record = [
            "--record",
            text(place),
            "--latency-histogram",
            text(&latencies),
        ];
        let end = hil(&file, &[&LOSSY[..], &record].concat());
        assert_eq!(end.status.code(), Some(0), "{end:?}");
    }
    let bytes = std::fs::read(&mcap).expect("written");
    let messages = mcap::MessageStream::new(&bytes).expect("MCAP");
    let messages: Vec<_> = messages.map(|m| m.expect("a message")).collect();
    assert_eq!(messages.len(), expected.len());
    let schema = messages[0].channel.schema.clone().expect("a schema");
    assert_eq!(schema.encoding, "jsonschema");
    let schema: Value = serde_json::from_slice(&schema.data).expect("JSON");
    assert!(schema.to_string().contains("pole_angle [rad]"), "{schema}");
    let mut before = 0;
    for (message, (seen, action, instructions)) in messages.iter().zip(&expected) {
        let value: Value = serde_json::from_slice(&message.data).expect("JSON");
        for key in schema["required"].as_array().expect("a list") {
            assert!(
                value.get(key.as_str().expect("text")).is_some(),
                "{key} {value}"
            );
        }
        for (k, element) in seen.iter().enumerate() {
            let read = value["observation"][k]
                .as_f64()
                .map(|v| (v as f32).to_bits());
            assert_eq!(read, element.is_finite().then(|| element.to_bits()));
            assert_eq!(value["mask"][k], element.is_finite());
        }
        assert_eq!(
            value["action"][0].as_f64().map(|v| (v as f32).to_bits()),
            Some(action[0])
        );
        assert_eq!(value["instructions"], *instructions);
        assert_eq!(value["link"], "answer");
        assert!(value["latency_us"].as_f64() > Some(0.0));
        assert!(message.log_time > before, "times grow");
        before = message.log_time;
    }
    let mut reader = csv_lines(&csv);
    let names = reader.remove(0);
    let column = |name: &str| names.iter().position(|n| n == name).expect(name);
    assert_eq!(reader.len(), expected.len());
    for (row, (seen, action, _)) in reader.iter().zip(&expected) {
        let angle = &row[column("observation.pole_angle")];
        let read = angle.parse().ok().map(f32::to_bits);
        assert_eq!(read, seen[2].is_finite().then(|| seen[2].to_bits()));
        assert_eq!(
            row[column("mask")],
            if seen[2].is_finite() { "1111" } else { "0000" }
        );
        assert_eq!(
            row[column("action.push")].parse().map(f32::to_bits),
            Ok(action[0])
        );
    }
    let histogram = std::fs::read_to_string(&latencies).expect("written");
    let total = format!("Total count    = {:12}]", expected.len());
    assert!(histogram.contains(&total), "{histogram}");
    let last = histogram
        .lines()
        .rfind(|line| line.contains("1.000000000000"));
    let last = last.expect("the last percentile");
    assert_eq!(
        last.split_whitespace().nth(2),
        Some(&*expected.len().to_string())
    );
}

/// The cells of a file without quotes.
fn csv_lines(path: &Path) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(path).expect("written");
    let cells = |line: &str| line.split(',').map(str::to_owned).collect();
    text.lines().map(cells).collect()
}

#[test]
fn misses_are_recorded() {
    let folder = Folder::new();
    // 0.2 ms are too short for many answers of a busy machine, and the plant itself overruns.
    let file = folder.file("fast.tpg", &policy::cartpole_every(1, 200));
    let csv = folder.file("a.csv", b"");
    let arguments = [
        "--realtime",
        "--episodes",
        "20",
        "--json",
        "--record",
        text(&csv),
    ];
    let end = hil(&file, &arguments);
    assert_eq!(end.status.code(), Some(0), "{end:?}");
    let report: Value = serde_json::from_str(&end.stdout).expect("JSON");
    let lines = csv_lines(&csv);
    let column = |name: &str| lines[0].iter().position(|n| n == name).expect(name);
    let count = |name: &str, cell: &str| {
        let place = column(name);
        let rows = lines[1..].iter().filter(|row| row[place] == cell);
        Some(rows.count() as u64)
    };
    let realtime = &report["realtime"];
    assert_eq!(count("miss", "1"), realtime["misses"].as_u64());
    assert_eq!(count("latency_us", ""), realtime["misses"].as_u64());
    assert_eq!(count("link", "held"), realtime["held_steps"].as_u64());
    assert_eq!(count("link", "safe"), realtime["safe_steps"].as_u64());
    assert_eq!(
        lines.len() as u64 - 1,
        realtime["periods"].as_u64().expect("a number")
    );
}

#[test]
fn outputs_that_cannot_be_written_are_named() {
    let folder = Folder::new();
    let file = cartpole(&folder);
    let below = format!("{}/a.mcap", text(&file));
    hil(&file, &["--record", &below]).assert_failure(2, &[&below]);
    hil(&file, &["--record", "a.bag"]).assert_failure(2, &["end the name in .mcap or .csv"]);
}

fn bench(file: &Path, arguments: &[&str]) -> End {
    Process::start(BENCH, file, arguments).end()
}

#[test]
fn a_bench_file_runs_every_policy_in_every_scenario() {
    let folder = Folder::new();
    cartpole(&folder);
    folder.file(
        "faults.txt",
        b"# a sensor fails\nat 0.1s stuck:pole_angle for 0.5s\n\nloss:1/4\n",
    );
    let toml = folder.file(
        "acceptance.toml",
        br#"
        require = ["episodes == 4"]
        loop = { episodes = 4, seed = 3 }
        [[policy]]
        file = "cartpole.tpg"
        [[policy]]
        name = "no board"
        file = "cartpole.tpg"
        loop = { controller = "serial:/dev/no-such-tty" }
        [[scenario]]
        name = "nominal"
        require = ["mean >= 9"]
        [[scenario]]
        name = "faults"
        script = "faults.txt"
        disturb = ["delay:1"]
        require = ["mean >= 1e6"]
        "#,
    );
    let (junit, out) = (folder.file("result.xml", b""), toml.with_file_name("out"));
    let arguments = ["--json", "--junit", text(&junit), "--out", text(&out)];
    let end = bench(&toml, &arguments);
    assert_eq!(end.status.code(), Some(4), "{end:?}");
    let report: Value = serde_json::from_str(&end.stdout).expect("JSON");
    let results = report["cases"].as_array().expect("a list").iter();
    let results: Vec<_> = results
        .map(|case| case["result"].as_str().expect("text"))
        .collect();
    assert_eq!(results, ["passed", "failed", "error", "error"]);
    let outcome = &report["cases"][1]["outcome"];
    let disturbances = ["delay:1", "at 0.1s stuck:pole_angle for 0.5s", "loss:1/4"];
    assert_eq!(outcome["disturbances"], serde_json::json!(disturbances));
    assert_eq!(
        (&outcome["seed"], report["passed"].as_u64()),
        (&3.into(), Some(1))
    );
    let xml = std::fs::read_to_string(&junit).expect("written");
    assert!(
        xml.contains("acceptance / cartpole / faults\" tests=\"3\" failures=\"1\" errors=\"0\""),
        "{xml}"
    );
    assert!(
        xml.contains("acceptance / no board / nominal\" tests=\"1\" failures=\"0\" errors=\"1\""),
        "{xml}"
    );
    for name in [
        "cartpole--nominal.mcap",
        "cartpole--faults.hgrm",
        "cartpole--nominal.json",
    ] {
        let length = std::fs::metadata(out.join(name)).map(|file| file.len());
        assert!(length.expect(name) > 0, "{name}");
    }
}

#[test]
fn a_bench_without_the_lost_cause_ends_with_the_status_of_requirements() {
    let folder = Folder::new();
    cartpole(&folder);
    let file = |requirement: &str| {
        let text = format!("require = [\"{requirement}\"]\n[[policy]]\nfile = \"cartpole.tpg\"\n");
        folder.file("bench.toml", text.as_bytes())
    };
    let end = bench(&file("mean >= 1e6"), &[]);
    assert_eq!(end.status.code(), Some(5), "{end:?}");
    assert!(end.stdout.contains("cartpole / nominal  FAILED"), "{end:?}");
    assert!(end.stdout.contains("mean >= 1e6: mean is "), "{end:?}");
    let end = bench(&file("mean >= 1"), &[]);
    assert_eq!(end.status.code(), Some(0), "{end:?}");
    assert!(end.stdout.contains("1 of 1 cases passed"), "{end:?}");
}

#[test]
fn mistakes_in_a_bench_file_are_found_before_anything_runs() {
    let folder = Folder::new();
    cartpole(&folder);
    let policy = "[[policy]]\nfile = \"cartpole.tpg\"\n";
    for (text, status, expected) in [
        ("", 3, "lists no policy"),
        ("polcy = 1", 3, "unknown field `polcy`"),
        (
            &format!("loop = {{ episode = 3 }}\n{policy}"),
            3,
            "unexpected argument '--episode'",
        ),
        (
            &format!("loop = {{ episodes = 0 }}\n{policy}"),
            3,
            "invalid value '0'",
        ),
        (
            &format!("loop = {{ json = true }}\n{policy}"),
            3,
            "which the bench itself sets",
        ),
        (
            &format!("loop = {{ seed = 1.5 }}\n{policy}"),
            3,
            "seed is 1.5",
        ),
        (
            &format!("require = [\"men > 3\"]\n{policy}"),
            3,
            "no quantity \"men\"",
        ),
        (
            &format!("require = [\"misses == 0\"]\n{policy}"),
            2,
            "add --realtime",
        ),
        (
            &format!("{policy}{policy}"),
            3,
            "two cases are called cartpole / nominal",
        ),
        ("[[policy]]\nfile = \"none.tpg\"", 3, "cannot read"),
        (
            &format!("{policy}[[scenario]]\nname = \"a\"\ndisturb = [\"stuck:wheel\"]"),
            2,
            "names no channel of this policy",
        ),
    ] {
        let file = folder.file("bench.toml", text.as_bytes());
        let end = bench(&file, &[]);
        end.assert_failure(status, &[expected]);
        assert!(end.stderr.contains("bench.toml"), "{end:?}");
        assert!(!end.stderr.contains("case 1 of"), "{end:?}");
    }
}

#[test]
fn a_processor_is_taken_or_refused() {
    let folder = Folder::new();
    let file = cartpole(&folder);
    let end = hil(&file, &["--episodes", "2", "--cpu", "0", "--json"]);
    assert_eq!(end.status.code(), Some(0), "{end:?}");
    hil(&file, &["--cpu", "9999"]).assert_failure(2, &["cannot run on processor 9999"]);
    hil(&file, &["--cpu", "0,0,0"]).assert_failure(2, &["give --cpu one number"]);
    hil(&file, &["--priority", "80"]).assert_failure(2, &["use FIFO:1 to FIFO:99"]);
}

/// A user without rights learns what to do. Users with the right to a priority are not refused, so this needs root,
/// who can become one without.
#[test]
fn a_user_without_the_rights_learns_how_to_get_them() {
    let folder = Folder::new();
    let file = cartpole(&folder);
    let root = std::fs::metadata("/proc/self").is_ok_and(|own| {
        use std::os::unix::fs::MetadataExt as _;
        own.uid() == 0
    });
    if !root {
        println!("skipped: only root can become a user without rights");
        return;
    }
    let parent = file.parent().expect("a folder");
    let open = std::fs::Permissions::from_mode(0o755);
    std::fs::set_permissions(parent, open).expect("it is ours");
    for (arguments, expected) in [
        (
            &["--priority", "FIFO:80"][..],
            "cannot take the priority FIFO:80: raise the limit by `ulimit -r 99`",
        ),
        (&["--lock-memory"], "cannot keep the process in memory"),
    ] {
        let mut command = Command::new(PLANT);
        command
            .arg(&file)
            .args(["--run", "rights", "--timeout-ms", "100"])
            .args(arguments);
        // Without the limits that root hands on.
        let mut limited = Command::new("prlimit");
        limited.args(["--memlock=65536:65536", "--rtprio=0:0", "--"]);
        limited.arg(command.get_program()).args(command.get_args());
        let end = Process::spawn(limited.uid(NOBODY)).end();
        if end.stderr.contains("ermission denied") {
            println!("skipped: this user may not run {PLANT}");
            return;
        }
        end.assert_failure(2, &[expected]);
    }
}
