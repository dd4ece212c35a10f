//! What people see on a terminal: progress, and errors in one colour.

#![cfg(unix)]

use std::process::{Command, Stdio};

use tpg_tests::firmware::runs;
use tpg_tests::process::{command_path, finish, text, tpg};

/// What a command writes when it may use colours.
fn coloured(words: &[&str]) -> String {
    let mut command = Command::new(command_path("tpg"));
    command.args(words).env("CLICOLOR_FORCE", "1");
    let child = command.stdin(Stdio::null()).stderr(Stdio::piped()).spawn();
    let output = finish(child.expect("tpg starts"));
    String::from_utf8(output.stderr).expect("text")
}

#[test]
fn errors_look_alike_whoever_finds_them() {
    let ours = coloured(&["eval", "missing.tpg"]);
    let parsers = coloured(&["eval", "missing.tpg", "--episodes", "0"]);
    let (colour, _) = parsers.split_once("error:").expect("an error");
    assert!(colour.contains('\u{1b}'), "{parsers:?}");
    let (word, _) = parsers.split_once(' ').expect("words");
    // The order of codes and the way back are theirs; what is switched on is the same.
    let codes = |text: &str| {
        let (before, _) = text.split_once("error:").expect("an error");
        let mut codes: Vec<String> = before.split('\u{1b}').map(str::to_owned).collect();
        codes.sort();
        codes
    };
    assert_eq!(codes(&ours), codes(word), "{ours:?}, {parsers:?}");
    let plain = tpg(["eval", "missing.tpg"]);
    assert!(plain.stderr.starts_with(b"error: cannot read"), "{plain:?}");
}

/// A pseudo-terminal around the command.
#[test]
fn an_experiment_shows_its_runs_and_the_time_that_is_left() {
    if !runs("script", &["--version"]) {
        eprintln!("skipped: script is missing: apt-get install bsdutils");
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("small.toml");
    std::fs::write(
        &file,
        "name = \"small\"\nchapter = 2\ntasks = [\"cartpole\"]\nvariants = [\"original\", \"no-memory\"]\nrepeats = 2\n\
         test-episodes = 2\nbudget = { generations = 5 }\n[set]\nevolution.population = 30\nevolution.children = 30\n",
    )
    .expect("written");
    let tpg = command_path("tpg");
    let command = format!("'{}' experiment run '{}' --jobs 2", text(&tpg), text(&file));
    let mut script = Command::new("script");
    script
        .args(["-qec", &command, "/dev/null"])
        .env("TERM", "xterm");
    let child = script.stdin(Stdio::null()).stdout(Stdio::piped()).spawn();
    let output = finish(child.expect("script starts"));
    let said = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{said}");
    for words in [
        "4 of 4 runs are to be done",
        "/4 left ",
        "cartpole.no-memory.",
        " %",
    ] {
        assert!(said.contains(words), "no {words:?} in {said}");
    }
    assert!(said.contains("[  4/4]"), "{said}");
}
