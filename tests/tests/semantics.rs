//! Decisions of small graphs, worked out by hand: `docs/semantics.md`, "One decision", "State" and "Actions".

use tpg_runtime::blob::{
    ActionKind, InitialValues, MemoryModel, RegisterMode, ResetScope, WriteDistribution,
};
use tpg_runtime::isa::Op;
use tpg_runtime::tables::{ProgramId, Target, TeamId};
use tpg_runtime::{
    Action, Agent, AnyWidth, CapacityError, Fixed, ObservationError, Policy, Reset, State,
};
use tpg_tests::draft::{
    Draft, DraftProgram, DraftTeam, TestAgent, header, instruction, make_stateful,
};

const WIDTH: u16 = 2;

/// A discrete, stateless policy: teams list program numbers, programs have a bid and a target.
fn graph(teams: &[&[u16]], programs: &[(f32, Target)]) -> Draft {
    Draft {
        header: header(WIDTH, 3),
        teams: teams
            .iter()
            .map(|members| DraftTeam {
                members: members.to_vec(),
                ..DraftTeam::default()
            })
            .collect(),
        programs: programs
            .iter()
            .map(|(bid, target)| DraftProgram::bidding(*bid, *target))
            .collect(),
        cells: Vec::new(),
        image: Vec::new(),
        front_end: Vec::new(),
        ranges: Vec::new(),
    }
}

const fn atomic(action: u16) -> Target {
    Target::Atomic(action)
}

const fn team(number: u16) -> Target {
    Target::Team(TeamId(number))
}

/// Gives program `number` as many instructions, without effect on its bid, as its number plus one.
fn make_countable(draft: &mut Draft) {
    for number in 0..draft.programs.len() {
        let s1 = draft.scalar(number, 1);
        draft.programs[number].code = vec![instruction(Op::Abs, s1, s1, 0); number + 1];
    }
}

fn agent(bytes: &[u8]) -> TestAgent<'_> {
    TestAgent::new(Policy::load(bytes).expect("a policy")).expect("enough room")
}

/// Winner, teams visited and instructions executed in one decision of a fresh agent.
fn path(draft: &Draft) -> (u16, u16, u32) {
    let bytes = draft.encode();
    let mut agent = agent(&bytes);
    let decision = agent.decide(&[0.0; 3]).expect("three elements");
    let ProgramId(winner) = decision.winner;
    (winner, decision.teams, decision.instructions)
}

#[test]
fn the_highest_bid_wins_and_of_equals_the_earlier() {
    let programs = [(1.0, atomic(0)), (3.0, atomic(1)), (2.0, atomic(0))];
    assert_eq!(path(&graph(&[&[0, 1, 2]], &programs)).0, 1);
    let equal = [(1.0, atomic(0)), (3.0, atomic(1)), (3.0, atomic(0))];
    assert_eq!(path(&graph(&[&[0, 1, 2]], &equal)).0, 1);
    // The order is the team's, not that of the numbers.
    assert_eq!(path(&graph(&[&[2, 1, 0]], &equal)).0, 2);
    // Zeros of either sign are equal, and the lowest bid there is can win alone.
    let zeros = [(-0.0, atomic(0)), (0.0, atomic(1))];
    assert_eq!(path(&graph(&[&[0, 1]], &zeros)).0, 0);
    assert_eq!(path(&graph(&[&[0]], &[(f32::MIN, atomic(0))])).0, 0);
}

#[test]
fn programs_that_lead_to_visited_teams_take_no_part() {
    let programs = [
        (5.0, team(1)),
        (1.0, atomic(0)),
        (9.0, team(0)), // back to the root
        (8.0, team(1)), // to its own team
        (0.0, atomic(1)),
    ];
    let mut draft = graph(&[&[0, 1], &[2, 3, 4]], &programs);
    make_countable(&mut draft);
    // Programs 0 and 1 run in the root, only 4 in the other team.
    assert_eq!(path(&draft), (4, 2, 1 + 2 + 5));
}

#[test]
fn an_ineligible_program_takes_no_part_though_it_ran() {
    let programs = [(9.0, team(1)), (1.0, atomic(0)), (2.0, atomic(1))];
    let mut draft = graph(&[&[0, 1], &[0, 1, 2]], &programs);
    make_countable(&mut draft);
    // Program 0 led here with the highest bid; program 1 keeps its bid and loses.
    assert_eq!(path(&draft), (2, 2, 1 + 2 + 3));
}

#[test]
fn cycles_terminate() {
    let ring = [
        (9.0, team(1)),
        (9.0, team(2)),
        (9.0, team(0)),
        (1.0, atomic(1)),
    ];
    let draft = graph(&[&[0, 3], &[1, 3], &[2, 3]], &ring);
    assert_eq!(path(&draft), (3, 3, 0));
}

#[test]
fn a_shared_program_runs_once_and_for_the_team_that_ran_it() {
    let programs = [(2.0, atomic(0)), (5.0, team(1)), (1.0, atomic(1))];
    let mut draft = graph(&[&[0, 1], &[0, 2]], &programs);
    make_stateful(&mut draft.header, MemoryModel::Team);
    for (key, team) in draft.teams.iter_mut().enumerate() {
        team.slots = [0xff, 0, 0];
        team.constants = vec![-1.0; 8];
        team.stream_key = key as u32;
    }
    // Counts its runs in s1 and writes the count to shared memory.
    let s1 = draft.scalar(0, 1);
    draft.programs[0].constants[1] = 0.0;
    draft.programs[0].code = vec![
        instruction(Op::Add, s1, s1, 0),
        instruction(Op::WriteS, 0, s1, 0),
    ];
    let bytes = draft.encode();
    let mut agent = agent(&bytes);
    let decision = agent.decide(&[1.0, 0.0, 0.0]).expect("three elements");
    assert_eq!((decision.winner, decision.teams), (ProgramId(0), 2));
    assert_eq!(decision.instructions, 2, "it ran once");
    assert!((agent.words()[usize::from(s1)] - 1.0).abs() < f32::EPSILON);
    let (first, second) = agent.memory().split_at(8);
    assert_eq!(first.iter().filter(|x| **x > 0.0).count(), 1, "{first:?}");
    assert!(second.iter().all(|x| *x < 0.0), "{second:?}");
}

/// One program that adds the first observed element to `s0`, from a constant of 10.
fn accumulator() -> Draft {
    let mut draft = graph(&[&[0]], &[(10.0, atomic(1))]);
    let s0 = draft.scalar(0, 0);
    draft.programs[0].code = vec![instruction(Op::Add, s0, s0, 0)];
    draft
}

fn bids(draft: &Draft, decisions: usize) -> Vec<f32> {
    let bytes = draft.encode();
    let mut agent = agent(&bytes);
    let at = usize::from(draft.scalar(0, 0));
    (0..decisions)
        .map(|_| {
            agent.decide(&[1.5, 0.0, 0.0]).expect("three elements");
            agent.words()[at]
        })
        .collect()
}

#[test]
fn stateful_registers_accumulate_and_stateless_ones_start_anew() {
    let mut draft = accumulator();
    assert_eq!(bids(&draft, 3), [11.5, 11.5, 11.5]);
    draft.header.initial_values = InitialValues::Zero;
    assert_eq!(bids(&draft, 3), [1.5, 1.5, 1.5]);
    make_stateful(&mut draft.header, MemoryModel::None);
    assert_eq!(bids(&draft, 3), [1.5, 3.0, 4.5]);
    draft.header.initial_values = InitialValues::Evolved;
    assert_eq!(bids(&draft, 3), [11.5, 13.0, 14.5]);
}

#[test]
fn only_programs_that_run_change_their_registers() {
    let programs = [(1.0, atomic(0)), (0.0, team(1)), (7.0, atomic(1))];
    let mut draft = graph(&[&[0, 1], &[2]], &programs);
    make_stateful(&mut draft.header, MemoryModel::None);
    for number in 0..3 {
        let s1 = draft.scalar(number, 1);
        draft.programs[number].code = vec![instruction(Op::Add, s1, s1, 0)];
    }
    let bytes = draft.encode();
    let mut agent = agent(&bytes);
    for _ in 0..4 {
        agent.decide(&[1.0, 0.0, 0.0]).expect("three elements");
    }
    let s1 = |n| agent.words()[usize::from(draft.scalar(n, 1))];
    assert_eq!(vec![s1(0), s1(1), s1(2)], vec![4.0, 4.0, 0.0]);
}

/// An accumulator that writes its sum to team memory, in a scope.
fn writer(scope: ResetScope) -> Draft {
    let mut draft = accumulator();
    make_stateful(&mut draft.header, MemoryModel::Team);
    draft.header.reset_scope = scope;
    draft.teams[0].slots = [0xff, 0, 0];
    draft.teams[0].constants = vec![-2.0; 8];
    let s0 = draft.scalar(0, 0);
    draft.programs[0]
        .code
        .push(instruction(Op::WriteS, 0, s0, 0));
    draft
}

/// Stateless registers do not keep team memory from lasting as long as its scope says.
#[test]
fn memory_outlives_decisions_of_stateless_programs() {
    let mut draft = writer(ResetScope::PerEpisode);
    draft.header.register_mode = RegisterMode::Stateless;
    let bytes = draft.encode();
    let mut agent = agent(&bytes);
    for _ in 0..30 {
        agent.decide(&[1.0, 0.0, 0.0]).expect("three elements");
    }
    let written = agent.memory().iter().filter(|x| **x > 0.0).count();
    assert!(written > 1, "{:?}", agent.memory());
    assert!(agent.memory().iter().all(|x| *x < 11.5), "10 + 1 each time");
    agent.reset(Reset::Episode, 0);
    assert_eq!(agent.memory(), [-2.0; 8]);
}

/// Whether a reset after some decisions clears registers, memory and streams.
fn clears(scope: ResetScope, what: Reset) -> [bool; 3] {
    let draft = writer(scope);
    let bytes = draft.encode();
    let (mut fresh, mut agent) = (agent(&bytes), agent(&bytes));
    fresh.reset(Reset::Agent, 5);
    agent.reset(Reset::Agent, 5);
    for _ in 0..12 {
        agent.decide(&[1.0, 0.0, 0.0]).expect("three elements");
    }
    agent.reset(what, 5);
    let s0 = usize::from(draft.scalar(0, 0));
    let registers = agent.words()[s0].to_bits() == fresh.words()[s0].to_bits();
    let memory = agent.memory() == fresh.memory();
    // Same streams, same slots: compare where the next writes go, from equal memories.
    let slots = |agent: &mut TestAgent<'_>| {
        (0..20)
            .map(|_| {
                agent.set_memory(&[0.0; 8]).expect("eight words");
                agent.decide(&[1.0, 0.0, 0.0]).expect("three elements");
                agent.memory().iter().position(|x| *x > 0.0)
            })
            .collect::<Vec<_>>()
    };
    let streams = slots(&mut agent) == slots(&mut fresh);
    [registers, memory, streams]
}

#[test]
fn reset_scopes_say_what_a_reset_clears() {
    use ResetScope::{
        MemoryPerAgent, MemoryPerEpisode, Original, PerAgent, PerEpisode, PerGeneration,
    };
    for (scope, at_agent, at_episode) in [
        (Original, [true, false, true], [false; 3]),
        (PerGeneration, [true, false, true], [false; 3]),
        (PerAgent, [true; 3], [false; 3]),
        (PerEpisode, [true; 3], [true; 3]),
        (MemoryPerAgent, [true; 3], [true, false, true]),
        (MemoryPerEpisode, [true; 3], [false, true, false]),
    ] {
        assert_eq!(clears(scope, Reset::Agent), at_agent, "{scope:?}, agent");
        assert_eq!(
            clears(scope, Reset::Episode),
            at_episode,
            "{scope:?}, episode"
        );
    }
    // The last scope is that of stateless policies, whose registers never outlive a run.
    let bytes = accumulator().encode();
    let mut stateless = agent(&bytes);
    assert_eq!(
        stateless.policy().header().reset_scope,
        ResetScope::EveryDecision
    );
    for what in [Reset::Agent, Reset::Episode] {
        stateless.decide(&[1.0; 3]).expect("three elements");
        stateless.reset(what, 1);
        let s0 = usize::from(accumulator().scalar(0, 0));
        assert_eq!(stateless.words()[s0].to_bits(), 10.0f32.to_bits());
    }
}

/// Where a policy's writes go follows the distribution that its header names.
#[test]
fn writes_follow_their_distribution() {
    let share_of_the_ends = |distribution| {
        let mut draft = writer(ResetScope::PerEpisode);
        draft.header.write_distribution = distribution;
        let bytes = draft.encode();
        let mut agent = agent(&bytes);
        let mut ends = 0;
        for _ in 0..4000 {
            agent.set_memory(&[0.0; 8]).expect("eight words");
            agent.decide(&[1.0, 0.0, 0.0]).expect("three elements");
            let slot = agent.memory().iter().position(|x| *x > 0.0);
            ends += u32::from(matches!(slot, Some(0 | 7)));
        }
        f64::from(ends) / 4000.0
    };
    // P(x < 1) + P(x >= 7) of N(4, (4/3)^2), of eight equal slots, of Cauchy's distribution around 4 with scale 4/3.
    for (distribution, share) in [
        (WriteDistribution::Thesis, 0.0244),
        (WriteDistribution::Uniform, 0.25),
        (WriteDistribution::Exchanged, 0.2663),
    ] {
        let found = share_of_the_ends(distribution);
        assert!((found - share).abs() < 0.025, "{distribution:?}: {found}");
    }
}

#[test]
fn a_carried_memory_image_is_restored() {
    let image: Vec<f32> = (1..=8).map(|k| k as f32).collect();
    for scope in [ResetScope::Original, ResetScope::PerEpisode] {
        let mut draft = writer(scope);
        draft.image.clone_from(&image);
        let bytes = draft.encode();
        let mut agent = agent(&bytes);
        assert_eq!(agent.memory(), image, "at the start");
        for _ in 0..10 {
            agent.decide(&[1.0, 0.0, 0.0]).expect("three elements");
        }
        assert_ne!(agent.memory(), image);
        agent.reset(Reset::Agent, 0);
        let restored = agent.memory() == image;
        assert_eq!(restored, scope == ResetScope::PerEpisode, "{scope:?}");
        agent.load(*agent.policy()).expect("the same policy");
        assert_eq!(agent.memory(), image, "after loading again");
    }
}

#[test]
fn memory_of_another_length_is_refused() {
    let bytes = writer(ResetScope::Original).encode();
    let mut agent = agent(&bytes);
    let error = agent.set_memory(&[1.0; 7]).expect_err("seven words");
    assert_eq!((error.needed, error.available), (8, 7));
    assert_eq!(agent.memory(), [-2.0; 8], "nothing changed");
    agent
        .set_memory(&[f32::NAN; 8])
        .expect("the right length, though not finite");
    assert_eq!(agent.memory(), [0.0; 8]);
}

#[test]
fn vectors_and_matrices_of_the_observation_are_cyclic() {
    let observation = [1.0, 2.0, 3.0];
    for offset in 0..3usize {
        let mut draft = graph(&[&[0]], &[(0.0, atomic(0))]);
        draft.header.window = 6;
        draft.programs[0].registers = [2, 1, 1];
        draft.programs[0].constants = vec![0.0; 2 + 2 + 4];
        let (v0, m0) = (draft.vector(0, 0), draft.matrix(0, 0));
        draft.programs[0].code = vec![
            instruction(Op::VAbs, v0, offset as u16, 0),
            instruction(Op::MAbs, m0, offset as u16, 0),
        ];
        let bytes = draft.encode();
        let mut agent = agent(&bytes);
        agent.decide(&observation).expect("three elements");
        let expected: Vec<f32> = (0..4).map(|k| observation[(offset + k) % 3]).collect();
        let (v0, m0) = (usize::from(v0), usize::from(m0));
        assert_eq!(agent.words()[v0..v0 + 2], expected[..2]);
        assert_eq!(agent.words()[m0..m0 + 4], expected);
    }
}

#[test]
fn observations_that_are_not_finite_count_as_zero() {
    let bytes = accumulator().encode();
    let mut agent = agent(&bytes);
    for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        agent.decide(&[x, 2.0, x]).expect("three elements");
        assert_eq!(agent.words()[..3], [0.0, 2.0, 0.0]);
        let s0 = usize::from(accumulator().scalar(0, 0));
        assert_eq!(agent.words()[s0].to_bits(), 10.0f32.to_bits());
    }
}

#[test]
fn observations_of_another_length_are_refused() {
    let bytes = accumulator().encode();
    let mut agent = agent(&bytes);
    let before = agent.words().to_vec();
    for got in [0, 2, 4] {
        let error = agent.decide(&vec![1.0; got]).expect_err("wrong length");
        assert_eq!(error, ObservationError { needed: 3, got });
        assert_eq!(
            error.to_string(),
            format!("observation or mask has {got} elements, the policy expects 3")
        );
    }
    assert_eq!(agent.words(), before, "nothing changed");
}

#[test]
fn a_discrete_action_is_the_index_stored_with_the_winner() {
    let programs = [(1.0, atomic(0)), (2.0, atomic(6))];
    let mut draft = graph(&[&[0, 1]], &programs);
    draft.header.actions = 7;
    let bytes = draft.encode();
    let mut agent = agent(&bytes);
    let decision = agent.decide(&[0.0; 3]).expect("three elements");
    assert_eq!(decision.action, Action::Discrete(6));
}

/// Two programs that propose other actions; the second wins.
fn continuous(actions: u16, values: &[f32]) -> Draft {
    let mut draft = graph(&[&[0, 1]], &[(1.0, atomic(0)), (2.0, atomic(0))]);
    draft.header.action_kind = ActionKind::Continuous;
    draft.header.actions = actions;
    (draft.header.action_low, draft.header.action_high) = (-0.5, 2.0);
    for (number, sign) in [(0, -1.0), (1, 1.0)] {
        draft.programs[number].registers = [2, 2, 0];
        let bid = draft.programs[number].constants[0];
        let mut constants = vec![0.0; 2 + 4];
        constants[0] = bid;
        let at = if actions == 1 { 1 } else { 4 };
        for (k, x) in values.iter().enumerate() {
            constants[at + k] = sign * x;
        }
        draft.programs[number].constants = constants;
    }
    for number in 0..2 {
        draft.programs[number].output = Some(if actions == 1 {
            draft.scalar(number, 1)
        } else {
            draft.vector(number, 1)
        });
    }
    draft
}

#[test]
fn continuous_actions_are_the_winners_register_clamped() {
    for (actions, values, expected) in [
        (1, [1.25, 0.0], [1.25, 0.0]),
        (1, [9.0, 0.0], [2.0, 0.0]),
        (1, [-0.75, 0.0], [-0.5, 0.0]),
        (2, [1.0, -0.25], [1.0, -0.25]),
        (2, [-f32::MAX, f32::MAX], [-0.5, 2.0]),
    ] {
        let bytes = continuous(actions, &values).encode();
        let mut agent = agent(&bytes);
        let decision = agent.decide(&[0.0; 3]).expect("three elements");
        assert_eq!(decision.winner, ProgramId(1));
        let expected = &expected[..usize::from(actions)];
        assert_eq!(decision.action, Action::Continuous(expected));
    }
}

#[test]
fn capacities_are_compared_before_anything_is_loaded() {
    let mut draft = writer(ResetScope::PerEpisode);
    draft.teams.push(draft.teams[0].clone());
    draft.programs.push(draft.programs[0].clone());
    draft.programs[1].code.clear();
    draft.teams[1].members = vec![1];
    let bytes = draft.encode();
    let policy = Policy::load(&bytes).expect("a policy");
    let words = policy.header().words as usize;
    fn refused<T>(result: Result<T, CapacityError>) -> (&'static str, usize, usize) {
        let error = result.err().expect("too little room");
        let text = error.to_string();
        assert!(text.contains(error.resource.name()), "{text}");
        assert!(text.contains(&error.needed.to_string()), "{text}");
        assert!(text.contains(&error.available.to_string()), "{text}");
        (error.resource.name(), error.needed, error.available)
    }
    assert_eq!(
        refused(Agent::<AnyWidth, State<8, 2, 2, 2>>::new(policy)),
        ("words", words, 8)
    );
    assert_eq!(
        refused(Agent::<AnyWidth, State<64, 1, 2, 2>>::new(policy)),
        ("programs", 2, 1)
    );
    assert_eq!(
        refused(Agent::<AnyWidth, State<64, 2, 1, 2>>::new(policy)),
        ("teams", 2, 1)
    );
    assert_eq!(
        refused(Agent::<AnyWidth, State<64, 2, 2, 1>>::new(policy)),
        ("streams", 2, 1)
    );
    assert_eq!(
        refused(Agent::<Fixed<3>, State<64, 2, 2, 2>>::new(policy)),
        ("width", 2, 3)
    );
    let mut small = Agent::<Fixed<2>, State<64, 2, 2, 2>>::new(policy).expect("enough room");
    small.decide(&[1.0, 0.0, 0.0]).expect("three elements");
    let before = small.words().to_vec();
    let mut large = draft.clone();
    large.programs.push(draft.programs[1].clone());
    large.teams[1].members.push(2);
    let bytes = large.encode();
    let policy = Policy::load(&bytes).expect("a policy");
    assert_eq!(refused(small.load(policy)), ("programs", 3, 2));
    assert_eq!(
        small.words(),
        before,
        "a refused policy leaves the old one be"
    );
}
