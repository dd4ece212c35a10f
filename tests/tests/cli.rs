//! The commands as scripts see them: exit statuses, messages, JSON, interruption.

use std::time::Duration;

use serde_json::Value;
use tpg_tests::fixtures::three_teams;
use tpg_tests::process::{finish, start, stderr, text, tpg, tpg_json};

/// Runs a command that must fail with this status and say all of this.
fn assert_fails(arguments: &[&str], status: i32, words: &[&str]) {
    let output = tpg(arguments);
    let message = stderr(&output);
    assert_eq!(
        output.status.code(),
        Some(status),
        "{arguments:?}: {message}"
    );
    for word in words {
        assert!(
            message.contains(word),
            "{arguments:?}: no {word:?} in: {message}"
        );
    }
    assert!(
        output.stdout.is_empty(),
        "results on standard output in spite of an error"
    );
    assert!(!message.contains("panicked"), "{message}");
}

#[test]
fn usage_errors_end_with_2_and_say_what_to_do() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("run");
    let out = text(&out);
    assert_fails(&["train"], 2, &["PRESET"]);
    assert_fails(
        &["train", "cartpol-sr", "--out", out],
        2,
        &["did you mean \"cartpole-sr\""],
    );
    assert_fails(&["train", "sr-sm", "--out", out], 2, &["--task"]);
    let set = |key: &'static str| ["train", "cartpole-sr", "--set", key, "--out", out];
    assert_fails(&set("evolution.populaton=5"), 2, &["evolution.population"]);
    assert_fails(
        &set("evolution.population=0"),
        2,
        &["evolution.population", "at least 1"],
    );
    assert_fails(
        &set("evolution.team.add=2"),
        2,
        &["evolution.team.add", "between 0 and 1"],
    );
    assert_fails(&set("task=hoper"), 2, &["hopper"]);
    assert_fails(
        &set("policy.memory=team"),
        2,
        &["policy.memory", "team-memory"],
    );
    assert_fails(&set("policy.width=40"), 2, &["policy.width", "32"]);
    assert_fails(&set("observability=[\"blackout:3/2\"]"), 2, &["3/2"]);
    for budget in ["--generations", "--steps", "--minutes"] {
        assert_fails(
            &["train", "cartpole-sr", "--out", out, budget, "0"],
            2,
            &[budget],
        );
    }
    assert!(
        !folder.path().join("run").exists(),
        "a failed command left something behind"
    );
}

#[test]
fn bad_files_end_with_3_and_name_the_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let missing = path("missing.tpg");
    assert_fails(&["eval", text(&missing)], 3, &["missing.tpg"]);
    let garbage = path("garbage.tpg");
    std::fs::write(&garbage, "not a policy").expect("written");
    for verb in ["eval", "inspect"] {
        assert_fails(&[verb, text(&garbage)], 3, &["garbage.tpg"]);
    }
    let damaged = path("damaged.tpg");
    let mut bytes = three_teams("cartpole", tpg_runtime::blob::RegisterMode::Stateful);
    bytes[200] ^= 1;
    std::fs::write(&damaged, bytes).expect("written");
    assert_fails(
        &["inspect", text(&damaged)],
        3,
        &["damaged.tpg", "checksum"],
    );
    assert_fails(
        &["train", "--resume", text(folder.path())],
        3,
        &["checkpoint"],
    );
    let run = path("run");
    std::fs::create_dir(&run).expect("made");
    std::fs::write(
        run.join("checkpoint"),
        b"TPGCHKPT\x01\0\0\0 and then nothing",
    )
    .expect("written");
    assert_fails(&["train", "--resume", text(&run)], 3, &["checkpoint"]);
}

#[test]
fn a_policy_that_does_not_fit_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("cartpole.tpg");
    let bytes = three_teams("cartpole", tpg_runtime::blob::RegisterMode::Stateful);
    std::fs::write(&file, bytes).expect("written");
    let removed = ["eval", text(&file), "--observability", "velocities-removed"];
    assert_fails(&removed, 2, &["4 inputs", "2"]);
    assert_fails(
        &["eval", text(&file), "--task", "cartpol"],
        2,
        &["cartpole"],
    );
    assert_fails(
        &["eval", text(&file), "--episodes", "0"],
        2,
        &["--episodes"],
    );
}

#[test]
fn reports_have_their_documented_keys() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("cartpole.tpg");
    let bytes = three_teams("cartpole", tpg_runtime::blob::RegisterMode::Stateful);
    std::fs::write(&file, &bytes).expect("written");
    let has = |value: &Value, keys: &[&str]| {
        for key in keys {
            assert!(!value[key].is_null(), "no {key} in {value}");
        }
    };
    let eval = tpg_json(&[
        "eval",
        text(&file),
        "--episodes",
        "3",
        "--baselines",
        "--json",
    ]);
    has(
        &eval,
        &[
            "task",
            "observability",
            "seed",
            "returns",
            "lengths",
            "mean",
            "sd",
        ],
    );
    has(&eval, &["instructions_mean", "zero_mean", "random_mean"]);
    assert_eq!(eval["returns"].as_array().map(Vec::len), Some(3));
    assert_eq!(eval["task"], "cartpole-v1");
    let inspect = tpg_json(&["inspect", text(&file), "--json"]);
    has(
        &inspect,
        &[
            "teams",
            "programs",
            "instructions",
            "effective_instructions",
        ],
    );
    has(
        &inspect,
        &[
            "inputs_used",
            "worst_case_instructions",
            "state_bytes",
            "blob_bytes",
        ],
    );
    assert_eq!(inspect["teams"], 3);
    assert_eq!(inspect["blob_bytes"], bytes.len());
    let presets = tpg_json(&["presets", "--json"]);
    for preset in presets["presets"].as_array().expect("a list") {
        has(preset, &["name", "task", "variant", "observability"]);
    }
}

#[test]
fn a_run_folder_is_never_overwritten() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("run");
    let arguments = [
        "train",
        "cartpole-sr",
        "--generations",
        "2",
        "--set",
        "evolution.population=10",
        "--out",
        text(&out),
    ];
    assert_eq!(tpg(arguments).status.code(), Some(0));
    for file in [
        "champion.tpg",
        "log.csv",
        "config.toml",
        "run.toml",
        "checkpoint",
    ] {
        assert!(out.join(file).is_file(), "no {file}");
    }
    let inspect = tpg_json(&["inspect", text(&out), "--json"]);
    let evolved = &inspect["as_evolved"];
    for key in ["state_bytes", "blob_bytes"] {
        assert!(evolved[key].as_u64() >= inspect[key].as_u64(), "{inspect}");
    }
    assert!(evolved["instructions"].as_u64() >= inspect["effective_instructions"].as_u64());
    let before = std::fs::read(out.join("log.csv")).expect("a log");
    assert_fails(&arguments, 2, &["--resume"]);
    assert_eq!(before, std::fs::read(out.join("log.csv")).expect("a log"));
}

#[cfg(unix)]
#[test]
fn an_interrupt_finishes_the_generation_and_checkpoints() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("run");
    let child = start([
        "train",
        "cartpole-sr-sm",
        "--generations",
        "1000000",
        "--set",
        "evolution.population=30",
        "--out",
        text(&out),
    ]);
    let log = out.join("log.csv");
    // The run is under way once it has logged a generation.
    while std::fs::read_to_string(&log).map_or(0, |t| t.lines().count()) < 3 {
        std::thread::sleep(Duration::from_millis(5));
    }
    let pid = child.id().to_string();
    let kill = std::process::Command::new("kill")
        .args(["-INT", &pid])
        .status();
    assert!(kill.expect("kill runs").success());
    let output = finish(child);
    assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
    assert!(stderr(&output).contains("--resume"), "{}", stderr(&output));
    let rows = std::fs::read_to_string(&log)
        .expect("a log")
        .lines()
        .count();
    let resumed = tpg([
        "train",
        "--resume",
        text(&out),
        "--generations",
        &(rows + 3).to_string(),
    ]);
    assert_eq!(resumed.status.code(), Some(0), "{}", stderr(&resumed));
    let after = std::fs::read_to_string(&log)
        .expect("a log")
        .lines()
        .count();
    assert_eq!(after, rows + 4, "every generation once");
}

/// The command that training shows in the end is complete, and a shell reads its words back.
#[cfg(all(unix, feature = "mujoco"))]
#[test]
fn the_command_that_training_shows_can_be_pasted() {
    use tpg_tests::process::{command_path, tpg_ok};

    let folder = tempfile::tempdir().expect("a folder");
    let robot = folder.path().join("my robot");
    std::fs::create_dir(&robot).expect("made");
    let crane = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/examples/crane");
    for file in ["crane.toml", "crane.xml"] {
        std::fs::copy(crane.join(file), robot.join(file)).expect("copied");
    }
    let (task, out) = (robot.join("crane.toml"), folder.path().join("it's out"));
    let output = tpg_ok(&[
        "train",
        "sr-sm",
        "--task",
        text(&task),
        "--generations",
        "1",
        "--set",
        "evolution.population=10",
        "--out",
        text(&out),
    ]);
    let message = stderr(&output);
    let (_, command) = message.split_once("lower: ").expect("a command");
    let programs = command_path("tpg");
    let programs = programs.parent().expect("a folder").to_owned();
    let pasted = std::process::Command::new("/bin/sh")
        .args(["-c", &format!("{} --episodes 1", command.trim_end())])
        .env("PATH", programs)
        .output()
        .expect("a shell");
    assert_eq!(
        pasted.status.code(),
        Some(0),
        "{command}: {}",
        stderr(&pasted)
    );
}
