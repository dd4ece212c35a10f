//! Following a decision: the observer sees what happened, the result is the same, a recorded trace replays.

use tpg_runtime::blob::RegisterMode;
use tpg_runtime::isa::Op;
use tpg_runtime::tables::{ProgramId, Section, Target, TeamId};
use tpg_runtime::trace::{MemoryAddress, Observer};
use tpg_runtime::{Policy, Reset};
use tpg_tests::draft::{
    Draft, DraftProgram, DraftTeam, TestAgent, header, instruction, make_stateful,
};
use tpg_tests::fixtures::three_teams;
use tpg_tests::samples;

/// One call of an observer.
#[derive(Debug, Clone, PartialEq)]
enum Event {
    Enter(u16),
    Skip(u16),
    Run(u16, u16),
    Read(MemoryAddress),
    Write(MemoryAddress),
    Bid(u16, f32),
    Choose(u16, Target),
}

#[derive(Default)]
struct Log(Vec<Event>);

impl Observer for Log {
    fn enter(&mut self, TeamId(team): TeamId) {
        self.0.push(Event::Enter(team));
    }

    fn skip(&mut self, ProgramId(program): ProgramId) {
        self.0.push(Event::Skip(program));
    }

    fn run(&mut self, ProgramId(program): ProgramId, instructions: u16) {
        self.0.push(Event::Run(program, instructions));
    }

    fn read(&mut self, place: MemoryAddress) {
        self.0.push(Event::Read(place));
    }

    fn write(&mut self, place: MemoryAddress) {
        self.0.push(Event::Write(place));
    }

    fn bid(&mut self, ProgramId(program): ProgramId, bid: f32) {
        self.0.push(Event::Bid(program, bid));
    }

    fn choose(&mut self, ProgramId(program): ProgramId, target: Target) {
        self.0.push(Event::Choose(program, target));
    }
}

/// Two teams that share program 1; the second's programs read and write its memory.
fn shared_program() -> Draft {
    let mut header = header(2, 2);
    make_stateful(&mut header, tpg_runtime::blob::MemoryModel::Team);
    let team = |members: &[u16]| DraftTeam {
        members: members.to_vec(),
        ..DraftTeam::default()
    };
    let mut remembering = team(&[1, 2, 3]);
    remembering.slots = [0xff, 0, 0];
    remembering.constants = vec![0.25; 8];
    let mut draft = Draft {
        header,
        teams: vec![team(&[0, 1]), remembering],
        programs: vec![
            DraftProgram::bidding(2.0, Target::Team(TeamId(1))),
            DraftProgram::bidding(1.0, Target::Atomic(0)),
            DraftProgram::bidding(0.5, Target::Atomic(1)),
            DraftProgram::bidding(3.0, Target::Team(TeamId(0))),
        ],
        cells: Vec::new(),
        image: Vec::new(),
        front_end: Vec::new(),
        ranges: Vec::new(),
    };
    let [s0, s1] = [0, 1].map(|i| draft.scalar(2, i));
    // Every slot is read, so that all are kept and any write is made.
    draft.programs[2].code = (0..8)
        .map(|slot| instruction(Op::ReadS, s1, slot, 0))
        .chain([instruction(Op::WriteS, 0, s0, 0)])
        .collect();
    draft
}

#[test]
fn events_come_in_the_order_in_which_things_happen() {
    let bytes = shared_program().encode();
    let policy = Policy::load(&bytes).expect("a policy");
    let mut agent = TestAgent::new(policy).expect("small enough");
    let mut log = Log::default();
    agent
        .decide_traced(&[0.0; 2], &mut log)
        .expect("two elements");
    let written = log.0.iter().find_map(|event| match event {
        Event::Write(place) => Some(*place),
        _ => None,
    });
    let written = written.expect("a write");
    assert!(matches!(
        written,
        MemoryAddress::Slot(Section::Scalar, 0..=7)
    ));
    let mut expected = vec![
        Event::Enter(0),
        Event::Run(0, 0),
        Event::Bid(0, 2.0),
        Event::Run(1, 0),
        Event::Bid(1, 1.0),
        Event::Choose(0, Target::Team(TeamId(1))),
        Event::Enter(1),
        // The second team uses the bid of the first.
        Event::Bid(1, 1.0),
        Event::Run(2, 9),
    ];
    expected.extend((0..8).map(|slot| Event::Read(MemoryAddress::Slot(Section::Scalar, slot))));
    expected.extend([
        Event::Write(written),
        Event::Bid(2, 0.5),
        Event::Skip(3),
        Event::Choose(1, Target::Atomic(0)),
    ]);
    assert_eq!(log.0, expected);
}

#[test]
fn indexed_memory_is_told_by_cell() {
    let classic = samples::all().into_iter().find(|s| s.0 == "classic");
    let (_, draft) = classic.expect("a sample");
    let bytes = draft.encode();
    let mut agent = TestAgent::new(Policy::load(&bytes).expect("a policy")).expect("small");
    let mut log = Log::default();
    let observation = vec![0.5; usize::from(draft.header.observation_len)];
    for _ in 0..10 {
        agent
            .decide_traced(&observation, &mut log)
            .expect("the right length");
    }
    assert!(
        log.0
            .contains(&Event::Read(MemoryAddress::Cell(draft.cells[3])))
    );
    let written = |cell: u16| log.0.contains(&Event::Write(MemoryAddress::Cell(cell)));
    assert!(written(392) && written(400), "the middle rows are written");
    assert!(!written(393), "cells that are not kept are not");
}

#[test]
fn an_observer_changes_nothing() {
    let mut policies: Vec<(&str, Vec<u8>)> = samples::all()
        .into_iter()
        .map(|(name, draft)| (name, draft.encode()))
        .collect();
    for mode in [RegisterMode::Stateful, RegisterMode::Stateless] {
        policies.push(("three teams", three_teams("cartpole", mode)));
    }
    for (name, bytes) in &policies {
        let policy = Policy::load(bytes).expect("a policy");
        let mut plain = TestAgent::new(policy).expect("small enough");
        let mut traced = plain.clone();
        for agent in [&mut plain, &mut traced] {
            agent.reset(Reset::Agent, 77);
        }
        let inputs = usize::from(policy.header().observation_len);
        for step in 0..50usize {
            let observation: Vec<f32> = (0..inputs)
                .map(|k| ((step * 7 + k * 13) % 19) as f32 / 6.0 - 1.5)
                .collect();
            let mut log = Log::default();
            let decision = format!("{:?}", plain.decide(&observation));
            let observed = format!("{:?}", traced.decide_traced(&observation, &mut log));
            assert_eq!(decision, observed, "{name}, step {step}");
            let bits = |agent: &TestAgent<'_>| -> Vec<u32> {
                agent.words().iter().map(|x| x.to_bits()).collect()
            };
            assert_eq!(bits(&plain), bits(&traced), "{name}, step {step}");
            assert!(!log.0.is_empty());
        }
    }
}
