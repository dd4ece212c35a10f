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
    refused(
        "below = -1.95\nabove = 1.95",
        "below = 1.95\nabove = -1.95",
        &["qpos:trolley", "below = 1.95", "above = -1.95", "at once"],
    );
    refused(
        "name = \"swing_sine\"",
        "name = \"trolley_position\"",
        &["observation.name", "\"trolley_position\"", "its own"],
    );
    refused(
        "clip = 10.0",
        "clip = 0.0",
        &["observation.clip", "load_velocity", "above 0"],
    );
    refused("clip = 10.0", "clip = nan", &["observation.clip", "finite"]);
    refused("target = 0.0", "target = nan", &["reward.target", "finite"]);
    refused(
        "below = -1.95",
        "below = nan",
        &["termination.below", "finite"],
    );
    refused(
        "position-noise = 0.6",
        "position-noise = inf",
        &["reset.position-noise", "finite"],
    );
    refused("target = 0.0", "target = 0.0 0", &["crane.toml"]);
    refused("crane.xml", "cran.xml", &["cran.xml", "cannot be read"]);
    refused("crane.xml", "a\\u0000b", &["cannot be read"]);
    refused("crane.xml", "crane.toml", &["crane.toml"]);
}

/// Drops every part of the example's description that begins with this header.
fn without(header: &str) -> String {
    let text = fs::read_to_string(Path::new(EXAMPLE).join("crane.toml")).expect("read");
    let mut kept = true;
    let lines = text.lines().filter(|line| {
        if line.starts_with('[') {
            kept = *line != header;
        }
        kept
    });
    lines.collect::<Vec<_>>().join("\n")
}

#[test]
fn a_description_without_a_needed_part_is_refused() {
    for (header, word) in [
        ("[[reward]]", "no [[reward]]"),
        ("[[observation]]", "[[observation]]"),
        ("[[actuator]]", "[[actuator]]"),
    ] {
        let folder = tempfile::tempdir().expect("a folder");
        let task = copy(folder.path());
        fs::write(&task, without(header)).expect("written");
        let (status, message) = train(&task, &folder.path().join("run"));
        assert_eq!(status, Some(2), "{header}: {message}");
        assert!(message.contains(word), "{header}: {message}");
        assert!(message.contains("crane.toml"), "{header}: {message}");
    }
}

/// MuJoCo compiles such a model, and every step of it fails.
#[test]
fn a_model_with_numbers_that_are_none_is_refused() {
    let refused =
        |from: &str, to: &str, words: &[&str]| assert_refused("crane.xml", from, to, words);
    let step = "timestep=\"0.002\"";
    refused(step, "timestep=\"0\"", &["crane.xml", "timestep"]);
    refused(step, "timestep=\"-0.002\"", &["crane.xml", "timestep"]);
    refused(step, "timestep=\"nan\"", &["crane.xml", "timestep"]);
    for gravity in ["nan 0 0", "0 0 -inf"] {
        let to = format!("{step} gravity=\"{gravity}\"");
        refused(step, &to, &["crane.xml", "gravity", "finite"]);
    }
    refused(
        "size=\"0.12\" mass=\"2\"",
        "size=\"0.12\" mass=\"nan\"",
        &["crane.xml", "mass", "finite"],
    );
    refused(
        "damping=\"0.01\"",
        "damping=\"nan\"",
        &["crane.xml", "damping", "finite"],
    );
}

/// A pile of boxes that the model's memory cannot hold: MuJoCo ends the process from within a step.
#[test]
fn a_fatal_error_of_mujoco_ends_with_its_own_status() {
    let folder = tempfile::tempdir().expect("a folder");
    let boxes: String = (0..40)
        .map(|i| {
            format!(
                "<body pos=\"{} {} 0.3\"><freejoint/><geom type=\"box\" size=\".1 .1 .1\"/></body>",
                0.05 * f64::from(i % 5),
                0.05 * f64::from(i / 5)
            )
        })
        .collect();
    let model = format!(
        "<mujoco><size memory=\"200K\"/><worldbody><geom type=\"plane\" size=\"5 5 .1\"/><body pos=\"0 0 1\">\
         <joint name=\"j\" type=\"hinge\" axis=\"0 1 0\"/><geom size=\".1\" mass=\"1\"/></body>{boxes}</worldbody>\
         <actuator><motor name=\"j\" joint=\"j\" ctrlrange=\"-1 1\"/></actuator></mujoco>"
    );
    let description = "name = \"t-v1\"\nmodel = \"pile.xml\"\nframe-skip = 5\nmax-steps = 50\n\
        observation = [{ source = \"qpos:j\", name = \"j\", unit = \"rad\" }]\nactuator = [{ name = \"j\" }]\n\
        reward = [{ kind = \"square\", source = \"qpos:j\", weight = -1.0 }]\n";
    fs::write(folder.path().join("pile.xml"), model).expect("written");
    let task = folder.path().join("t.toml");
    fs::write(&task, description).expect("written");
    let (status, message) = train(&task, &folder.path().join("run"));
    assert_eq!(status, Some(4), "{message}");
    for word in ["pile.xml", "out of memory", "<size memory="] {
        assert!(message.contains(word), "no {word:?} in: {message}");
    }
    assert!(!message.contains("panicked"), "{message}");
}

#[test]
fn mistakes_in_the_model_are_named() {
    let refused =
        |from: &str, to: &str, words: &[&str]| assert_refused("crane.xml", from, to, words);
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

/// Positions of 10³⁰ m: MuJoCo gives up in the first step of every episode.
#[test]
fn a_run_of_which_every_episode_is_unstable_says_why_and_fails() {
    let folder = tempfile::tempdir().expect("a folder");
    let task = copy(folder.path());
    let original = fs::read_to_string(&task).expect("read");
    let wild = original.replace("position-noise = 0.6", "position-noise = 1e30");
    assert_ne!(wild, original);
    fs::write(&task, wild).expect("written");
    let out = folder.path().join("run");
    let (status, message) = train(&task, &out);
    assert_eq!(status, Some(4), "{message}");
    for word in ["warning", "became unstable", "BADQ", "step 1", "time step"] {
        assert!(message.contains(word), "{word}: {message}");
    }
    let champion = out.join("champion.tpg");
    let output = tpg([
        "eval",
        text(&champion),
        "--task",
        text(&task),
        "--episodes",
        "3",
    ]);
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(4), "{message}");
    assert!(
        message.contains("all episodes became unstable") && message.contains("BADQ"),
        "{message}"
    );
}
