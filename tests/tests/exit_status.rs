//! Exit statuses: every command and document lists the same ones, and the same failure has one status everywhere.

use std::process::{Command, Output, Stdio};

use tpg_runtime::blob::RegisterMode;
use tpg_tasks::exit_status::Status;
use tpg_tests::fixtures::three_teams;
use tpg_tests::process::{command_path, stderr, text, tpg, tpg_ok};

/// The text in one line, so that wrapping makes no difference.
fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn help_texts_and_documents_list_the_statuses() {
    let sentence = Status::sentence();
    for document in ["README.md", "docs/training.md"] {
        let path = format!("{}/../{document}", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(path).expect("a document");
        assert!(
            one_line(&text).contains(&sentence),
            "{document}: {sentence}"
        );
    }
    for program in [
        "tpg",
        "tpg-hil",
        "tpg-plant",
        "tpg-controller",
        "tpg-update",
    ] {
        let output = Command::new(command_path(program)).arg("--help").output();
        let help = String::from_utf8(output.expect("help").stdout).expect("text");
        assert!(one_line(&help).contains(&sentence), "{program}: {help}");
    }
}

fn assert_unwritable(output: &Output, path: &str) {
    let message = stderr(output);
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains(path), "no {path} in: {message}");
}

#[test]
fn an_output_that_cannot_be_created_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let policy = folder.path().join("cartpole.tpg");
    std::fs::write(&policy, three_teams("cartpole", RegisterMode::Stateful)).expect("written");
    let policy = text(&policy);
    // A file where a folder should be: refused for every user, root too.
    let below = |name: &str| format!("{policy}/{name}");
    let (trace, dot, source, run) = (
        below("trace"),
        below("dot"),
        below("policy.rs"),
        below("run"),
    );
    for (arguments, path) in [
        (vec!["eval", policy, "--trace", &trace], &trace),
        (vec!["inspect", policy, "--dot", &dot], &dot),
        (vec!["export", policy, "--rust", &source], &source),
        (vec!["train", "cartpole-sr", "--out", &run], &run),
    ] {
        assert_unwritable(&tpg(arguments), path);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_output_that_cannot_be_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let policy = folder.path().join("cartpole.tpg");
    std::fs::write(&policy, three_teams("cartpole", RegisterMode::Stateful)).expect("written");
    let policy = text(&policy);
    assert_unwritable(&tpg(["eval", policy, "--trace", "/dev/full"]), "/dev/full");
    assert_unwritable(&tpg(["export", policy, "--rust", "/dev/full"]), "/dev/full");
    let full = std::fs::File::options().write(true).open("/dev/full");
    let output = Command::new(command_path("tpg"))
        .args(["inspect", policy])
        .stdout(full.expect("a full device"))
        .stderr(Stdio::piped())
        .output();
    assert_unwritable(&output.expect("tpg runs"), "standard output");
}

#[test]
fn a_misfit_is_told_in_words() {
    let folder = tempfile::tempdir().expect("a folder");
    let policy = folder.path().join("cartpole.tpg");
    std::fs::write(&policy, three_teams("cartpole", RegisterMode::Stateful)).expect("written");
    tpg_ok(&["inspect", text(&policy)]);
    let pendulum = ["--task", "pendulum", "--observability", "none"];
    let output = tpg(["eval", text(&policy)].iter().chain(&pendulum));
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("4 inputs"), "{}", stderr(&output));
}
