//! Runs that are stopped and killed leave what undisturbed ones leave.

use std::process::Command;
use std::time::{Duration, Instant};

use crate::run::{
    PLAIN, SHARED_MEMORY, TUNED, assert_refused, begin, folder, left_by, resume, send,
    start_until_checkpoint, train,
};
use tpg_tests::process::{command_path, finish, start, stderr, text};

/// Between a signal and the end of the process; the promise is 2 s on a machine that is not overloaded.
const SOON: Duration = Duration::from_secs(10);

/// Sizes at which one generation takes long enough to be stopped in its middle.
fn slow<'a>(preset: &[&'a str]) -> Vec<&'a str> {
    let mut slow = preset.to_vec();
    slow.push("evaluation.episodes=30");
    slow
}

#[test]
fn a_run_that_is_stopped_within_a_generation_repeats_it() {
    for (preset, signal) in [(PLAIN, "-INT"), (SHARED_MEMORY, "-TERM"), (TUNED, "-TERM")] {
        let preset = slow(preset);
        let (_folder, out) = folder();
        let wanted = out.with_file_name("undisturbed");
        let generations = ["--generations", "4", "--threads", "2"];
        let started = Instant::now();
        train(&preset, &wanted, &generations);
        let whole = started.elapsed();
        let command = begin(&preset, &out, &generations);
        for part in [0.1, 0.4] {
            let child = if out.exists() {
                start(["train", "--resume", text(&out)])
            } else {
                start_until_checkpoint(&command, &out)
            };
            std::thread::sleep(whole.mul_f64(part));
            send(signal, &child);
            let sent = Instant::now();
            let output = finish(child);
            assert!(sent.elapsed() < SOON, "{:?}", sent.elapsed());
            let status = output.status.code();
            assert!(matches!(status, Some(0 | 130)), "{}", stderr(&output));
        }
        assert_refused(&resume(&out, &["--generations", "4"]), 0, &[]);
        assert_eq!(left_by(&out), left_by(&wanted), "{}", preset[0]);
    }
}

#[test]
fn a_limit_of_time_ends_a_generation_too() {
    let huge = ["cartpole-sr-sm", "evaluation.episodes=20000"];
    let (_folder, out) = folder();
    let started = Instant::now();
    train(&huge, &out, &["--minutes", "0.05"]);
    let took = started.elapsed();
    assert!(took >= Duration::from_secs(3) && took < Duration::from_secs(3) + SOON);
    assert!(out.join("checkpoint").exists());
    let other = out.with_file_name("other");
    let child = start_until_checkpoint(&begin(&huge, &other, &[]), &other);
    std::thread::sleep(Duration::from_millis(300));
    send("-TERM", &child);
    let sent = Instant::now();
    assert_refused(&finish(child), 130, &["--resume"]);
    assert!(sent.elapsed() < SOON);
}

/// `timeout` sends its signal to the process and to its group.
#[test]
fn two_signals_at_once_are_one() {
    let (_folder, out) = folder();
    let command = begin(PLAIN, &out, &["--generations", "1000000"]);
    let child = start_until_checkpoint(&command, &out);
    send("-TERM", &child);
    send("-INT", &child);
    assert_refused(&finish(child), 130, &["go on with"]);
}

#[test]
fn the_crash_harness_finds_nothing_lost() {
    let harness = concat!(env!("CARGO_MANIFEST_DIR"), "/../scripts/crash-harness");
    let python = Command::new("python3").arg("--version").output();
    if !python.is_ok_and(|python| python.status.success()) {
        eprintln!("skipped: python3 is missing");
        return;
    }
    let tpg = command_path("tpg");
    let output = Command::new("python3")
        .arg(harness)
        .arg(tpg)
        .arg("--short")
        .output();
    let output = output.expect("python3 runs");
    let table = String::from_utf8_lossy(&output.stdout);
    eprintln!("{table}");
    assert!(output.status.success(), "{table}\n{}", stderr(&output));
}
