//! Windows that hold earlier observations: what they hold, what it counts, and what is refused.

use tpg_runtime::blob::Header;
use tpg_runtime::parts::{CodeField, Field};
use tpg_runtime::{Action, Capacities, Policy, Reset, Restore, VerifyError};
use tpg_tests::draft::{Draft, TestAgent};
use tpg_tests::process::{stderr, text, tpg, tpg_json};
use tpg_tests::random::{self, Dice};
use tpg_tests::samples;

/// Random policies of each test.
const RANDOM: u64 = 60;

/// The sample with this name.
fn sample(name: &str) -> Draft {
    let found = samples::remembering().into_iter().find(|(n, _)| *n == name);
    found.expect("a sample").1
}

fn window(agent: &TestAgent<'_>) -> Vec<f32> {
    let window = usize::from(agent.policy().header().window);
    agent.words()[..window].to_vec()
}

#[test]
fn the_window_holds_the_last_observations_and_repeats_them() {
    let file = sample("history").encode();
    let mut agent = TestAgent::new(Policy::load(&file).expect("a policy")).expect("room");
    let decide = |agent: &mut TestAgent<'_>, observation: &[f32]| {
        agent.decide(observation).expect("its length");
        window(agent)
    };
    let first = [1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let seen = decide(&mut agent, &[1.0, 2.0, 3.0]);
    assert_eq!(seen, [&first[..], &[1.0, 2.0]].concat());
    // What is missing counts as +0, then and later.
    let seen = decide(&mut agent, &[4.0, f32::NAN, f32::INFINITY]);
    assert_eq!(seen[..6], [4.0, 0.0, 0.0, 1.0, 2.0, 3.0]);
    for k in 0u8..3 {
        let x = f32::from(k);
        decide(&mut agent, &[x + 0.25, x + 0.5, x + 0.75]);
    }
    let last = [
        2.25, 2.5, 2.75, 1.25, 1.5, 1.75, 0.25, 0.5, 0.75, 4.0, 0.0, 0.0, 2.25, 2.5,
    ];
    assert_eq!(window(&agent), last);
    // An observation of another length changes nothing.
    assert!(agent.decide(&[9.0; 12]).is_err());
    assert_eq!(window(&agent), last);
    // What an ablation sets back is registers and memory.
    agent.restore(Restore::All);
    assert_eq!(window(&agent), last);
    for what in [Reset::Episode, Reset::Agent] {
        agent.reset(what, 3);
        assert!(window(&agent).iter().all(|x| x.to_bits() == 0), "{what:?}");
        let seen = decide(&mut agent, &[1.0, 2.0, 3.0]);
        assert_eq!(seen[..12], first);
    }
}

/// docs/format-3.md, History: the vector.
#[test]
fn the_documents_vector_is_computed() {
    let mut draft = samples::remembering().swap_remove(0).1;
    draft.header.observation_len = 2;
    (draft.header.history, draft.header.window) = (2, 4);
    for program in &mut draft.programs {
        program.code.clear();
        program.output = None;
    }
    for number in 0..draft.programs.len() {
        draft.programs[number].output = Some(draft.vector(number, 1));
    }
    let file = draft.encode();
    let mut agent = TestAgent::new(Policy::load(&file).expect("a policy")).expect("room");
    agent.decide(&[1.0, 2.0]).expect("its length");
    assert_eq!(window(&agent), [1.0, 2.0, 0.0, 0.0]);
    agent.decide(&[3.0, 4.0]).expect("its length");
    assert_eq!(window(&agent), [3.0, 4.0, 1.0, 2.0]);
}

/// With a front end, the window holds what it made of the observations, when it did so.
#[test]
fn what_was_perceived_is_remembered() {
    let file = sample("history-perceiving").encode();
    let mut agent = TestAgent::new(Policy::load(&file).expect("a policy")).expect("room");
    let mut dice = Dice::new(5);
    for what in [Reset::Agent, Reset::Episode] {
        agent.reset(what, 1);
        let mut before = vec![0.0; 14];
        for step in 0..30 {
            let observation: Vec<f32> = (0..3).map(|_| dice.measurement()).collect();
            let missing: Vec<bool> = observation.iter().map(|x| !x.is_finite()).collect();
            agent.decide(&observation).expect("its length");
            let now = window(&agent);
            assert_eq!(now[3..12], before[..9], "step {step}");
            assert_eq!(now[12..], now[..2], "step {step}");
            // A middle element has no model: what is missing stays.
            assert!(!missing[1] || now[1].to_bits() == before[1].to_bits());
            before = now;
        }
    }
}

/// The same programs over an observation that the caller makes of the last ones.
fn unrolled(draft: &Draft) -> Draft {
    let mut draft = draft.clone();
    draft.header.observation_len = draft.header.observed() as u16;
    draft.header.history = 1;
    draft
}

/// A policy with a history decides as one whose caller keeps the observations, and promises the cost of keeping them.
#[test]
fn a_caller_that_keeps_the_observations_gets_the_same_decisions() {
    for seed in (0..2 * RANDOM).step_by(2) {
        let draft = random::remembering_policy(seed);
        let (file, long) = (draft.encode(), unrolled(&draft).encode());
        let [own, by_hand] = [&file, &long].map(|file| Policy::load(file).expect("a policy"));
        let header = *own.header();
        let (inputs, observed) = (usize::from(header.observation_len), header.observed());
        assert_eq!(
            own.bounds().weighted_operations,
            by_hand.bounds().weighted_operations + (observed - inputs) as u64
        );
        assert_eq!(own.bounds().instructions, by_hand.bounds().instructions);
        assert_eq!(
            Capacities::needed_by(&header).state_bytes(),
            Capacities::needed_by(by_hand.header()).state_bytes()
        );
        let [mut own, mut by_hand] = [own, by_hand].map(|p| TestAgent::new(p).expect("room"));
        let mut dice = Dice::new(seed);
        let mut kept = vec![0.0; observed];
        for step in 0..40 {
            if step % 13 == 12 {
                let what = dice.pick(&[Reset::Agent, Reset::Episode]);
                own.reset(what, step);
                by_hand.reset(what, step);
                kept.fill(0.0);
            }
            let observation: Vec<f32> = (0..inputs).map(|_| dice.measurement()).collect();
            kept.copy_within(..observed - inputs, inputs);
            kept[..inputs].copy_from_slice(&observation);
            let one = own.decide(&observation).expect("its length");
            let other = by_hand.decide(&kept).expect("its length");
            assert_eq!(bits(one.action), bits(other.action), "{seed}, step {step}");
            assert_eq!(one.winner, other.winner);
            assert_eq!(one.instructions, other.instructions);
            assert_eq!(window(&own), window(&by_hand));
        }
    }
}

fn bits(action: Action<'_>) -> Vec<u32> {
    match action {
        Action::Discrete(number) => vec![u32::from(number)],
        Action::Continuous(values) => values.iter().map(|x| x.to_bits()).collect(),
    }
}

/// 4·n·(h − 1) bytes more than the newest observation alone.
#[test]
fn a_history_takes_the_bytes_that_the_document_says() {
    let state_bytes = |history: u16| {
        let mut draft = sample("history");
        draft.header.history = history;
        draft.header.window = 3 * history;
        let mut code = draft.programs.iter_mut().flat_map(|p| &mut p.code);
        assert!(code.next().is_some());
        for program in &mut draft.programs {
            program.code.clear();
        }
        for number in 0..draft.programs.len() {
            draft.programs[number].output = Some(draft.vector(number, 1));
        }
        let header = Header::peek(&draft.encode()).expect("a header");
        assert_eq!(header.history, history);
        Capacities::needed_by(&header).state_bytes()
    };
    assert_eq!(state_bytes(5), state_bytes(1) + 4 * 3 * 4);
}

#[test]
fn windows_and_operands_that_do_not_fit_are_refused() {
    let refusal = |draft: &Draft| Policy::load(&draft.encode()).map(|_| ()).unwrap_err();
    let mut draft = sample("history");
    draft.header.history = 5;
    let too_short = VerifyError::Header {
        field: Field::Window,
        needed: 15,
        got: 14,
    };
    assert_eq!(refusal(&draft), too_short);
    draft.header.history = u16::MAX;
    assert!(matches!(
        refusal(&draft),
        VerifyError::Header {
            field: Field::Window,
            needed: 196_605,
            ..
        }
    ));
    // A scalar names an element of the observations, none of the words that repeat them.
    let mut draft = sample("history");
    draft.programs[2].code[1].a = 12;
    let beyond = VerifyError::Operand {
        program: 2,
        instruction: 1,
        field: CodeField::A,
    };
    assert_eq!(refusal(&draft), beyond);
    let mut draft = sample("history");
    draft.header.history = 0;
    assert!(matches!(refusal(&draft), VerifyError::Decode(_)));
}

/// The setting trains, and its champion is scored, looked at and run in the loop.
#[test]
fn a_run_with_a_history_works_to_the_end() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("run");
    let output = tpg([
        "train",
        "memory",
        "--task",
        "repeat-previous:1",
        "--generations",
        "40",
        "--seed",
        "1",
        "--set",
        "policy.history=3",
        "--set",
        "policy.register-mode=stateless",
        "--set",
        "policy.reset-scope=every-decision",
        "--out",
        text(&out),
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let champion = out.join("champion.tpg");
    let shown = tpg_json(&["inspect", text(&champion), "--json"]);
    // Registers forget everything, so what is above chance comes from the window.
    assert!(shown["history"].as_u64() >= Some(2), "{shown}");
    let run = |verb: &str| tpg_json(&[verb, text(&champion), "--episodes", "20", "--json"]);
    let (eval, hil) = (run("eval"), run("hil"));
    assert_eq!(eval["returns"], hil["returns"]);
    assert!(eval["mean"].as_f64() > Some(-0.3), "{eval}");
    let code = tpg(["inspect", text(&champion), "--disassemble"]);
    let code = String::from_utf8_lossy(&code.stdout).into_owned();
    assert!(code.contains("[-1]"), "{code}");
    let refused = tpg([
        "train",
        "hopper-sr",
        "--set",
        "policy.history=6000",
        "--out",
        text(&folder.path().join("other")),
    ]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(stderr(&refused).contains("policy.history"));
}
