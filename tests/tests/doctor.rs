//! `tpg doctor`: what works here is tried, and what does not has a way out.

use std::process::Command;

use serde_json::Value;
use tpg_tests::process::{command_path, tpg_json, tpg_ok};

fn of_part<'a>(report: &'a Value, part: &str) -> Vec<&'a Value> {
    let findings = report["findings"].as_array().expect("a list").iter();
    findings.filter(|finding| finding["part"] == part).collect()
}

#[test]
fn what_the_tests_stand_on_works() {
    let report = tpg_json(&["doctor", "--need", "loop", "--need", "build", "--json"]);
    assert_eq!(report["well"], true, "{report}");
    for part in ["tasks", "loop", "build"] {
        for finding in of_part(&report, part) {
            assert_eq!(finding["works"], true, "{finding}");
            assert!(finding["fix"].is_null(), "{finding}");
        }
    }
    let tasks = of_part(&report, "tasks");
    let found = tasks[0]["found"].as_str().expect("a text");
    let mujoco = if cfg!(feature = "mujoco") {
        "MuJoCo 3."
    } else {
        "without MuJoCo"
    };
    assert!(found.contains(mujoco), "{found}");
    for part in ["boards", "python", "browser"] {
        assert!(!of_part(&report, part).is_empty(), "{report}");
    }
    let drawing = of_part(&report, "drawing")[0];
    assert_eq!(drawing["works"], false, "{drawing}");
    let fix = drawing["fix"].as_str().expect("a text");
    assert!(fix.contains("--features render"), "{fix}");
    let said = String::from_utf8(tpg_ok(&["doctor"]).stdout).expect("text");
    assert!(said.contains("works    simulator and models"), "{said}");
}

/// On a machine with nothing else, training works all the same; who needs more is told so, and what to do.
#[test]
fn without_any_other_program_tasks_and_loop_still_work() {
    let doctor = |words: &[&str]| {
        let mut command = Command::new(command_path("tpg"));
        let command = command.args(["doctor", "--json"]).args(words);
        let output = command.env("PATH", "/nonexistent").output();
        let output = output.expect("tpg runs");
        let report: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        (output.status.code(), report)
    };
    let (status, report) = doctor(&[]);
    assert_eq!((status, &report["well"]), (Some(0), &Value::Bool(true)));
    assert_eq!(of_part(&report, "loop")[0]["works"], true, "{report}");
    for part in ["build", "boards", "python", "browser"] {
        for finding in of_part(&report, part) {
            assert_eq!(finding["works"], false, "{finding}");
            let fix = finding["fix"].as_str().expect("what to do");
            assert!(fix.len() > 10, "{finding}");
        }
        let (status, report) = doctor(&["--need", part]);
        assert_eq!(
            (status, &report["well"]),
            (Some(5), &Value::Bool(false)),
            "{part}"
        );
    }
}
