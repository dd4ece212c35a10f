//! The loop over shared memory returns what scoring in one process returns, in every bit.

use std::path::Path;

use serde_json::Value;
use tpg_runtime::blob::RegisterMode;
use tpg_runtime::{HostAgent, Policy, Reset};
use tpg_tests::fixtures::three_teams;
use tpg_tests::process::{text, tpg_json};

const SHARED_KEYS: [&str; 9] = [
    "task",
    "observability",
    "disturbances",
    "seed",
    "returns",
    "lengths",
    "mean",
    "sd",
    "instructions_mean",
];

/// Runs both verbs on the same episodes and compares what they report.
fn assert_loop_equals_eval(file: &Path, episodes: &str, disturbances: &[&str]) -> Value {
    let mut arguments = vec!["--episodes", episodes, "--seed", "5", "--json"];
    for disturbance in disturbances {
        arguments.extend(["--disturb", disturbance]);
    }
    let run = |verb: &str| {
        let mut all = vec![verb, text(file)];
        all.extend(&arguments);
        tpg_json(&all)
    };
    let (eval, hil) = (run("eval"), run("hil"));
    for key in SHARED_KEYS {
        assert_eq!(eval[key], hil[key], "{key} of {}", file.display());
    }
    assert_eq!(
        eval["returns"].as_array().map(Vec::len),
        episodes.parse().ok()
    );
    assert!(hil["latency"].is_object(), "{hil}");
    eval
}

/// Both register modes on a task: three teams deep, memory written and read.
fn fixtures_agree(task: &str) {
    let folder = tempfile::tempdir().expect("a folder");
    let mut means = Vec::new();
    for mode in [RegisterMode::Stateful, RegisterMode::Stateless] {
        let bytes = three_teams(task, mode);
        assert_deep_and_remembering(&bytes);
        let file = folder.path().join(format!("{}.tpg", mode.name()));
        std::fs::write(&file, &bytes).expect("written");
        let undisturbed = assert_loop_equals_eval(&file, "20", &[])["mean"].clone();
        let disturbances = ["loss:1/10", "delay:1", "noise:0.01", "action:delay:1"];
        let disturbed = &assert_loop_equals_eval(&file, "20", &disturbances)["mean"];
        assert_ne!(
            disturbed, &undisturbed,
            "the disturbances make no difference"
        );
        means.push(undisturbed);
    }
    assert_ne!(means[0], means[1], "the register mode makes no difference");
}

/// The fixture visits three teams, and what it decides depends on what it wrote before.
fn assert_deep_and_remembering(bytes: &[u8]) {
    let policy = Policy::load(bytes).expect("valid");
    let mut agent = Box::new(HostAgent::new(policy).expect("fits"));
    agent.reset(Reset::Agent, 1);
    let before = agent.memory().to_vec();
    let observation = vec![0.5; usize::from(policy.header().observation_len)];
    let mut deepest = 0;
    for _ in 0..20 {
        deepest = deepest.max(agent.decide(&observation).expect("the right length").teams);
    }
    assert_eq!(deepest, 3);
    assert_ne!(before, agent.memory(), "memory was never written");
}

/// Policies that learned to perceive decide in the loop, replayed from a trace and compiled as they were scored.
#[test]
fn what_was_learned_is_perceived_in_the_loop() {
    let folder = tempfile::tempdir().expect("a folder");
    let hopper = cfg!(feature = "mujoco").then_some(("hopper-sr-sm-b23", "learned"));
    for (preset, belief) in [
        ("cartpole-sr-sm-b13", "learned"),
        ("pendulum-sl-b13", "learned"),
        ("acrobot-per-episode-b13", "hold"),
        ("pendulum-sl-nc-b13", "none"),
    ]
    .into_iter()
    .chain(hopper)
    {
        let out = folder.path().join(preset);
        let belief = format!("front-end.belief={belief}");
        let mut arguments = vec!["train", preset, "--seed", "3", "--generations", "4"];
        let settings = [
            "evolution.population=20",
            "evolution.children=20",
            "evaluation.episodes=2",
            "front-end.standardise=true",
            "front-end.refit-every=1",
            &belief,
        ];
        arguments.extend(settings.iter().flat_map(|setting| ["--set", setting]));
        arguments.extend(["--out", text(&out)]);
        tpg_tests::process::tpg_ok(&arguments);
        let file = out.join("champion.tpg");
        let bytes = std::fs::read(&file).expect("a champion");
        let policy = Policy::load(&bytes).expect("valid");
        let front_end = policy.front_end().expect("a front end");
        let scale = f32::from_le_bytes(front_end.scales[0]);
        // The champion may be of the first generation, which has seen nothing yet.
        println!("{preset}: {:?}, scale {scale}", front_end.fallback);
        assert_loop_equals_eval(&file, "6", &["loss:1/10", "action:delay:1"]);
        let trace = folder.path().join("trace");
        let (trace, file) = (text(&trace), text(&file));
        tpg_tests::process::tpg_ok(&["eval", file, "--episodes", "2", "--trace", trace]);
        tpg_tests::process::tpg_ok(&["replay", trace, file]);
        let inspected = tpg_json(&["inspect", file, "--json"]);
        assert!(inspected["front_end"].is_object(), "{inspected}");
    }
}

#[test]
fn fixtures_agree_on_cartpole() {
    fixtures_agree("cartpole");
}

#[cfg(feature = "mujoco")]
#[test]
fn fixtures_agree_on_hopper() {
    fixtures_agree("hopper");
}

#[cfg(feature = "mujoco")]
#[test]
fn trained_champions_agree() {
    let folder = tempfile::tempdir().expect("a folder");
    for preset in [
        "hopper-sr-sm-b23",
        "inverted-double-pendulum-sr-b23",
        "half-cheetah-sr-sm-b23",
        "cartpole-sr-b23",
        "acrobot-sr-sm-b23",
        "pendulum-sl-b23",
    ] {
        let out = folder.path().join(preset);
        tpg_tests::process::tpg_ok(&[
            "train",
            preset,
            "--seed",
            "3",
            "--generations",
            "3",
            "--set",
            "evolution.population=30",
            "--set",
            "evolution.children=20",
            "--set",
            "evaluation.episodes=2",
            "--out",
            text(&out),
        ]);
        let report = assert_loop_equals_eval(&out.join("champion.tpg"), "20", &[]);
        assert_eq!(
            report["observability"], "blackout:2/3",
            "the champion's own default"
        );
    }
}
