//! Every variant and reset strategy trains, exports and runs in the loop.

use std::path::{Path, PathBuf};

use tpg_runtime::Policy;
use tpg_runtime::blob::{MemoryModel, ResetScope};
use tpg_tests::process::{text, tpg_json, tpg_ok};

/// Trains a small population for a few generations and returns the champion's file.
fn train(preset: &str, threads: &str, out: &Path) -> PathBuf {
    tpg_ok(&[
        "train",
        preset,
        "--seed",
        "2",
        "--threads",
        threads,
        "--generations",
        "4",
        "--set",
        "evolution.population=20",
        "--set",
        "evolution.children=20",
        "--set",
        "evaluation.episodes=3",
        "--out",
        text(out),
    ]);
    out.join("champion.tpg")
}

#[test]
fn every_preset_of_cartpole_trains_and_scores() {
    let folder = tempfile::tempdir().expect("a folder");
    let presets = tpg_json(&["presets", "--json"]);
    let names: Vec<&str> = presets["presets"]
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(|preset| preset["name"].as_str())
        .filter(|name| name.starts_with("cartpole-"))
        .collect();
    assert!(names.len() >= 11, "{names:?}");
    for name in names {
        let champion = train(name, "2", &folder.path().join(name));
        let report = tpg_json(&["eval", text(&champion), "--episodes", "3", "--json"]);
        assert!(
            report["mean"].as_f64().is_some_and(|m| m >= 5.0),
            "{name}: {report}"
        );
    }
}

/// Where memory outlives agents, a champion carries what it found, and the loop restores it.
#[test]
fn shared_memory_travels_with_the_champion() {
    let folder = tempfile::tempdir().expect("a folder");
    for (strategy, scope) in [
        ("original", ResetScope::Original),
        ("per-generation", ResetScope::PerGeneration),
        ("on-fall", ResetScope::Original),
        ("per-agent", ResetScope::PerAgent),
    ] {
        let preset = format!("cartpole-{strategy}");
        let [one, two] = ["1", "2"].map(|threads| {
            let out = folder.path().join(format!("{strategy}-{threads}"));
            train(&preset, threads, &out)
        });
        let bytes = std::fs::read(&one).expect("a champion");
        assert!(
            bytes == std::fs::read(two).expect("a champion"),
            "threads change {strategy}"
        );
        let policy = Policy::load(&bytes).expect("valid");
        assert_eq!(policy.header().reset_scope, scope);
        assert_eq!(policy.header().memory_model, MemoryModel::Indexed);
        let cells = policy.tables().cells.len();
        let carried = policy.tables().memory.len();
        if scope == ResetScope::PerAgent {
            assert_eq!(carried, 0, "an agent's own memory starts empty");
        } else {
            assert_eq!(cells, 800, "other agents may read any cell");
        }
        if strategy == "original" {
            assert_eq!(carried, 800, "the population's memory is carried on");
        }
        let arguments = ["--episodes", "10", "--json"];
        let run = |verb| tpg_json(&[&[verb, text(&one)], arguments.as_slice()].concat());
        assert_eq!(run("eval")["returns"], run("hil")["returns"], "{strategy}");
    }
}

/// An agent that chose when it is reset is reset so wherever it runs.
#[test]
fn an_evolved_rule_travels_with_the_champion() {
    let folder = tempfile::tempdir().expect("a folder");
    let champion = train("cartpole-evolved-resets", "2", folder.path());
    let arguments = ["--episodes", "10", "--json"];
    let run = |verb| tpg_json(&[&[verb, text(&champion)], arguments.as_slice()].concat());
    assert_eq!(run("eval")["returns"], run("hil")["returns"]);
}
