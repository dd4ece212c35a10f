//! A terminal, log or reader that goes away ends no command with a panic, and no run without its results.

use std::path::Path;
use std::process::{Command, ExitStatus, Stdio};

use tpg_runtime::blob::RegisterMode;
use tpg_tests::fixtures::three_teams;
use tpg_tests::process::{command_path, finish, text, tpg_ok};

/// A stream that nobody reads any more.
fn closed() -> Stdio {
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    writer.into()
}

/// Runs `tpg` with both of its outputs closed.
fn unheard(arguments: &[&str]) -> ExitStatus {
    let mut command = Command::new(command_path("tpg"));
    command.args(arguments).stdin(Stdio::null());
    let child = command.stdout(closed()).stderr(closed()).spawn();
    finish(child.expect("tpg starts")).status
}

fn training<'a>(out: &'a Path, generations: &'a str) -> Vec<&'a str> {
    let small = [
        "--set",
        "evolution.population=20",
        "--set",
        "evolution.children=20",
    ];
    let mut arguments = vec!["train", "cartpole-sr-sm", "--seed", "1", "--generations"];
    arguments.extend([generations, "--out", text(out)]);
    arguments.extend(small);
    arguments
}

#[test]
fn training_goes_on_without_its_terminal() {
    let folder = tempfile::tempdir().expect("a folder");
    let (heard, alone) = (folder.path().join("heard"), folder.path().join("alone"));
    tpg_ok(&training(&heard, "5"));
    assert_eq!(unheard(&training(&alone, "5")).code(), Some(0));
    for file in ["champion.tpg", "checkpoint", "config.toml"] {
        assert!(alone.join(file).is_file(), "no {file}");
    }
    let champion = |folder: &Path| std::fs::read(folder.join("champion.tpg")).expect("a champion");
    assert_eq!(champion(&heard), champion(&alone));
    let resumed = unheard(&["train", "--resume", text(&alone), "--generations", "6"]);
    assert_eq!(resumed.code(), Some(0));
}

#[test]
fn every_command_ends_with_its_status_when_nobody_listens() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("cartpole.tpg");
    std::fs::write(&file, three_teams("cartpole", RegisterMode::Stateful)).expect("written");
    let file = text(&file);
    let trace = folder.path().join("trace");
    let source = folder.path().join("policy.rs");
    let (trace, source) = (text(&trace), text(&source));
    for (arguments, status) in [
        (vec!["presets"], 0),
        (vec!["eval", file, "--episodes", "2", "--trace", trace], 0),
        (vec!["replay", trace, file], 0),
        (vec!["inspect", file, "--disassemble"], 0),
        (vec!["export", file, "--rust", source, "--json"], 0),
        (vec!["hil", file, "--episodes", "2"], 0),
        (vec!["eval", "missing.tpg"], 3),
        (vec!["hil", "missing.tpg"], 3),
        (
            vec!["update", "missing.tpg", "--controller", "serial:/dev/null"],
            3,
        ),
        (vec!["footprint", "missing.tpg"], 3),
        (vec!["experiment", "report", "missing"], 3),
        (vec!["experiment", "run", "missing.toml"], 3),
        (vec!["train", "no-such-preset", "--out", trace], 2),
    ] {
        assert_eq!(unheard(&arguments).code(), Some(status), "{arguments:?}");
    }
}
