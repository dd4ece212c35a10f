//! What a run learned of a task stands in for what its policies do not see.

use tpg_runtime::front_end::Fallback;
use tpg_runtime::{HostAgent, Policy, Reset, math};
use tpg_tasks::task::{self, Rng};
use tpg_tests::process::{text, tpg_ok};

/// Mean squared errors of what is believed and of what was seen last, in standardised units, two blank steps after each
/// visible one.
fn errors(task_name: &str, preset: &str, columns: &str, degree: &str) -> (f64, f64) {
    let folder = tempfile::tempdir().expect("a folder");
    let degree = format!("front-end.degree={degree}");
    let columns = format!("front-end.columns={columns}");
    let mut arguments = vec!["train", preset, "--seed", "3", "--generations", "3"];
    let settings = [
        "evolution.population=20",
        // Few survive, so that the champion is of a generation that has a model.
        "evolution.children=60",
        "evaluation.episodes=2",
        "front-end.standardise=true",
        "front-end.belief=learned",
        "front-end.refit-every=1",
        &columns,
        &degree,
    ];
    arguments.extend(settings.iter().flat_map(|setting| ["--set", setting]));
    arguments.extend(["--out", text(folder.path())]);
    tpg_ok(&arguments);
    let bytes = std::fs::read(folder.path().join("champion.tpg")).expect("a champion");
    let policy = Policy::load(&bytes).expect("valid");
    let front_end = policy.front_end().expect("a front end");
    assert_eq!(
        front_end.fallback,
        Fallback::Model,
        "the champion has no model"
    );
    let mut agent = Box::new(HostAgent::new(policy).expect("it fits a host"));
    let mut task = task::create(task_name).expect("a native task");
    let inputs = task.spec().inputs.len();
    let (mut seen, mut held) = (vec![0.0f32; inputs], vec![0.0f32; inputs]);
    let (mut believing, mut holding) = (0.0, 0.0);
    for episode in 0..20 {
        task.reset(&mut Rng::new(1000 + episode));
        agent.reset(Reset::Episode, 0);
        for step in 0..60 {
            task.observe(&mut seen);
            let truth: Vec<f32> = (seen.iter().zip(front_end.means).zip(front_end.scales))
                .map(|((o, mean), scale)| {
                    math::standardise(*o, f32::from_le_bytes(*mean), f32::from_le_bytes(*scale))
                })
                .collect();
            let visible = step % 3 == 0;
            if visible {
                held.clone_from(&truth);
            } else {
                seen.fill(f32::NAN);
            }
            let action = agent.decide(&seen).expect("the right length").action;
            let ended = task.step(action).terminated;
            let square = |x: &[f32]| -> f64 {
                let gaps = x.iter().zip(&truth).map(|(x, t)| f64::from(x - t));
                gaps.map(|gap| gap * gap).sum()
            };
            if !visible {
                believing += square(&agent.words()[..inputs]);
                holding += square(&held);
            }
            if ended {
                break;
            }
        }
    }
    (believing, holding)
}

#[test]
fn a_belief_is_nearer_to_the_truth_than_what_was_seen_last() {
    for (task, preset, columns, degree, share) in [
        ("cartpole", "cartpole-sr-b13", "[]", "1", 0.1),
        // What the data leave out is held.
        ("cartpole", "cartpole-sr-b13", "auto", "2", 0.5),
        ("pendulum", "pendulum-sl-b13", "[]", "2", 0.1),
    ] {
        let (believing, holding) = errors(task, preset, columns, degree);
        println!("{preset}, degree {degree}: {believing:.3} of {holding:.3}");
        assert!(
            believing < share * holding,
            "{preset}: {believing} of {holding}"
        );
    }
}
