//! What the command fills in by itself: folders, files, names.

use std::process::Command;

use serde_json::Value;
use tpg_tests::process::{command_path, stderr, text, tpg, tpg_json, tpg_ok};

#[test]
fn presets_are_grouped_described_and_filtered() {
    let all = tpg_json(&["presets", "--json"]);
    let all = all["presets"].as_array().expect("a list").clone();
    for preset in &all {
        let about = preset["about"].as_str().expect("a text");
        assert!(about.len() > 10 && !about.ends_with('.'), "{preset}");
    }
    let some = tpg_json(&["presets", "hopper-champion", "--json"]);
    let names: Vec<&Value> = some["presets"]
        .as_array()
        .expect("a list")
        .iter()
        .map(|p| &p["name"])
        .collect();
    assert_eq!(names, ["hopper-champion", "hopper-champion-b23"]);
    let output = tpg_ok(&["presets", "hopper"]);
    let shown = String::from_utf8(output.stdout).expect("text");
    let mut lines = shown.lines();
    assert_eq!(lines.next(), Some("hopper"));
    assert!(
        lines
            .next()
            .is_some_and(|line| line.starts_with("  hopper-champion ")),
        "{shown}"
    );
    let hoppers = all.iter().filter(|p| {
        p["name"]
            .as_str()
            .is_some_and(|name| name.contains("hopper"))
    });
    assert_eq!(
        shown.lines().filter(|line| line.starts_with("  ")).count(),
        hoppers.count()
    );
    let none = tpg(["presets", "hoper"]);
    assert_eq!(none.status.code(), Some(2));
    assert!(
        stderr(&none).contains("the nearest is \"hopper-"),
        "{}",
        stderr(&none)
    );
}

#[test]
fn the_name_of_a_task_leads_to_what_works_best_on_it() {
    for (task, preset) in [
        ("hopper", "hopper-champion"),
        ("cartpole", "cartpole-champion"),
    ] {
        let output = tpg(["train", task]);
        assert_eq!(output.status.code(), Some(2));
        let message = stderr(&output);
        assert!(
            message.contains(&format!("did you mean {preset:?}")),
            "{message}"
        );
    }
}

#[test]
fn a_run_without_a_folder_gets_one_and_its_folder_stands_for_its_champion() {
    let folder = tempfile::tempdir().expect("a folder");
    for n in 1..=2 {
        let small = [
            "--seed",
            "7",
            "--generations",
            "1",
            "--set",
            "evolution.population=10",
        ];
        let output = Command::new(command_path("tpg"))
            .args(["train", "cartpole-sr"])
            .args(small)
            .current_dir(folder.path())
            .output()
            .expect("tpg runs");
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        let run = folder.path().join(format!("runs/cartpole-sr-7-{n}"));
        assert!(run.join("champion.tpg").is_file(), "{}", stderr(&output));
        assert!(stderr(&output).contains(&format!("cartpole-sr-7-{n}")));
    }
    let run = folder.path().join("runs/cartpole-sr-7-1");
    let score = |path| tpg_json(&["eval", path, "--episodes", "3", "--json"]);
    let champion = run.join("champion.tpg");
    assert_eq!(score(text(&run)), score(text(&champion)));
    let empty = tpg(["eval", text(folder.path())]);
    assert_eq!(empty.status.code(), Some(3));
    assert!(
        stderr(&empty).contains("champion.tpg"),
        "{}",
        stderr(&empty)
    );
}
