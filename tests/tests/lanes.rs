//! Agents in lock-step decide as single agents do: the same bits of actions and state, and the same counts. Episodes side by
//! side are those that run one after another.

use tpg_runtime::blob::{MemoryModel, RegisterMode};
use tpg_runtime::math::{LaneMask, Mask as _};
use tpg_runtime::{Action, HostAgent, LaneAgent, Policy, Reset};
use tpg_tasks::eval::{
    Arena, Conditions, Disturbance, LANES, LaneMemory, Lanes as SideBySide, Line, Link, evaluate,
};
use tpg_tasks::task::{self, Wrappers, parse_stack};
use tpg_tests::draft::Draft;
use tpg_tests::fixtures::three_teams;
use tpg_tests::random::{self, Dice};

const DECISIONS: usize = 24;

/// An action's bits.
fn bits(action: Action<'_>) -> Vec<u32> {
    match action {
        Action::Discrete(action) => vec![u32::from(action)],
        Action::Continuous(values) => values.iter().map(|x| x.to_bits()).collect(),
    }
}

/// Lets agents of a policy decide in lock-step and alone. Some lanes rest now and then, some start anew.
fn compare(name: &str, draft: &Draft) -> bool {
    let bytes = draft.encode();
    let policy = Policy::load(&bytes).unwrap_or_else(|e| panic!("{name}: {e}"));
    let header = policy.header();
    if !LaneAgent::<LANES>::accepts(header) {
        let mut memory = LaneMemory::default();
        assert!(
            LaneAgent::new_in(policy, memory.slices(&policy)).is_err(),
            "{name}"
        );
        return false;
    }
    let mut memory = LaneMemory::default();
    let mut together = LaneAgent::new_in(policy, memory.slices(&policy)).expect("room");
    let mut alone: Vec<_> = (0..LANES)
        .map(|_| Box::new(HostAgent::new(policy).expect("room")))
        .collect();
    let mut dice = Dice::new(7);
    for decision in 0..DECISIONS {
        let mut deciding = Vec::new();
        for (lane, alone) in alone.iter_mut().enumerate() {
            if decision == 0 || dice.below(10) == 0 {
                let what = dice.pick(&[Reset::Agent, Reset::Episode]);
                let seed = dice.bits();
                together.reset(lane, what, seed);
                alone.reset(what, seed);
            }
            deciding.push(dice.below(5) > 0);
        }
        let observations: Vec<Vec<f32>> = (0..LANES)
            .map(|_| {
                (0..header.observation_len)
                    .map(|_| dice.measurement())
                    .collect()
            })
            .collect();
        for (lane, observation) in observations.iter().enumerate() {
            if deciding[lane] {
                together
                    .observe(lane, observation)
                    .expect("the right length");
            }
        }
        together.decide(LaneMask::of(|lane| deciding[lane]));
        for (lane, alone) in alone
            .iter_mut()
            .enumerate()
            .filter(|(lane, _)| deciding[*lane])
        {
            let expected = alone.decide(&observations[lane]).expect("the right length");
            let found = together.decision(lane);
            let place = format!("{name}, decision {decision}, lane {lane}");
            assert_eq!(bits(found.action), bits(expected.action), "{place}");
            assert_eq!(
                (found.winner, found.instructions, found.teams),
                (expected.winner, expected.instructions, expected.teams),
                "{place}"
            );
        }
    }
    let outputs = usize::from(header.window)..usize::from(header.window) + header.outputs();
    for (lane, alone) in alone.iter().enumerate() {
        let pairs = together.words(lane).zip(alone.words());
        for (at, (found, expected)) in pairs.enumerate() {
            // Lanes keep their outputs elsewhere, and the window of one that never decided is empty in both.
            assert!(
                outputs.contains(&at) || found.to_bits() == expected.to_bits(),
                "{name}, lane {lane}: word {at} is {found}, not {expected}"
            );
        }
    }
    true
}

#[test]
fn lanes_decide_as_single_agents() {
    let mut kinds = std::collections::BTreeMap::new();
    for seed in 0..1_500 {
        let draft = random::policy(seed);
        let accepted = compare(&format!("random policy {seed}"), &draft);
        let header = &draft.header;
        let kind = (
            header.register_mode == RegisterMode::Stateful,
            header.memory_model != MemoryModel::None,
            draft.teams.len() > 1,
        );
        *kinds.entry(kind).or_insert(0) += usize::from(accepted);
    }
    println!("{kinds:?}");
    assert!(kinds.values().all(|accepted| *accepted > 10), "{kinds:?}");
}

#[test]
fn every_operation_is_the_same_in_lanes() {
    let samples = tpg_tests::samples::all();
    let accepted: Vec<_> = samples
        .iter()
        .filter(|(name, draft)| compare(name, draft))
        .map(|(name, _)| *name)
        .collect();
    // The others' outputs have programs of their own.
    assert_eq!(
        accepted,
        ["reactive", "zero", "team-memory", "classic", "copies"]
    );
}

#[test]
fn an_observation_of_another_length_is_refused() {
    let draft = &tpg_tests::samples::all()[0].1;
    let bytes = draft.encode();
    let policy = Policy::load(&bytes).expect("a sample");
    let mut memory = LaneMemory::default();
    let mut together = LaneAgent::new_in(policy, memory.slices(&policy)).expect("room");
    let error = together.observe(0, &[1.0]).expect_err("too short");
    assert_eq!(error.got, 1);
}

/// An arena of a task whose observations are blank now and then and arrive late, if `disturbed`.
fn arena(name: &str, disturbed: bool) -> Arena {
    let task = task::create(name).expect("a native task");
    let stack = parse_stack("blackout:1/3").expect("a stack");
    let wrappers = Wrappers::new(&stack, task.spec()).expect("it fits");
    let disturbances: Vec<Disturbance> = match disturbed {
        true => vec![
            "delay:1".parse().expect("a disturbance"),
            "loss:1/10".parse().expect("one"),
        ],
        false => Vec::new(),
    };
    let link = Link {
        inputs: wrappers.inputs(),
        outputs: &task.spec().outputs,
        actions: task.spec().actions,
        period_us: task.spec().period_us,
    };
    let line = Line::new(&disturbances, &link).expect("it fits");
    Arena::new(task, wrappers).with_line(line)
}

#[test]
fn episodes_side_by_side_are_those_one_after_another() {
    let seeds: Vec<u64> = (100..121).collect();
    let easier = Conditions {
        stage: 1,
        stages: 2,
        max_steps: 70,
    };
    for name in [
        "cartpole",
        "pendulum",
        "acrobot",
        "tmaze:10",
        "repeat-previous:easy",
        "noisy-position-only-pendulum",
    ] {
        for mode in [RegisterMode::Stateless, RegisterMode::Stateful] {
            for (disturbed, conditions) in [(false, Conditions::default()), (true, easier)] {
                let bytes = three_teams(name, mode);
                let policy = Policy::load(&bytes).expect("a well-formed policy");
                let mut one = arena(name, disturbed);
                let mut lanes = SideBySide::of(&one).expect("a native task");
                one.impose(conditions);
                lanes.impose(conditions);
                let mut agent = Box::new(HostAgent::new(policy).expect("room"));
                let expected = evaluate(&mut one, &mut *agent, seeds.clone()).expect("it fits");
                let found = lanes
                    .run(policy, &seeds, || false)
                    .expect("lanes accept it");
                let found: Vec<_> = found.into_iter().flatten().collect();
                assert_eq!(found, expected, "{name}, {mode:?}, disturbed {disturbed}");
                // Fewer episodes than lanes, in lanes that were used before.
                let few = lanes
                    .run(policy, &seeds[..3], || false)
                    .expect("lanes accept it");
                assert_eq!(
                    few,
                    expected[..3].iter().copied().map(Some).collect::<Vec<_>>()
                );
            }
        }
    }
}

#[test]
fn episodes_side_by_side_stop_when_asked() {
    let bytes = three_teams("cartpole", RegisterMode::Stateful);
    let policy = Policy::load(&bytes).expect("a well-formed policy");
    let mut lanes = SideBySide::of(&arena("cartpole", false)).expect("a native task");
    let stopped = lanes
        .run(policy, &[1, 2], || true)
        .expect("lanes accept it");
    assert_eq!(stopped, [None, None]);
}
