//! A column of a user's CSV file is a series to be continued, by every command that takes a task.

use std::fs;
use std::path::Path;

use tpg_runtime::Policy;
use tpg_tests::process::{stderr, text, tpg, tpg_json};

const TIDE: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../docs/examples/series/tide.csv"
);

/// Trains for two small generations. The status, and what was said.
fn train(task: &str, out: &Path) -> (Option<i32>, String) {
    let output = tpg([
        "train",
        "memory",
        "--task",
        task,
        "--generations",
        "2",
        "--set",
        "evolution.population=10",
        "--set",
        "evolution.children=10",
        "--set",
        "evaluation.elites=0",
        "--set",
        "evaluation.episodes=1",
        "--out",
        text(out),
    ]);
    (output.status.code(), stderr(&output))
}

#[test]
fn a_column_trains_evaluates_and_runs_in_the_loop() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("run");
    let task = format!("series:{TIDE}:LEVEL:25");
    let (status, message) = train(&task, &out);
    assert_eq!(status, Some(0), "{message}");
    assert!(message.contains("--task"), "how to score it: {message}");
    let champion = out.join("champion.tpg");
    let blob = fs::read(&champion).expect("a champion");
    let name = Policy::load(&blob).expect("a policy").tables().task;
    assert!(name.starts_with("series:tide.csv:LEVEL:25-"));
    let run = |verb: &str, task: &str| {
        tpg_json(&[
            verb,
            text(&champion),
            "--task",
            task,
            "--episodes",
            "3",
            "--json",
        ])
    };
    let later = format!("series-validation:{TIDE}:LEVEL:25");
    for (task, family) in [(&task, "series"), (&later, "series-validation")] {
        let (eval, hil) = (run("eval", task), run("hil", task));
        let name = eval["task"].as_str().expect("a name");
        assert_eq!(name.split(':').next(), Some(family));
        assert_eq!(eval["returns"], hil["returns"]);
        assert_eq!(eval["lengths"], serde_json::json!([74, 74, 74]));
    }
    let bare = tpg(["eval", text(&champion), "--episodes", "3"]);
    assert_eq!(bare.status.code(), Some(2));
    assert!(
        stderr(&bare).contains("--task series:"),
        "{}",
        stderr(&bare)
    );
}

/// A run goes on with the numbers that it began with, and with no others.
#[test]
fn the_contents_of_the_file_count() {
    let folder = tempfile::tempdir().expect("a folder");
    let numbers = fs::read_to_string(TIDE).expect("a file");
    let copy = folder.path().join("tide.csv");
    fs::write(&copy, &numbers).expect("written");
    let there = format!("series:{}:LEVEL:25", text(&copy));
    let here = format!("series:{TIDE}:LEVEL:25");
    let champion = |task: &str, name: &str| {
        let out = folder.path().join(name);
        let (status, message) = train(task, &out);
        assert_eq!(status, Some(0), "{message}");
        fs::read(out.join("champion.tpg")).expect("a champion")
    };
    let first = champion(&here, "here");
    assert_eq!(first, champion(&there, "there"), "wherever the file lies");
    let out = folder.path().join("there");
    let resume = || tpg(["train", "--resume", text(&out), "--generations", "3"]);
    assert_eq!(resume().status.code(), Some(0));
    fs::write(&copy, numbers.replace("109,0.454", "109,0.554")).expect("written");
    let refused = resume();
    assert_ne!(refused.status.code(), Some(0));
    assert!(
        stderr(&refused).contains("tide.csv"),
        "{}",
        stderr(&refused)
    );
    assert_ne!(first, champion(&there, "changed"));
}

#[test]
fn mistakes_have_the_status_of_bad_input() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("run");
    for (task, says) in [
        ("series:no-such-file.csv:x", "cannot be read"),
        (&format!("series:{TIDE}:MOON"), "\"HOUR\", \"LEVEL\""),
        (&format!("series:{TIDE}:LEVEL:400"), "needs 602"),
        (&format!("series:{TIDE}"), "series:FILE.csv:COLUMN:HORIZON"),
    ] {
        let (status, message) = train(task, &out);
        assert_eq!(status, Some(2), "{message}");
        assert!(message.contains(says), "{message}");
        assert!(!message.contains("panicked"), "{message}");
    }
}
