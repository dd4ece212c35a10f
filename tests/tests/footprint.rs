//! `tpg footprint` says what a policy takes on boards, and what is wrong where it cannot.

use serde_json::Value;
use tpg_tests::firmware::{M4F, RISCV, repository};
use tpg_tests::golden;
use tpg_tests::process::{stderr, text, tpg, tpg_json, tpg_ok};
use tpg_tools::footprint::boards;

#[test]
fn a_footprint_has_every_figure_and_they_add_up() {
    if !M4F.is_available() || !RISCV.is_available() {
        return;
    }
    let file = golden::path("champions/pendulum-per-episode.tpg");
    let folder = repository().join("firmware-examples");
    let footprint = |more: &[&str]| {
        let mut arguments = vec!["footprint", text(&file), "--firmware", text(&folder)];
        arguments.extend(more);
        tpg_json(&arguments)
    };
    let report = footprint(&["--target", "mps2-an386", "--target", "riscv-virt", "--json"]);
    let number = |value: &Value| {
        value
            .as_f64()
            .unwrap_or_else(|| panic!("{value} of {report}"))
    };
    let inspected = tpg_json(&["inspect", text(&file), "--json"]);
    for target in report["targets"].as_array().expect("a list") {
        for key in [
            "flash_code_bytes",
            "ram_static_bytes",
            "agent_bytes",
            "stack_bytes",
            "instructions_mean",
            "machine_instructions_mean",
        ] {
            assert!(number(&target[key]) > 0.0, "{key}: {report}");
        }
        assert_eq!(target["flash_blob_bytes"], inspected["blob_bytes"]);
        let (agent, state) = (&target["agent_bytes"], &inspected["state_bytes"]);
        assert!(number(agent) >= number(state));
        // What an agent may take beyond its state, and all that one of chapter 2 may, which reads 256 cells at most.
        assert!(
            number(agent) <= number(state) + 1024.0,
            "{agent} for {state}"
        );
        assert!(number(agent) <= 2048.0, "{agent}");
        assert!(number(&target["instructions_mean"]) <= number(&report["instructions_worst"]));
        // What the code can take is never less than what was seen.
        assert!(number(&target["stack_bytes_bound"]) >= number(&target["stack_bytes"]));
        let (worst, mean) = (
            &target["machine_instructions_worst_seen"],
            &target["machine_instructions_mean"],
        );
        assert!(number(worst) >= number(mean));
        // Every instruction of the policy takes some of the processor.
        assert!(number(mean) > 5.0 * number(&target["instructions_mean"]));
    }
    let instructions: f64 = (report["programs"].as_array().into_iter().flatten())
        .map(|program| number(&program["instructions"]))
        .sum();
    assert_eq!(
        instructions as u64,
        inspected["instructions"].as_u64().expect("a number")
    );
    // Fast code takes more flash and executes less, for the same decisions.
    let fast = footprint(&["--profile", "speed", "--json"]);
    assert_eq!([&report["profile"], &fast["profile"]], ["size", "speed"]);
    let (small, fast) = (&report["targets"][0], &fast["targets"][0]);
    assert_eq!(small["instructions_mean"], fast["instructions_mean"]);
    for (less, more, key) in [
        (fast, small, "machine_instructions_mean"),
        (small, fast, "flash_code_bytes"),
    ] {
        assert!(
            number(&less[key]) < number(&more[key]),
            "{key}: {less} {more}"
        );
    }
}

#[test]
fn of_a_board_that_nothing_emulates_the_code_tells_what_it_can() {
    if !M4F.is_available() {
        return;
    }
    let file = golden::path("champions/pendulum-per-episode.tpg");
    let folder = repository().join("firmware-examples");
    let common = ["footprint", text(&file), "--firmware", text(&folder)];
    let report = |more: &[&str]| {
        let output = tpg_ok(&[&common[..], more].concat());
        String::from_utf8(output.stdout).expect("text")
    };
    let emulated = report(&["--target", "mps2-an386", "--json"]);
    let emulated: Value = serde_json::from_str(&emulated).expect("JSON");
    let built = report(&["--target", "nucleo-f446re", "--json"]);
    let built: Value = serde_json::from_str(&built).expect("JSON");
    let (emulated, built) = (&emulated["targets"][0], &built["targets"][0]);
    let mut unknown = Vec::new();
    for (key, value) in built.as_object().expect("an object") {
        if value.is_null() {
            unknown.push(key.as_str());
        }
    }
    unknown.sort_unstable();
    assert_eq!(
        unknown,
        [
            "agent_bytes",
            "decisions",
            "instructions_in_worst_seen",
            "instructions_mean",
            "machine_instructions_mean",
            "machine_instructions_worst_seen",
            "stack_bytes",
        ]
    );
    // The same processor and the same policy: the agent is as large, and its decisions can take about as much.
    let number = |value: &Value, key: &str| value[key].as_u64().expect("a number");
    let agent = number(emulated, "agent_bytes");
    let ram = number(built, "ram_static_bytes");
    assert!((agent..agent + 1024).contains(&ram), "{agent} {built}");
    let [one, other] = [emulated, built].map(|board| number(board, "stack_bytes_bound"));
    assert!(other.abs_diff(one) < 128, "{one} {other}");
    assert!(number(built, "flash_code_bytes") > 0);
    let table = report(&["--target", "nucleo-f446re"]);
    assert!(table.contains("- of them the agent; - of stack"), "{table}");
}

#[test]
fn what_is_wrong_is_named() {
    let file = golden::path("champions/pendulum-per-episode.tpg");
    let run = |arguments: &[&str]| {
        let mut all = vec!["footprint", text(&file)];
        all.extend(arguments);
        let output = tpg(all);
        (output.status.code(), stderr(&output))
    };
    let (status, message) = run(&["--target", "arduino"]);
    assert_eq!(status, Some(2));
    for board in boards() {
        assert!(message.contains(&board.name), "{message}");
    }
    let empty = tempfile::tempdir().expect("a folder");
    let (status, message) = run(&["--firmware", text(empty.path())]);
    assert_eq!(status, Some(2));
    assert!(message.contains("holds no package mps2-an386"), "{message}");
}
