//! A script of resets and observations, and the interpreter that follows it.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use tpg_runtime::isa::Op;
use tpg_runtime::tables::{Instruction, ProgramId};
use tpg_runtime::trace::Observer;
use tpg_runtime::{Action, HostAgent, Policy, Reset};
use tpg_tests::random::Dice;

/// One line of a script.
pub enum Event {
    Reset(Reset, u64),
    Observe(Vec<f32>),
    /// Print the shared memory.
    Memory,
    /// Overwrite the shared memory.
    SetMemory(Vec<f32>),
}

/// What the interpreter did.
pub struct Followed {
    /// What a compiled policy must print.
    pub lines: Vec<String>,
    /// Operations executed.
    pub ops: BTreeSet<Op>,
    /// Most teams of a decision.
    pub teams: u16,
    /// How often a program took no part.
    pub skips: usize,
}

/// Writes a policy's script and returns its events.
pub fn write_script(script: &mut String, number: usize, policy: &Policy<'_>) -> Vec<Event> {
    let mut dice = Dice::new(1000 + number as u64);
    let inputs = usize::from(policy.header().observation_len);
    let memory = HostAgent::new(*policy)
        .map(Box::new)
        .expect("room")
        .memory()
        .len();
    let mut events = Vec::new();
    for phase in 0..5 {
        events.extend(match phase {
            0 => None,
            1 => Some(Event::Reset(Reset::Agent, dice.bits())),
            4 => Some(Event::Reset(Reset::Agent, 1)),
            _ => Some(Event::Reset(Reset::Episode, dice.bits())),
        });
        if phase == 3 {
            events.push(Event::SetMemory(
                (0..memory).map(|_| dice.measurement()).collect(),
            ));
        }
        for step in 0..30 {
            let element = |dice: &mut Dice| match step % 7 {
                3 => 0.0,
                5 => f32::NAN,
                _ => dice.measurement(),
            };
            events.push(Event::Observe(
                (0..inputs).map(|_| element(&mut dice)).collect(),
            ));
            if step % 10 == 9 {
                events.push(Event::Memory);
            }
        }
    }
    let _ = writeln!(script, "P {number}");
    for event in &events {
        let _ = match event {
            Event::Reset(Reset::Agent, seed) => writeln!(script, "A {seed:x}"),
            Event::Reset(Reset::Episode, seed) => writeln!(script, "E {seed:x}"),
            Event::Observe(x) => writeln!(script, "D{}", words(x)),
            Event::Memory => writeln!(script, "M"),
            Event::SetMemory(x) => writeln!(script, "S{}", words(x)),
        };
    }
    events
}

/// Bits of floats, as eight hexadecimal digits each.
fn words(x: &[f32]) -> String {
    x.iter().fold(String::new(), |mut text, x| {
        let _ = write!(text, " {:08x}", x.to_bits());
        text
    })
}

#[derive(Default)]
struct Ran {
    programs: BTreeSet<u16>,
    skips: usize,
}

impl Observer for Ran {
    fn run(&mut self, ProgramId(program): ProgramId, _: u16) {
        self.programs.insert(program);
    }

    fn skip(&mut self, _: ProgramId) {
        self.skips += 1;
    }
}

/// The interpreter's answers to a script.
pub fn follow(policy: Policy<'_>, events: &[Event]) -> Followed {
    let mut agent = Box::new(HostAgent::new(policy).expect("room"));
    let (mut lines, mut most, mut ran) = (Vec::new(), 0, Ran::default());
    for event in events {
        match event {
            Event::Reset(what, seed) => agent.reset(*what, *seed),
            Event::Observe(x) => {
                let decision = agent.decide_traced(x, &mut ran).expect("the right length");
                let action = match decision.action {
                    Action::Discrete(action) => format!(" {action:08x}"),
                    Action::Continuous(values) => words(values),
                };
                most = most.max(decision.teams);
                let (ProgramId(winner), instructions, teams) =
                    (decision.winner, decision.instructions, decision.teams);
                lines.push(format!("D{action} | {winner} {instructions} {teams}"));
            }
            Event::Memory => lines.push(format!("M{}", words(agent.memory()))),
            Event::SetMemory(x) => agent.set_memory(x).expect("the right length"),
        }
    }
    let program = |number: &u16| policy.tables().program(ProgramId(*number));
    let code = ran
        .programs
        .iter()
        .filter_map(program)
        .flat_map(|p| policy.tables().code(&p));
    Followed {
        ops: code
            .filter_map(Instruction::from_bytes)
            .map(|i| i.op)
            .collect(),
        lines,
        teams: most,
        skips: ran.skips,
    }
}
