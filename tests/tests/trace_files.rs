//! `tpg eval --trace`, `tpg replay` and `tpg inspect --disassemble` as a user runs them.

use std::path::{Path, PathBuf};

use serde_json::Value;
use tpg_runtime::blob::RegisterMode;
use tpg_tests::fixtures::three_teams;
use tpg_tests::process::{stderr, text, tpg, tpg_json};
use tpg_tests::samples;

/// A policy and the trace of three of its episodes, in a folder.
fn recorded(folder: &Path) -> (PathBuf, PathBuf) {
    let (policy, trace) = (folder.join("policy.tpg"), folder.join("run.trace"));
    std::fs::write(&policy, three_teams("cartpole", RegisterMode::Stateful)).expect("written");
    let scored = |more: &[&str]| {
        let mut arguments = vec!["eval", text(&policy), "--episodes", "3", "--json"];
        arguments.extend(more);
        tpg_json(&arguments)
    };
    assert_eq!(
        scored(&["--trace", text(&trace)]),
        scored(&[]),
        "recording changed the score"
    );
    (policy, trace)
}

fn lines(trace: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(trace).expect("a trace");
    text.lines().map(str::to_owned).collect()
}

/// Replays changed lines of a trace: the status and what was said.
fn replay(trace: &Path, lines: &[String], policy: &Path) -> (Option<i32>, String) {
    let changed = trace.with_extension("changed");
    std::fs::write(&changed, lines.join("\n")).expect("written");
    let output = tpg(["replay", text(&changed), text(policy)]);
    (output.status.code(), stderr(&output))
}

#[test]
fn a_trace_replays_and_a_changed_one_names_the_first_difference() {
    let folder = tempfile::tempdir().expect("a folder");
    let (policy, trace) = recorded(folder.path());
    let all = lines(&trace);
    let report = tpg_json(&["replay", text(&trace), text(&policy), "--json"]);
    // Header, three resets and the end are no decisions.
    assert_eq!(report["decisions"].as_u64(), Some(all.len() as u64 - 5));

    let parse = |line: &String| serde_json::from_str::<Value>(line).expect("JSON");
    let first = parse(&all[2]);
    let bid = first["decision"]["path"][0]["programs"][1]["bid"].as_str();
    let bid = bid.expect("a bid").to_owned();
    let mut changed = first.clone();
    changed["decision"]["path"][0]["programs"][1]["bid"] = "7f000000".into();
    changed["decision"]["action"][0] = "9".into();
    let mut lines = all.clone();
    lines[2] = changed.to_string();
    let (status, said) = replay(&trace, &lines, &policy);
    assert_eq!(status, Some(1), "{said}");
    for word in [
        "episode 0, step 0 (line 3)",
        "path[0].programs[1].bid",
        "7f000000",
        &bid,
    ] {
        assert!(said.contains(word), "no {word:?} in: {said}");
    }
}

#[test]
fn bad_traces_end_with_3_and_name_the_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let (policy, trace) = recorded(folder.path());
    let all = lines(&trace);
    let fails = |lines: &[String], status: i32, words: &[&str]| {
        let (got, said) = replay(&trace, lines, &policy);
        assert_eq!(got, Some(status), "{said}");
        for word in words {
            assert!(said.contains(word), "no {word:?} in: {said}");
        }
    };
    let with = |at: usize, line: &str| {
        let mut lines = all.clone();
        lines[at] = line.to_owned();
        lines
    };
    fails(&all[..4], 3, &["truncated after line 4"]);
    fails(
        &with(3, &all[3][..all[3].len() / 2]),
        3,
        &["line 4", "at column"],
    );
    fails(&with(0, &all[1]), 3, &["line 1", "header"]);
    fails(&with(3, &all[4]), 3, &["line 4", "episode and step"]);
    let fewer = r#"{"end":{"decisions":1}}"#;
    fails(&with(all.len() - 1, fewer), 3, &["counts other decisions"]);
    fails(&[], 3, &["truncated after line 0"]);
    let header: Value = serde_json::from_str(&all[0]).expect("JSON");
    let mut other = header.clone();
    other["header"]["policy"] = "00".into();
    fails(&with(0, &other.to_string()), 2, &["another policy"]);
    let mut newer = header;
    newer["header"]["version"] = 9.into();
    fails(&with(0, &newer.to_string()), 3, &["line 1", "version"]);
}

#[test]
fn a_disassembly_reads_like_the_semantics() {
    let folder = tempfile::tempdir().expect("a folder");
    let expected: [(&str, &[&str]); 4] = [
        (
            "reactive",
            &[
                "team 0 (root): programs 0, 1, 2",
                "v1 = v0 + v0",
                "m1 = m0ᵀ",
                "-> action v1",
            ],
        ),
        (
            "zero",
            &["s1 = sin(s1)", "-> action s1", "if s1 < obs[1]: s1 = -s1"],
        ),
        (
            "team-memory",
            &[
                "scalar_memory_write(s1)",
                "s1 = sm0",
                "s1 = vm3[0]",
                "s1 = mm0[1]",
                "-> team 1",
            ],
        ),
        (
            "classic",
            &["s1 = cell[49,0]", "memory_write(s0..s7)", "bid s0"],
        ),
    ];
    for ((name, draft), (expected_name, words)) in samples::all().into_iter().zip(expected) {
        assert_eq!(name, expected_name);
        let file = folder.path().join("sample.tpg");
        std::fs::write(&file, draft.encode()).expect("written");
        let [dot, svg] = ["dot", "svg"].map(|end| folder.path().join(end));
        let output = tpg([
            "inspect",
            text(&file),
            "--disassemble",
            "--dot",
            text(&dot),
            "--svg",
            text(&svg),
        ]);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        let said = String::from_utf8(output.stdout).expect("text");
        for word in words {
            assert!(said.contains(word), "{name}: no {word:?} in:\n{said}");
        }
        let graph = std::fs::read_to_string(&dot).expect("a graph");
        for word in ["t0 -> p1 [label=\"1\"];", "p1 -> t1;", "p0 -> a0;"] {
            assert!(graph.contains(word), "{name}: no {word:?} in:\n{graph}");
        }
        let drawing = std::fs::read_to_string(&svg).expect("a drawing");
        assert!(
            drawing.contains("<svg") && drawing.contains("team 0 (root)"),
            "{name}"
        );
    }
}
