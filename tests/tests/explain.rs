//! `tpg explain`: what it says of inputs, programs and memory is what a trace of the same episodes says.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde_json::Value;
use tpg_tests::process::{stderr, text, tpg, tpg_json, tpg_ok};

fn policy(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(file)
}

fn near(value: &Value, wanted: f64) {
    let value = value.as_f64().expect("a number");
    assert!(
        (value - wanted).abs() < 1e-6 * wanted.abs().max(1.0),
        "{value}, not {wanted}"
    );
}

/// The decisions of the episodes, from a trace.
fn decisions(file: &str, episodes: &str) -> Vec<Value> {
    let folder = tempfile::tempdir().expect("a folder");
    let trace = folder.path().join("trace");
    tpg_ok(&[
        "eval",
        file,
        "--episodes",
        episodes,
        "--trace",
        text(&trace),
    ]);
    let lines = std::fs::read_to_string(trace).expect("a trace");
    let lines = lines.lines().map(|line| {
        let line: Value = serde_json::from_str(line).expect("JSON");
        line["decision"].clone()
    });
    lines.filter(|decision| !decision.is_null()).collect()
}

fn float(text: &Value) -> f64 {
    let bits = u32::from_str_radix(text.as_str().expect("text"), 16).expect("hexadecimal");
    f64::from(f32::from_bits(bits))
}

#[test]
fn it_agrees_with_a_trace_of_the_same_episodes() {
    let file = policy("tests/golden/champions/cartpole-sr-sm-b23.tpg");
    let file = text(&file);
    let explained = tpg_json(&["explain", file, "--episodes", "5", "--json"]);
    let decisions = decisions(file, "5");
    let all = decisions.len() as f64;
    near(&explained["decisions"], all);

    let mut wins: BTreeMap<(u64, u64), f64> = BTreeMap::new();
    let mut reads: BTreeMap<(u64, String), f64> = BTreeMap::new();
    let mut writes = reads.clone();
    let mut inputs = vec![
        (0.0, 0.0);
        decisions[0]["observation"]
            .as_array()
            .expect("a list")
            .len()
    ];
    for decision in &decisions {
        let path = decision["path"].as_array().expect("a list");
        for visit in path {
            let team = visit["team"].as_u64().expect("a number");
            for bid in visit["programs"].as_array().expect("a list") {
                for (list, counts) in [("reads", &mut reads), ("writes", &mut writes)] {
                    for place in bid[list].as_array().expect("a list") {
                        let place = place.as_str().expect("a name").to_owned();
                        *counts.entry((team, place)).or_default() += 1.0;
                    }
                }
            }
        }
        let last = path.last().expect("a team");
        let number = |key: &str| last[key].as_u64().expect("a number");
        *wins.entry((number("team"), number("winner"))).or_default() += 1.0;
        let observation = decision["observation"].as_array().expect("a list");
        for ((sum, count), value) in inputs.iter_mut().zip(observation) {
            let value = float(value);
            if value.is_finite() {
                (*sum, *count) = (*sum + value, *count + 1.0);
            }
        }
    }

    let programs = explained["programs"].as_array().expect("a list");
    assert_eq!(programs.len(), wins.len(), "{explained}");
    for acts in programs {
        let number = |key: &str| acts[key].as_u64().expect("a number");
        near(
            &acts["share"],
            wins[&(number("team"), number("program"))] / all,
        );
    }
    let shares: Vec<f64> = programs
        .iter()
        .filter_map(|acts| acts["share"].as_f64())
        .collect();
    assert!(
        shares.windows(2).all(|pair| pair[0] >= pair[1]),
        "{shares:?}"
    );

    let memory = explained["memory"].as_array().expect("a list");
    let places: BTreeSet<_> = reads.keys().chain(writes.keys()).collect();
    assert_eq!(memory.len(), places.len(), "{explained}");
    for place in memory {
        let team = place["team"].as_u64().expect("a number");
        let key = (team, place["place"].as_str().expect("a name").to_owned());
        for (name, counts) in [("reads", &reads), ("writes", &writes)] {
            near(&place[name], counts.get(&key).copied().unwrap_or(0.0) / all);
        }
    }

    let seen = explained["inputs"].as_array().expect("a list");
    assert_eq!(seen.len(), inputs.len());
    for (seen, (sum, count)) in seen.iter().zip(inputs) {
        near(&seen["mean"], sum / count);
    }
}

/// An input that nothing reads costs nothing, one that balances the pole costs a lot; threads change nothing.
#[test]
fn the_inputs_that_matter_are_those_without_which_the_score_drops() {
    let file = policy("docs/champions/cartpole.tpg");
    let words = [
        "explain",
        text(&file),
        "--episodes",
        "10",
        "--json",
        "--threads",
    ];
    let explained = tpg_json(&[&words[..], &["1"]].concat());
    assert_eq!(explained, tpg_json(&[&words[..], &["2"]].concat()));
    let angle = &explained["inputs"][1];
    assert_eq!(angle["name"], "pole_angle");
    let [drop, low] = [&angle["drop"], &angle["drop_ci95"][0]].map(|x| x.as_f64().expect("it"));
    assert!(low > 100.0 && drop > low, "{angle}");
    let mean = |value: &Value, key: &str| value[key].as_f64().expect("a number");
    near(
        &angle["drop"],
        mean(&explained, "mean") - mean(angle, "frozen_mean"),
    );

    let said = tpg_ok(&["explain", text(&file), "--episodes", "3"]);
    let said = String::from_utf8(said.stdout).expect("text");
    for words in [
        "pole_angle",
        "matters",
        "team 0, program ",
        "none is read or written",
    ] {
        assert!(said.contains(words), "no {words:?} in {said}");
    }
}

#[test]
fn a_hundred_episodes_are_the_default_and_bad_files_are_named() {
    let help = String::from_utf8(tpg_ok(&["explain", "--help"]).stdout).expect("text");
    assert!(help.contains("[default: 100]"), "{help}");
    let output = tpg(["explain", "missing.tpg"]);
    assert_eq!(output.status.code(), Some(3));
    assert!(
        stderr(&output).contains("missing.tpg"),
        "{}",
        stderr(&output)
    );
}

/// Where outputs have programs of their own, each is explained for its output; an input that no program reads costs nothing.
#[cfg(feature = "mujoco")]
#[test]
fn programs_of_outputs_are_told_apart() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("run");
    let train = [
        "train",
        "hopper-linear",
        "--generations",
        "1",
        "--out",
        text(&out),
    ];
    let small = [
        "policy.action-programs=each",
        "evolution.population=6",
        "tuning.lines=1",
        "evolution.children=2",
    ];
    let sets = small.iter().flat_map(|set| ["--set", set]);
    let words: Vec<&str> = train.into_iter().chain(sets).collect();
    tpg_ok(&words);
    let explained = tpg_json(&["explain", text(&out), "--episodes", "2", "--json"]);
    let programs = explained["programs"].as_array().expect("a list");
    let mut shares: BTreeMap<u64, f64> = BTreeMap::new();
    for acts in programs {
        let output = acts["output"].as_u64().expect("an output");
        *shares.entry(output).or_default() += acts["share"].as_f64().expect("a share");
    }
    assert_eq!(shares.len(), 3, "{explained}");
    for share in shares.values() {
        near(&(*share).into(), 1.0);
    }
    let inspected = tpg_json(&["inspect", text(&out), "--json"]);
    let used = inspected["inputs_used"].as_array().expect("a list");
    for input in explained["inputs"].as_array().expect("a list") {
        if !used.contains(&input["name"]) {
            near(&input["drop"], 0.0);
        }
    }
}
