//! A task that a user describes trains, evaluates and runs in the loop like a built-in one.
#![cfg(feature = "mujoco")]

use std::fs;
use std::path::{Path, PathBuf};

use tpg_tests::process::{stderr, text, tpg, tpg_json};

const EXAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/examples/crane");

fn train(task: &Path, out: &Path) -> (Option<i32>, String) {
    let output = tpg([
        "train",
        "sr-sm",
        "--task",
        text(task),
        "--generations",
        "2",
        "--set",
        "evolution.population=10",
        "--set",
        "evolution.children=10",
        "--set",
        "evaluation.episodes=1",
        "--out",
        text(out),
    ]);
    (output.status.code(), stderr(&output))
}

/// A copy of the example, so that its files lie elsewhere and can be changed.
fn copy(folder: &Path) -> PathBuf {
    for name in ["crane.toml", "crane.xml"] {
        fs::copy(Path::new(EXAMPLE).join(name), folder.join(name)).expect("copied");
    }
    folder.join("crane.toml")
}

#[test]
fn the_example_trains_evaluates_and_runs_in_the_loop() {
    let folder = tempfile::tempdir().expect("a folder");
    let task = Path::new(EXAMPLE).join("crane.toml");
    let out = folder.path().join("run");
    let (status, message) = train(&task, &out);
    assert_eq!(status, Some(0), "{message}");
    let champion = out.join("champion.tpg");
    let arguments = ["--task", text(&task), "--episodes", "3", "--json"];
    let run = |verb: &str| {
        let mut all = vec![verb, text(&champion)];
        all.extend(arguments);
        tpg_json(&all)
    };
    let (eval, hil) = (run("eval"), run("hil"));
    assert_eq!(eval["task"], "crane-v1", "the name, not the path");
    assert_eq!(eval["returns"], hil["returns"]);
    assert_eq!(eval["lengths"], hil["lengths"]);
    let resumed = tpg(["train", "--resume", text(&out), "--generations", "3"]);
    assert_eq!(resumed.status.code(), Some(0), "{}", stderr(&resumed));
}

#[test]
fn the_same_files_elsewhere_give_the_same_champion() {
    let folder = tempfile::tempdir().expect("a folder");
    let champion = |task: &Path, name: &str| {
        let out = folder.path().join(name);
        let (status, message) = train(task, &out);
        assert_eq!(status, Some(0), "{message}");
        fs::read(out.join("champion.tpg")).expect("a champion")
    };
    let here = champion(&Path::new(EXAMPLE).join("crane.toml"), "here");
    assert_eq!(here, champion(&copy(folder.path()), "elsewhere"));
}

#[test]
fn a_policy_without_its_task_says_what_is_missing() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("run");
    let (status, message) = train(&Path::new(EXAMPLE).join("crane.toml"), &out);
    assert_eq!(status, Some(0), "{message}");
    for verb in ["eval", "hil"] {
        let output = tpg([verb, text(&out.join("champion.tpg"))]);
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{message}");
        for word in ["champion.tpg", "crane-v1", "--task path/to/task.toml"] {
            assert!(message.contains(word), "no {word:?} in: {message}");
        }
    }
}

/// Replaces one text of a file of the example by another; training must fail and say all of this.
fn assert_refused(file: &str, from: &str, to: &str, words: &[&str]) {
    let folder = tempfile::tempdir().expect("a folder");
    let task = copy(folder.path());
    let path = folder.path().join(file);
    let original = fs::read_to_string(&path).expect("read");
    assert!(original.contains(from), "{file} has no {from:?}");
    fs::write(&path, original.replacen(from, to, 1)).expect("written");
    let (status, message) = train(&task, &folder.path().join("run"));
    assert_eq!(status, Some(2), "{to:?}: {message}");
    for word in words {
        assert!(message.contains(word), "{to:?}: no {word:?} in: {message}");
    }
    assert!(!message.contains("panicked"), "{message}");
}

#[test]
fn mistakes_in_the_description_are_named() {
    let refused = |from, to, words: &[&str]| assert_refused("crane.toml", from, to, words);
    refused("frame-skip", "frameskip", &["frameskip", "\"frame-skip\""]);
    refused("clip = ", "clp = ", &["observation", "clp", "\"clip\""]);
    refused(
        "kind = \"square\"",
        "kind = \"cubic\"",
        &["cubic", "square"],
    );
    refused("qpos:trolley", "qpos:troley", &["troley", "\"trolley\""]);
    refused("qpos:trolley", "qpos:\\u0000", &["joint", "trolley, swing"]);
    refused(
        "qpos:trolley",
        "pos:trolley",
        &["pos:trolley", "qpos:JOINT"],
    );
    refused("site:load.x", "site:lod.x", &["site", "lod", "\"load\""]);
    refused("site:load.x", "site:load.w", &["NAME.x"]);
    refused("load_velocity[0]", "load_velocity[3]", &["3 values"]);
    refused("load_velocity[0]", "load_velocity", &["3 values"]);
    refused(
        "name = \"drive\"",
        "name = \"dive\"",
        &["actuator", "\"drive\""],
    );
    refused("high = 40.0", "high = 50.0", &["drive", "ctrlrange"]);
    refused("high = 40.0", "high = nan", &["actuator.high"]);
    refused("clip = 10.0", "clip = -1.0", &["observation.clip"]);
    refused("weight = 1.0", "weight = inf", &["reward.weight"]);
    refused("crane-v1", "crane", &["version"]);
    refused("crane-v1", "hopper-v4", &["built-in"]);
    refused(
        "frame-skip = 10",
        "frame-skip = 0",
        &["frame-skip", "at least 1"],
    );
    refused(
        "period-us = 20000",
        "period-us = 10000",
        &["period-us = 10000", "20000"],
    );
    refused("below = -1.95\nabove = 1.95", "", &["below, above"]);
    refused("target = 0.0", "target = 0.0 0", &["crane.toml"]);
    refused("crane.xml", "cran.xml", &["cran.xml", "cannot be read"]);
    refused("crane.xml", "a\\u0000b", &["cannot be read"]);
    refused("crane.xml", "crane.toml", &["crane.toml"]);
}

#[test]
fn mistakes_in_the_model_are_named() {
    let refused = |from, to, words: &[&str]| assert_refused("crane.xml", from, to, words);
    refused(
        "<joint name=\"swing\"",
        "<jont name=\"swing\"",
        &["crane.xml", "jont"],
    );
    refused(
        "type=\"hinge\" axis=\"0 1 0\"",
        "type=\"ball\"",
        &["swing", "hinge"],
    );
    refused("timestep=\"0.002\"", "timestep=\"0.00000001\"", &["period"]);
    refused(
        " ctrllimited=\"true\" ctrlrange=\"-40 40\"",
        " ctrlrange=\"-1 1\"",
        &["drive"],
    );
}

#[test]
fn a_missing_description_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let (status, message) = train(&folder.path().join("no.toml"), &folder.path().join("run"));
    assert_eq!(status, Some(2), "{message}");
    assert!(
        message.contains("no.toml") && message.contains("cannot be read"),
        "{message}"
    );
}
