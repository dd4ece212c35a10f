//! One seed fixes a run: for any number of threads, and across an interruption.

use std::path::Path;

use tpg_tests::process::{text, tpg_ok as train};

/// The log without its last column, which is wall-clock time.
fn log(folder: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(folder.join("log.csv")).expect("a log");
    let rows = text
        .lines()
        .map(|l| l.rsplit_once(',').expect("columns").0.to_owned());
    rows.collect()
}

fn champion(folder: &Path) -> Vec<u8> {
    std::fs::read(folder.join("champion.tpg")).expect("a champion")
}

fn assert_same_run(a: &Path, b: &Path, generations: usize) {
    assert_eq!(log(a).len(), generations + 1);
    assert_eq!(log(a), log(b));
    assert!(champion(a) == champion(b), "the champions differ");
}

/// Trains with one and with two threads, and in two parts, and compares all three.
fn one_seed_fixes_a_run(preset: &str, population: &str, generations: usize, settings: &[&str]) {
    let folder = tempfile::tempdir().expect("a folder");
    let [one, two, parts] = ["one", "two", "parts"].map(|name| folder.path().join(name));
    let (all, half) = (generations.to_string(), (generations / 2).to_string());
    let population = format!("evolution.population={population}");
    let run = |out: &Path, threads: &str, generations: &str| {
        let settings = settings.iter().flat_map(|s| ["--set", s]);
        let arguments = [
            "train",
            preset,
            "--seed",
            "7",
            "--threads",
            threads,
            "--generations",
            generations,
            "--set",
            &population,
            "--set",
            "evolution.children=20",
            "--set",
            "evolution.program.atomic=0.5",
            "--out",
            text(out),
        ];
        train(&arguments.into_iter().chain(settings).collect::<Vec<_>>());
    };
    run(&one, "1", &all);
    run(&two, "2", &all);
    assert_same_run(&one, &two, generations);
    run(&parts, "2", &half);
    assert_eq!(log(&parts).len(), generations / 2 + 1);
    train(&["train", "--resume", text(&parts), "--generations", &all]);
    assert_same_run(&one, &parts, generations);
}

#[test]
fn one_seed_fixes_a_run_of_100_generations() {
    one_seed_fixes_a_run("cartpole-sr-sm", "40", 100, &[]);
}

/// Lines that begin, grow, fall behind and begin anew, means, elites and races: all of it is in the checkpoint.
#[test]
fn one_seed_fixes_a_tuned_run() {
    let settings = [
        "evolution.initial=linear-history",
        "evolution.team.grow=0.2",
        "evaluation.episodes=3",
        "evaluation.elites=2",
        "evaluation.shaping.control=0.5",
        "tuning.lines=2",
        "tuning.iterations=2",
        "tuning.directions=4",
        "tuning.top=2",
        "tuning.mean-every=3",
        "tuning.patience=3",
        "tuning.margin=0.1",
        "tuning.grow-after=8",
        "tuning.grow-to=6",
        "tuning.remember-after=12",
        "tuning.one-after=30",
        "evolution.team.remember=0.1",
        "selection.candidates=3",
        "selection.every=2",
        "selection.episodes=6",
        "selection.batch=2",
    ];
    one_seed_fixes_a_run("cartpole-sr-sm", "12", 24, &settings);
}

/// Moments, pairs, the chosen columns and the front ends of past generations: all of it is in the checkpoint.
#[test]
fn one_seed_fixes_a_run_that_learns_to_perceive() {
    let settings = [
        "evaluation.episodes=3",
        "evaluation.elites=2",
        "evolution.initial=linear",
        "tuning.lines=1",
        "tuning.directions=4",
        "tuning.top=2",
        "tuning.half-life=4",
        "selection.candidates=2",
        "front-end.standardise=true",
        "front-end.belief=learned",
        "front-end.columns=auto",
        "front-end.others=drop",
        "front-end.degree=2",
        "front-end.weighting=2.0",
        "front-end.outlier=0.05",
        "front-end.pairs=900",
        "front-end.refit-every=2",
    ];
    one_seed_fixes_a_run("cartpole-sr-sm-b13", "12", 6, &settings);
    // Stages in which everybody is scored again.
    let settings = [
        "evaluation.curriculum.steps=30000",
        "evaluation.curriculum.stages=3",
        "evaluation.elites=2",
        "tuning.lines=1",
        "selection.candidates=2",
        "front-end.belief=learned",
    ];
    one_seed_fixes_a_run("cartpole-sr-sm-b13", "12", 8, &settings);
    // Agents in turn, on one memory.
    let settings = ["front-end.belief=learned", "front-end.refit-every=1"];
    one_seed_fixes_a_run("pendulum-original-b13", "8", 4, &settings);
}

#[cfg(feature = "mujoco")]
#[test]
fn one_seed_fixes_a_run_on_mujoco() {
    one_seed_fixes_a_run("hopper-sr-sm-b23", "30", 8, &[]);
}

#[test]
fn another_seed_is_another_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let [a, b] = ["1", "2"].map(|seed| {
        let out = folder.path().join(seed);
        train(&[
            "train",
            "cartpole-sr",
            "--seed",
            seed,
            "--generations",
            "3",
            "--set",
            "evolution.population=20",
            "--out",
            text(&out),
        ]);
        out
    });
    assert_ne!(log(&a), log(&b));
}

/// A crash between checkpoints leaves rows that the checkpoint does not know: they are made again, once.
#[test]
fn rows_behind_the_checkpoint_are_dropped_on_resume() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("run");
    train(&[
        "train",
        "cartpole-sr",
        "--generations",
        "4",
        "--set",
        "evolution.population=20",
        "--out",
        text(&out),
    ]);
    let path = out.join("log.csv");
    let mut rows = std::fs::read_to_string(&path).expect("a log");
    let whole = rows.clone();
    rows.push_str(&whole.lines().last().expect("rows").replacen('4', "5", 1));
    rows.push_str("\n6,half a ro");
    std::fs::write(&path, rows).expect("written");
    train(&["train", "--resume", text(&out), "--generations", "6"]);
    let generations: Vec<String> = log(&out)
        .iter()
        .skip(1)
        .map(|row| row.split(',').next().expect("columns").to_owned())
        .collect();
    assert_eq!(generations, ["1", "2", "3", "4", "5", "6"]);
}
