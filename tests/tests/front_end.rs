//! Front ends: what a policy perceives, against numbers worked out by hand and an implementation of its own.

use tpg_runtime::blob::{ActionKind, ResetScope};
use tpg_runtime::front_end::{Fallback, FrontEnd};
use tpg_runtime::health::Health;
use tpg_runtime::isa::{Group, Op};
use tpg_runtime::rng::Pcg32;
use tpg_runtime::tables::Target;
use tpg_runtime::trace::Observer;
use tpg_runtime::{Action, AnyWidth, Policy, Reset, SliceAgent, Slices};
use tpg_tests::draft::{Draft, DraftProgram, DraftTeam, TestAgent, header, instruction};
use tpg_tests::front_end::front_end;
use tpg_tests::random::{self, Dice};
use tpg_tests::{golden, old_format};

/// A policy of one program, two inputs and one output, which it sets to the perceived first element.
fn echo(fallback: Fallback, degree: u8, columns: &[u16], numbers: &[f32]) -> Draft {
    let mut draft = Draft {
        header: header(1, 2),
        teams: vec![DraftTeam {
            members: vec![0],
            ..DraftTeam::default()
        }],
        programs: Vec::new(),
        cells: Vec::new(),
        image: Vec::new(),
        front_end: Vec::new(),
        ranges: Vec::new(),
    };
    draft.header.action_kind = ActionKind::Continuous;
    draft.header.actions = 1;
    let mut numbers = numbers.iter();
    draft.front_end = front_end(&mut draft.header, fallback, degree, columns, || {
        *numbers.next().expect("enough numbers")
    });
    assert_eq!(numbers.next(), None, "too many numbers");
    draft
        .programs
        .push(DraftProgram::bidding(0.0, Target::Atomic(0)));
    let s1 = draft.scalar(0, 1);
    draft.programs[0].code = vec![instruction(Op::Add, s1, s1, 0)];
    draft.programs[0].output = Some(s1);
    draft
}

/// What is perceived of each observation, and the instructions that each decision counts.
fn perceived(bytes: &[u8], observations: &[[f32; 2]]) -> Vec<([f32; 2], u32)> {
    let mut agent = TestAgent::new(Policy::load(bytes).expect("a policy")).expect("room");
    let mut seen = Vec::new();
    for observation in observations {
        let instructions = agent
            .decide(observation)
            .expect("two elements")
            .instructions;
        seen.push(([agent.words()[0], agent.words()[1]], instructions));
    }
    seen
}

#[test]
fn inputs_that_a_scale_of_zero_hides_are_not_used() {
    for (scale, used) in [(0.5, 1), (0.0, 0), (-0.0, 0)] {
        let bytes = echo(Fallback::Zero, 0, &[], &[1.0, -2.0, scale, 4.0]).encode();
        let policy = Policy::load(&bytes).expect("a policy");
        let inputs = tpg_tools::disassemble::inputs_used(&policy, policy.tables().code);
        assert_eq!(inputs.len(), used, "{scale}");
    }
}

/// The vectors of `docs/semantics.md` for versions 1 and 2.
#[test]
fn policies_of_version_2_perceive_as_documented() {
    let scaling = [1.0, -2.0, 0.5, 4.0];
    let observations = [
        [3.0, -1.5],
        [0.0, -0.0],
        [f32::NAN, 0.0],
        [41.0, f32::INFINITY],
    ];
    let perceived = |draft: Draft| perceived(&old_format(&draft.encode()), &observations);
    let zero = perceived(echo(Fallback::Zero, 0, &[], &scaling));
    let visible = ([1.0, 2.0], 3);
    let last = ([10.0, 8.0], 3);
    assert_eq!(zero, [visible, ([0.0; 2], 1), ([0.0; 2], 1), last]);
    let hold = perceived(echo(Fallback::Hold, 0, &[], &scaling));
    assert_eq!(hold, [visible, ([1.0, 2.0], 1), ([1.0, 2.0], 1), last]);
    // One column, the second; variables x1 and u; rows for 1, x1, x1², x1·u, u, u². The action is x0 = 1, clamped.
    let belief = [&scaling[..], &[0.5, 0.25, -0.125, 1.0, 2.0, 4.0]].concat();
    let believed = perceived(echo(Fallback::Model, 2, &[1], &belief));
    // 0.5 + 0.25·2 − 0.125·4 + 1·2 + 2·1 + 4·1 = 8.5 on top of 2, then limited; again from 10.
    assert_eq!(
        believed,
        [visible, ([1.0, 10.0], 10), ([1.0, 10.0], 10), last]
    );
}

/// The vectors of `docs/semantics.md` for version 3, then random observations, each element of which is missing in one of
/// three. The numbers of those come from the reference below.
#[test]
fn missing_elements_are_filled_as_documented() {
    let scaling = [1.0, -2.0, 0.5, 4.0];
    let belief = [&scaling[..], &[0.5, 0.25, -0.125, 1.0, 2.0, 4.0]].concat();
    let kinds = [
        ("mean", echo(Fallback::Zero, 0, &[], &scaling)),
        ("hold", echo(Fallback::Hold, 0, &[], &scaling)),
        ("model", echo(Fallback::Model, 2, &[1], &belief)),
    ];
    let (nan, infinite) = (f32::NAN, f32::INFINITY);
    let table = [
        [3.0, -1.5],
        [nan, -1.5],
        [5.0, infinite],
        [0.0, -0.0],
        [nan, nan],
    ];
    let expected = [
        [[1.0, 2.0], [0.0, 2.0], [2.0, 0.0], [-0.5, 8.0], [0.0, 0.0]],
        [[1.0, 2.0], [1.0, 2.0], [2.0, 2.0], [-0.5, 8.0], [-0.5, 8.0]],
        [
            [1.0, 2.0],
            [1.0, 2.0],
            [2.0, 10.0],
            [-0.5, 8.0],
            [-0.5, -1.5],
        ],
    ];
    let mut text = String::from(
        "# kind, observation, what is perceived, instructions of the front end; bits of f32 in hexadecimal\n",
    );
    for ((kind, draft), expected) in kinds.iter().zip(expected) {
        let mut dice = Dice::new(3);
        let random = (0..1000).map(|_| [(); 2].map(|()| element_or_nothing(&mut dice)));
        let observations: Vec<[f32; 2]> = table.into_iter().chain(random).collect();
        let file = draft.encode();
        let found = perceived(&file, &observations);
        let bits = |x: [f32; 2]| x.map(f32::to_bits);
        for ((x, _), wanted) in found.iter().zip(expected) {
            assert_eq!(bits(*x), bits(wanted), "{kind}");
        }
        let policy = Policy::load(&file).expect("a policy");
        let mut reference = Reference::new(&policy);
        for (observation, (x, instructions)) in observations.iter().zip(&found) {
            let counted = reference.perceive(observation);
            assert_eq!(bits(*x), [0, 1].map(|k| reference.perceived[k].to_bits()));
            // The program has one instruction.
            assert_eq!(counted + 1, *instructions, "{kind} {observation:?}");
            assert!(*instructions <= policy.bounds().instructions);
            // The action is the first element, clamped as the header says.
            let header = policy.header();
            reference.action[0] = x[0].clamp(header.action_low, header.action_high);
            let hex = |x: [f32; 2]| format!("{:08x} {:08x}", x[0].to_bits(), x[1].to_bits());
            let (o, x) = (hex(*observation), hex(*x));
            text.push_str(&format!("{kind} {o} -> {x} {counted}\n"));
        }
    }
    golden::assert_text("v3/missing.txt", &text);
}

/// An observer with room for the model, and what it is told.
#[derive(Default)]
struct Predictions {
    room: [f32; 3],
    told: Vec<(u16, f32, Option<f32>)>,
}

impl Observer for Predictions {
    fn room(&mut self) -> &mut [f32] {
        &mut self.room
    }

    fn predict(&mut self, input: u16, change: f32, residual: Option<f32>) {
        self.told.push((input, change, residual));
    }
}

/// The numbers of the table above: the model adds 0.5 to nothing, and 8.5 to x₂ = 2 with u = 1, of which 10 is the limit.
#[test]
fn an_observer_is_told_what_the_model_predicted() {
    let belief = [1.0, -2.0, 0.5, 4.0, 0.5, 0.25, -0.125, 1.0, 2.0, 4.0];
    let file = echo(Fallback::Model, 2, &[1], &belief).encode();
    let mut agent = TestAgent::new(Policy::load(&file).expect("a policy")).expect("room");
    let mut observer = Predictions::default();
    for observation in [[3.0, -1.5], [5.0, -1.5], [f32::NAN; 2]] {
        agent
            .decide_traced(&observation, &mut observer)
            .expect("two elements");
    }
    let wanted = [(1, 0.5, Some(1.5)), (1, 8.5, Some(-8.0)), (1, 8.5, None)];
    assert_eq!(observer.told, wanted);
}

#[test]
fn who_watches_the_model_changes_nothing() {
    for seed in 0..60 {
        let new = random::perceiving_policy(seed).encode();
        let copies = Policy::load(&new).expect("a policy").header().groups & Group::Copies.bit();
        // Older versions know no moves and latches.
        let old = (copies == 0).then(|| old_format(&new));
        for file in old.into_iter().chain([new]) {
            let policy = Policy::load(&file).expect("a policy");
            let memory = vec![0.0; Health::<Vec<f32>>::words(&policy)];
            let Some(mut health) = Health::new(&policy, memory) else {
                continue;
            };
            let [mut plain, mut watched] = [(); 2].map(|()| TestAgent::new(policy).expect("room"));
            let mut dice = Dice::new(seed);
            for step in 0..30 {
                let observation: Vec<f32> = (0..policy.header().observation_len)
                    .map(|_| dice.measurement())
                    .collect();
                let decision = format!("{:?}", plain.decide(&observation));
                let traced = watched.decide_traced(&observation, &mut health);
                assert_eq!(decision, format!("{traced:?}"), "{seed}, step {step}");
                let bits = |agent: &TestAgent<'_>| -> Vec<u32> {
                    agent.words().iter().map(|x| x.to_bits()).collect()
                };
                assert_eq!(bits(&plain), bits(&watched), "{seed}, step {step}");
            }
        }
    }
}

/// A number, or one of the bit patterns that stand for a missing element.
fn element_or_nothing(dice: &mut Dice) -> f32 {
    match dice.below(3) {
        0 => dice.pick(&[f32::NAN, f32::INFINITY, f32::NEG_INFINITY]),
        _ => dice.number(),
    }
}

#[test]
fn masks_and_blind_decisions_are_those_of_nan() {
    for seed in 0..100 {
        let draft = match seed % 2 {
            0 => random::perceiving_policy(seed),
            _ => random::policy(seed),
        };
        let file = draft.encode();
        let policy = Policy::load(&file).expect("a policy");
        let [mut with_nan, mut masked] = [(); 2].map(|()| TestAgent::new(policy).expect("room"));
        let mut dice = Dice::new(seed);
        let inputs = usize::from(policy.header().observation_len);
        for step in 0..20 {
            let mut observation: Vec<f32> = (0..inputs).map(|_| dice.measurement()).collect();
            let blind = step % 5 == 3;
            let missing: Vec<bool> = (0..inputs).map(|_| blind || dice.below(3) == 0).collect();
            let found = match blind {
                true => masked.decide_blind(),
                false => (masked.decide_masked(&observation, &missing)).expect("the right length"),
            };
            let found = format!("{found:?}");
            for (x, missing) in observation.iter_mut().zip(&missing) {
                if *missing {
                    *x = f32::NAN;
                }
            }
            let wanted = with_nan.decide(&observation).expect("the right length");
            assert_eq!(found, format!("{wanted:?}"), "{seed}");
            let bits = |agent: &TestAgent<'_>| -> Vec<u32> {
                agent.words().iter().map(|x| x.to_bits()).collect()
            };
            assert_eq!(bits(&with_nan), bits(&masked), "{seed}");
        }
        let longer = vec![false; inputs + 1];
        assert!(masked.decide_masked(&vec![0.0; inputs], &longer).is_err());
        assert!(
            masked
                .decide_masked(&vec![0.0; inputs + 1], &longer)
                .is_err()
        );
    }
}

/// Perceives as `docs/semantics.md` says, with exponents in place of nested loops.
struct Reference {
    fallback: Fallback,
    /// Whether each element can be missing by itself.
    each: bool,
    model_instructions: u32,
    means: Vec<f32>,
    scales: Vec<f32>,
    columns: Vec<usize>,
    /// Factors of each monomial, by the variables' numbers, and its coefficients.
    rows: Vec<(Vec<usize>, Vec<f32>)>,
    perceived: Vec<f32>,
    action: Vec<f32>,
}

fn limited(x: f32) -> f32 {
    if x.is_finite() {
        x.clamp(-10.0, 10.0)
    } else {
        0.0
    }
}

impl Reference {
    fn new(policy: &Policy<'_>) -> Self {
        let front_end: FrontEnd<'_> = policy.front_end().expect("a front end");
        let floats = |words: &[[u8; 4]]| words.iter().map(|w| f32::from_le_bytes(*w)).collect();
        let columns: Vec<usize> = (front_end.columns.iter())
            .map(|c| usize::from(u16::from_le_bytes(*c)))
            .collect();
        let actions = match policy.header().action_kind {
            ActionKind::Discrete => 1,
            _ => policy.header().outputs(),
        };
        // Non-decreasing lists of variables up to the degree, in the order of their text: prefixes first.
        let mut monomials = vec![Vec::new()];
        let mut open = vec![Vec::new()];
        for _ in 0..front_end.degree {
            let mut longer: Vec<Vec<usize>> = Vec::new();
            for list in &open {
                let from = list.last().copied().unwrap_or(0);
                longer.extend((from..columns.len() + actions).map(|k| {
                    let mut list: Vec<usize> = list.clone();
                    list.push(k);
                    list
                }));
            }
            monomials.extend(longer.iter().cloned());
            open = longer;
        }
        monomials.sort();
        let coefficients: Vec<f32> = floats(front_end.coefficients);
        let rows = coefficients
            .chunks(columns.len().max(1))
            .map(<[f32]>::to_vec);
        Reference {
            fallback: front_end.fallback,
            each: policy.header().version >= 3,
            model_instructions: front_end.model_instructions(policy.header()),
            means: floats(front_end.means),
            scales: floats(front_end.scales),
            rows: monomials.into_iter().zip(rows).collect(),
            perceived: vec![0.0; front_end.means.len()],
            action: vec![0.0; actions],
            columns,
        }
    }

    fn reset(&mut self) {
        self.perceived.fill(0.0);
        self.action.fill(0.0);
    }

    /// Returns the instructions that the observation counts as.
    fn perceive(&mut self, observation: &[f32]) -> u32 {
        let finite = |x: f32| if x.is_finite() { x } else { 0.0 };
        let blank = observation.iter().all(|x| finite(*x) == 0.0);
        let each = self.each;
        let missing = |k: usize| match each {
            true => !observation[k].is_finite(),
            false => blank,
        };
        let before = self.perceived.clone();
        let mut instructions = 0;
        for (k, o) in observation.iter().enumerate() {
            if !missing(k) {
                let x = (finite(*o) - self.means[k]) * self.scales[k];
                self.perceived[k] = limited(x);
                instructions += 1;
            } else if self.fallback == Fallback::Zero {
                self.perceived[k] = 0.0;
            }
        }
        if self.columns.iter().any(|k| missing(*k)) {
            instructions += self.model_instructions;
        }
        let mut variables: Vec<f32> = self.columns.iter().map(|c| before[*c]).collect();
        variables.extend(&self.action);
        let believed = self.columns.iter().enumerate();
        for (q, column) in believed.filter(|(_, k)| missing(**k)) {
            let mut sum = 0.0f32;
            for (factors, coefficients) in &self.rows {
                let product = factors.iter().map(|v| variables[*v]).reduce(|x, y| x * y);
                sum += product.unwrap_or(1.0) * coefficients[q];
            }
            self.perceived[*column] = limited(before[*column] + sum);
        }
        instructions
    }

    fn act(&mut self, action: Action<'_>, actions: u16) {
        match action {
            Action::Discrete(k) => self.action = vec![f32::from(k) - f32::from(actions - 1) / 2.0],
            Action::Continuous(values) => self.action.copy_from_slice(values),
        }
    }
}

/// Observations of which one in four is zeros, and one in four missing.
fn observation(dice: &mut Dice, len: usize) -> Vec<f32> {
    let kind = dice.below(4);
    let element = |dice: &mut Dice| match kind {
        0 => dice.pick(&[0.0, -0.0]),
        1 => f32::NAN,
        _ => dice.measurement(),
    };
    (0..len).map(|_| element(dice)).collect()
}

#[test]
fn random_policies_perceive_as_the_reference_and_alike_in_borrowed_memory() {
    let (mut beliefs, mut scopes) = (0, Vec::new());
    for seed in 0..400 {
        let mut bytes = random::perceiving_policy(seed / 2).encode();
        let copies = Policy::load(&bytes).expect("a policy").header().groups & Group::Copies.bit();
        // Older versions know no moves and latches.
        if seed % 2 == 1 && copies == 0 {
            bytes = old_format(&bytes);
        }
        let policy = Policy::load(&bytes).unwrap_or_else(|error| panic!("{seed}: {error}"));
        let header = policy.header();
        scopes.push(header.reset_scope);
        let mut reference = Reference::new(&policy);
        let mut agent = TestAgent::new(policy).expect("room");
        let (mut words, mut bids, mut visited) = (vec![9.0; 4096], vec![0.0; 64], vec![true; 32]);
        let mut streams = vec![Pcg32::new(0, 0); 64];
        let slices = Slices {
            words: &mut words,
            bids: &mut bids,
            visited: &mut visited,
            streams: &mut streams,
        };
        let mut borrowed: SliceAgent<'_, '_, AnyWidth> =
            SliceAgent::new_in(policy, slices).expect("room");
        let mut dice = Dice::new(seed ^ 77);
        let (inputs, window) = (
            usize::from(header.observation_len),
            usize::from(header.window),
        );
        for episode in 0..4 {
            let what = if episode == 0 {
                Reset::Agent
            } else {
                Reset::Episode
            };
            reference.reset();
            agent.reset(what, seed);
            borrowed.reset(what, seed);
            for step in 0..25 {
                let observation = observation(&mut dice, inputs);
                reference.perceive(&observation);
                let other = borrowed.decide(&observation).expect("the right length");
                let (action, instructions) = (format!("{:?}", other.action), other.instructions);
                let decision = agent.decide(&observation).expect("the right length");
                assert_eq!(format!("{:?}", decision.action), action);
                assert_eq!(decision.instructions, instructions);
                assert!(instructions <= policy.bounds().instructions);
                reference.act(decision.action, header.actions);
                let bits = |x: &f32| x.to_bits();
                let cyclic = reference.perceived.iter().cycle().take(window);
                let expected: Vec<u32> = cyclic.map(bits).collect();
                let found: Vec<u32> = agent.words()[..window].iter().map(bits).collect();
                assert_eq!(
                    found, expected,
                    "policy {seed}, episode {episode}, step {step}"
                );
                assert!(agent.words().iter().all(|x| x.is_finite()));
                beliefs += usize::from(reference.fallback == Fallback::Model);
            }
        }
    }
    assert!(beliefs > 5_000, "only {beliefs} decisions with a belief");
    for scope in ResetScope::ALL {
        assert!(scopes.contains(scope), "no policy of scope {scope:?}");
    }
}

/// The carried memory image and what memory holds are not touched by a front end's words.
#[test]
fn memory_lies_where_it_did() {
    for seed in 0..50 {
        let draft = random::perceiving_policy(seed);
        let bytes = draft.encode();
        let agent = TestAgent::new(Policy::load(&bytes).expect("a policy")).expect("room");
        let words = agent.words().len() - draft.memory_start();
        assert_eq!(agent.memory().len(), words);
        if !draft.image.is_empty() {
            assert_eq!(agent.memory(), draft.image);
        }
    }
}
