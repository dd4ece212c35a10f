//! Small runs and what they leave.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output};
use std::time::Duration;

use tpg_tests::process::{start, stderr, text, tpg, tpg_ok};

/// Agents that share nothing.
pub const PLAIN: &[&str] = &["cartpole-sr-sm-b23"];
/// Agents in turn, on one memory that outlives them.
pub const SHARED_MEMORY: &[&str] = &["cartpole-original"];
/// A tuned line, races, and a front end that is learned.
pub const TUNED: &[&str] = &[
    "cartpole-sr-sm-b13",
    "evaluation.elites=2",
    "evolution.initial=linear",
    "tuning.lines=1",
    "tuning.directions=4",
    "tuning.top=2",
    "selection.candidates=2",
    "selection.every=2",
    "selection.episodes=6",
    "selection.batch=2",
    "front-end.standardise=true",
    "front-end.belief=learned",
    "front-end.columns=auto",
    "front-end.others=drop",
    "front-end.pairs=900",
    "front-end.refit-every=2",
];

/// Arguments that begin a run of a preset with settings.
pub fn begin(preset: &[&str], out: &Path, more: &[&str]) -> Vec<String> {
    let small = [
        "evolution.population=12",
        "evolution.children=12",
        "evaluation.episodes=2",
    ];
    let mut arguments = vec!["train", preset[0], "--seed", "3", "--out", text(out)];
    for setting in small.iter().chain(&preset[1..]) {
        arguments.extend(["--set", setting]);
    }
    arguments.extend(more);
    arguments.into_iter().map(str::to_owned).collect()
}

/// Trains a preset to the end.
pub fn train(preset: &[&str], out: &Path, more: &[&str]) {
    tpg_ok(&begin(preset, out, more));
}

/// Goes on with a run.
pub fn resume(out: &Path, more: &[&str]) -> Output {
    tpg(["train", "--resume", text(out)].iter().chain(more))
}

/// A run folder in a temporary one.
pub fn folder() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("run");
    (folder, out)
}

/// Champion, champions, and the log without its last column, which is time.
#[derive(Debug, PartialEq)]
pub struct Left {
    champion: Vec<u8>,
    pub champions: BTreeMap<String, Vec<u8>>,
    pub log: Vec<String>,
}

/// What a run left.
pub fn left_by(out: &Path) -> Left {
    let champions = std::fs::read_dir(out.join("champions")).expect("champions");
    let log = std::fs::read_to_string(out.join("log.csv")).expect("a log");
    let without_time = |row: &str| row.rsplit_once(',').expect("columns").0.to_owned();
    Left {
        champion: std::fs::read(out.join("champion.tpg")).expect("a champion"),
        champions: champions
            .map(|entry| entry.expect("a file").path())
            .map(|path| {
                let name = path.file_name().expect("a name").to_string_lossy();
                (name.into_owned(), std::fs::read(&path).expect("a champion"))
            })
            .collect(),
        log: log.lines().map(without_time).collect(),
    }
}

/// Starts a run and waits for its first checkpoint.
pub fn start_until_checkpoint(arguments: &[String], out: &Path) -> Child {
    let mut child = start(arguments);
    while !out.join("checkpoint").exists() {
        assert!(child.try_wait().expect("a child").is_none(), "it ended");
        std::thread::sleep(Duration::from_millis(2));
    }
    child
}

/// Sends a signal, such as `-TERM`.
pub fn send(signal: &str, child: &Child) {
    let sent = Command::new("kill")
        .args([signal, &child.id().to_string()])
        .status();
    assert!(sent.expect("kill runs").success());
}

/// A command must have failed with this status and said all of this.
pub fn assert_refused(output: &Output, status: i32, words: &[&str]) {
    let message = stderr(output);
    assert_eq!(output.status.code(), Some(status), "{message}");
    for word in words {
        assert!(message.contains(word), "no {word:?} in: {message}");
    }
}
