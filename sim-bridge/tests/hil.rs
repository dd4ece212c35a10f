//! Loops of real processes: the same returns as in one process, and every fault told.
#![cfg(feature = "plant")]

mod support;

use std::path::Path;

use clap::Parser;
use support::policy;
use support::{Folder, Process};
use tpg_runtime::{HostAgent, Policy};
use tpg_sim_bridge::RunName;
use tpg_tasks::eval::evaluate;
use tpg_tasks::score::ScoreArgs;

const HIL: &str = env!("CARGO_BIN_EXE_tpg-hil");
const PLANT: &str = env!("CARGO_BIN_EXE_tpg-plant");
const CONTROLLER: &str = env!("CARGO_BIN_EXE_tpg-controller");

#[derive(Parser)]
struct Score {
    #[command(flatten)]
    score: ScoreArgs,
}

/// Returns, lengths and instructions per decision, bit by bit.
type Bits = (Vec<u64>, Vec<u64>, u64);

/// What the episodes come to in this process.
fn in_process(file: &Path, arguments: &[&str]) -> Bits {
    let file = file.to_str().expect("UTF-8");
    let args = Score::parse_from(["tpg", file].iter().chain(arguments));
    let setup = args.score.resolve().expect("the arguments fit");
    let policy = Policy::load(&setup.blob).expect("the policy is valid");
    let mut agent = Box::new(HostAgent::new(policy).expect("the policy fits"));
    let mut arena = setup.arena().expect("the task exists");
    let mut controller = (setup.disturbed(&arena, &mut *agent)).expect("the disturbances fit");
    let episodes =
        evaluate(&mut arena, &mut controller, setup.episode_seeds()).expect("nothing can fail");
    let report = setup.report(&episodes);
    (
        report.returns.iter().map(|r| r.to_bits()).collect(),
        report.lengths.iter().map(|l| u64::from(*l)).collect(),
        report.instructions_mean.to_bits(),
    )
}

/// The same of `--json` output.
fn of_json(text: &str) -> Bits {
    let json: serde_json::Value = serde_json::from_str(text).expect("one JSON object");
    let array = |key: &str| json[key].as_array().expect("an array").clone();
    let bits = |value: &serde_json::Value| value.as_f64().expect("a number").to_bits();
    let lengths: Vec<u64> = array("lengths")
        .iter()
        .filter_map(serde_json::Value::as_u64)
        .collect();
    let latency = &json["latency"];
    assert_eq!(latency["unit"], "ns");
    assert_eq!(latency["count"].as_u64(), Some(lengths.iter().sum()));
    let of = |key: &str| latency[key].as_u64().expect("a number");
    assert!(of("median") <= of("p99") && of("p99") <= of("max"));
    assert!(of("median") > 0);
    (
        array("returns").iter().map(bits).collect(),
        lengths,
        bits(&json["instructions_mean"]),
    )
}

fn assert_loop_equals_process(file: &Path, arguments: &[&str]) {
    let arguments = [arguments, &["--json"]].concat();
    let end = Process::start(HIL, file, &arguments).end();
    assert!(end.status.success(), "{end:?}");
    assert_eq!(of_json(&end.stdout), in_process(file, &arguments));
}

/// Plant and controller of a run that does not end by itself, connected.
fn endless(file: &Path, run: &str, timeout_ms: &str) -> (Process, Process) {
    let link = ["--run", run, "--timeout-ms", timeout_ms];
    let controller = Process::start(CONTROLLER, file, &link);
    let plant_arguments = [&link[..], &["--episodes", "1000000000"]].concat();
    let plant = Process::start(PLANT, file, &plant_arguments);
    plant.await_line("connected to controller");
    controller.await_line("connected to plant");
    (plant, controller)
}

/// A name that no other test uses.
fn name() -> String {
    RunName::unique().to_string()
}

/// Longer than any test may take, in milliseconds.
const NEVER: &str = "3600000";

#[test]
fn returns_equal_those_of_one_process() {
    let folder = Folder::new();
    let file = folder.file("a.tpg", &policy::cartpole(0));
    assert_loop_equals_process(&file, &["--episodes", "7", "--seed", "3"]);
    let blackout = ["--episodes", "7", "--observability", "blackout:1/3"];
    assert_loop_equals_process(&file, &blackout);
    let stack = [
        "noise:0.01",
        "delay:1",
        "loss:1/10",
        "action:loss:1/5",
        "action:delay:1",
    ];
    let stack = stack.map(|disturbance| ["--disturb", disturbance]).concat();
    assert_ne!(in_process(&file, &stack), in_process(&file, &[]));
    assert_loop_equals_process(&file, &stack);
}

/// A policy of version 3 whose model fills in what is missing: loop and process agree in every bit.
#[cfg(feature = "mujoco")]
#[test]
fn returns_with_missing_values_equal_those_of_one_process() {
    use tpg_runtime::Blob;
    use tpg_runtime::blob::{encode, encoded_bound};

    let folder = Folder::new();
    let champion = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/champions/hopper-b23.tpg");
    let old = std::fs::read(champion).expect("a champion");
    let blob = Blob::decode(&old).expect("a policy");
    let mut new = vec![0; encoded_bound(blob.tables())];
    encode(blob.header(), blob.tables(), &mut new).expect("room");
    let file = folder.file("a.tpg", &new);
    let sight = ["--episodes", "2", "--observability", "none"];
    let faults = [
        &sight[..],
        &["--disturb", "nan:1:1/4", "--disturb", "drop:7:1/10"],
        &[
            "--disturb",
            "at 0.2s nan:3:1/2 for 1s",
            "--disturb",
            "loss:1/20",
        ],
    ]
    .concat();
    assert_ne!(in_process(&file, &faults), in_process(&file, &sight));
    assert_loop_equals_process(&file, &faults);
}

#[cfg(feature = "mujoco")]
#[test]
fn returns_of_the_hopper_equal_those_of_one_process() {
    let folder = Folder::new();
    let file = folder.file("a.tpg", &policy::hopper());
    assert_loop_equals_process(&file, &["--episodes", "3"]);
    let stack = [
        "action:noise:0.1",
        "loss:1/10",
        "quantise:0.001",
        "action:quantise:0.25",
    ];
    let stack = stack.map(|disturbance| ["--disturb", disturbance]).concat();
    assert_ne!(in_process(&file, &stack), in_process(&file, &[]));
    assert_loop_equals_process(&file, &stack);
}

#[test]
fn two_loops_do_not_disturb_each_other() {
    let folder = Folder::new();
    let files = [0, 1].map(|k| folder.file(&format!("{k}.tpg"), &policy::cartpole(k)));
    let seeds = ["11", "12"];
    let loops: Vec<_> = (0..4)
        .map(|k| {
            let (file, seed) = (&files[k % 2], seeds[k % 2]);
            let arguments = ["--seed", seed, "--episodes", "8", "--json"];
            (file, arguments, Process::start(HIL, file, &arguments))
        })
        .collect();
    for (file, arguments, process) in loops {
        let end = process.end();
        assert!(end.status.success(), "{end:?}");
        assert_eq!(of_json(&end.stdout), in_process(file, &arguments));
    }
}

#[test]
fn report_for_people_names_the_round_trip() {
    let folder = Folder::new();
    let file = folder.file("a.tpg", &policy::cartpole(0));
    let end = Process::start(HIL, &file, &["--episodes", "2"]).end();
    assert!(end.status.success(), "{end:?}");
    assert!(end.stdout.contains("mean return"), "{end:?}");
    assert!(end.stdout.contains("round trip     median"), "{end:?}");
    assert_eq!(end.stderr, "");
}

#[test]
fn missing_peer_is_told() {
    let folder = Folder::new();
    let file = folder.file("a.tpg", &policy::cartpole(0));
    let run = name();
    let arguments = ["--run", &run, "--timeout-ms", "300"];
    let expected = format!("joined run {run} within 300 ms");
    let end = Process::start(PLANT, &file, &arguments).end();
    end.assert_failure(4, &["no controller", &expected]);
    let end = Process::start(CONTROLLER, &file, &arguments).end();
    end.assert_failure(4, &["no plant", &expected, "--start-timeout-ms"]);
}

/// As a plant whose model compiles for longer than an answer may take.
#[test]
fn a_slow_start_has_a_deadline_of_its_own() {
    let folder = Folder::new();
    let file = folder.file("a.tpg", &policy::cartpole(0));
    let run = name();
    let link = ["--run", &run, "--timeout-ms", "3000"];
    let patient = [&link[..], &["--start-timeout-ms", "60000"]].concat();
    let controller = Process::start(CONTROLLER, &file, &patient);
    std::thread::sleep(std::time::Duration::from_millis(3500));
    let plant = Process::start(PLANT, &file, &[&link[..], &["--episodes", "1"]].concat());
    for end in [plant.end(), controller.end()] {
        assert!(end.status.success(), "{end:?}");
    }
    let short = [&link[..], &["--start-timeout-ms", "200"]].concat();
    let end = Process::start(CONTROLLER, &file, &short).end();
    end.assert_failure(4, &["no plant", "within 200 ms", "--start-timeout-ms"]);
}

#[test]
fn killed_controller_is_found_dead() {
    let folder = Folder::new();
    let file = folder.file("a.tpg", &policy::cartpole(0));
    let (plant, controller) = endless(&file, &name(), NEVER);
    controller.signal("KILL");
    let died = format!("controller died (process {})", controller.id());
    plant.end().assert_failure(4, &[&died]);
}

#[test]
fn killed_plant_is_found_dead() {
    let folder = Folder::new();
    let file = folder.file("a.tpg", &policy::cartpole(0));
    let (plant, controller) = endless(&file, &name(), NEVER);
    plant.signal("KILL");
    let died = format!("plant died (process {})", plant.id());
    controller.end().assert_failure(4, &[&died]);
}

#[test]
fn a_run_starts_again_after_both_were_killed() {
    let folder = Folder::new();
    let file = folder.file("a.tpg", &policy::cartpole(0));
    let run = name();
    let (plant, controller) = endless(&file, &run, NEVER);
    // Stopped first, so that neither clears up after the other.
    plant.signal("STOP");
    controller.signal("KILL");
    plant.signal("KILL");
    drop((plant, controller));
    let (plant, controller) = endless(&file, &run, NEVER);
    plant.signal("INT");
    plant.end().assert_failure(130, &["interrupted"]);
    controller.end().assert_failure(4, &["plant is gone"]);
}

#[test]
fn stopped_controller_is_called_silent() {
    let folder = Folder::new();
    let file = folder.file("a.tpg", &policy::cartpole(0));
    let (plant, controller) = endless(&file, &name(), "1500");
    controller.signal("STOP");
    let process = format!("(process {})", controller.id());
    let texts = [
        "controller is alive but silent for 15",
        &process,
        "stopped or stalled?",
    ];
    plant.end().assert_failure(4, &texts);
}

#[test]
fn other_policy_is_refused_by_both() {
    let folder = Folder::new();
    let run = name();
    let link = ["--run", &run];
    let [one, other] = [0, 1].map(|k| folder.file(&format!("{k}.tpg"), &policy::cartpole(k)));
    let controller = Process::start(CONTROLLER, &other, &link);
    let plant = Process::start(PLANT, &one, &link);
    let texts = ["does not match: policy is ", "give both the same FILE.tpg"];
    plant.end().assert_failure(4, &texts);
    controller.end().assert_failure(4, &texts);
}

#[test]
fn third_process_of_a_run_is_refused() {
    let folder = Folder::new();
    let file = folder.file("a.tpg", &policy::cartpole(0));
    let run = name();
    let (plant, controller) = endless(&file, &run, NEVER);
    let end = Process::start(CONTROLLER, &file, &["--run", &run]).end();
    end.assert_failure(4, &["has a controller already"]);
    let end = Process::start(PLANT, &file, &["--run", &run]).end();
    end.assert_failure(4, &["has a plant already"]);
    drop((plant, controller));
}

#[test]
fn program_that_is_not_there_is_told() {
    let folder = Folder::new();
    let file = folder.file("a.tpg", &policy::cartpole(0));
    let alone = folder.file("tpg-hil", b"");
    std::fs::copy(HIL, &alone).expect("copied with its permissions");
    let end = Process::start(alone.to_str().expect("UTF-8"), &file, &[]).end();
    end.assert_failure(4, &["no program ", "tpg-plant: it must lie beside tpg-hil"]);
}

#[test]
fn unusable_files_are_told_before_anything_starts() {
    let folder = Folder::new();
    let file = folder.file("a.tpg", b"no policy");
    let end = Process::start(HIL, &file, &[]).end();
    end.assert_failure(3, &["cannot use"]);
    let end = Process::start(CONTROLLER, &file, &["--run", "x"]).end();
    end.assert_failure(3, &["cannot use"]);
    let file = folder.file("b.tpg", &policy::cartpole(0));
    let end = Process::start(HIL, &file, &["--task", "hoper"]).end();
    end.assert_failure(2, &["no task is called"]);
}
