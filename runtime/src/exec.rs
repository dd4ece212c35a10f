//! One decision: walk the teams, run their programs. Bounded, cannot panic.
//!
//! Every offset was checked by [`crate::verify`]; accesses go through `get`, so that even a policy
//! built by a faulty verifier could only compute a wrong number.

mod elementwise;
mod rows;
mod scalars;
mod shared;
mod vectors;

use core::borrow::BorrowMut;

use crate::blob::{InitialValues, RegisterMode};
use crate::memory::IndexedStream;
use crate::rng::Pcg32;
use crate::tables::{Instruction, Program, ProgramId, Target, Team, TeamId};
use crate::trace::Observer;
use crate::verify::Policy;

use scalars::{load, scalars};
pub use vectors::vectors;

/// Instructions as stored.
type Code<'c> = &'c [[u8; Instruction::BYTES]];

/// The changing state of an agent, wherever it is kept: `S` is an array or a slice of words.
pub struct Machine<'s, S: ?Sized, O> {
    pub words: &'s mut S,
    /// Bid of every program that ran in this decision, else NaN, which no bid ever is.
    pub bids: &'s mut [f32],
    pub visited: &'s mut [bool],
    pub streams: &'s mut [Pcg32],
    pub indexed: &'s mut IndexedStream,
    pub observer: O,
}

/// What instructions reach beyond the words.
pub struct Shared<'m, O> {
    streams: &'m mut [Pcg32],
    indexed: &'m mut IndexedStream,
    observer: &'m mut O,
}

/// How a decision came about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Path {
    /// The program that won at the last team.
    pub winner: ProgramId,
    /// Instructions executed.
    pub instructions: u32,
    /// Teams visited.
    pub teams: u16,
}

/// [`vectors`] of one vector width.
pub type Vectors<O> =
    for<'c> fn(&Policy<'_>, &mut [f32], &mut Shared<'_, O>, &Team, &Program, Code<'c>) -> Code<'c>;

/// Runs one decision; the observation lies in the window already.
#[inline(always)]
pub fn decide<S: BorrowMut<[f32]> + ?Sized, O: Observer>(
    policy: &Policy<'_>,
    machine: &mut Machine<'_, S, O>,
    vectors: Vectors<O>,
) -> Path {
    machine.bids.fill(f32::NAN);
    machine.visited.fill(false);
    let mut path = Path {
        winner: ProgramId(0),
        instructions: 0,
        teams: 0,
    };
    let mut team_id = TeamId(0);
    // A team is visited at most once: its programs that lead to visited teams take no part.
    for _ in 0..policy.header.teams {
        let Some(team) = policy.tables.team(team_id) else {
            break;
        };
        if let Some(seen) = machine.visited.get_mut(usize::from(team_id.0)) {
            *seen = true;
        }
        path.teams += 1;
        machine.observer.enter(team_id);
        let mut best: Option<(f32, ProgramId, Target)> = None;
        for program_id in policy.tables.members(&team) {
            let Some(program) = policy.tables.program(program_id) else {
                continue;
            };
            if let Target::Team(TeamId(next)) = program.target
                && machine.visited.get(usize::from(next)).is_none_or(|v| *v)
            {
                machine.observer.skip(program_id);
                continue;
            }
            let bid = bid(
                policy, machine, vectors, &team, program_id, &program, &mut path,
            );
            machine.observer.bid(program_id, bid);
            // Only a higher bid takes over: of equals the earlier program wins.
            if best.is_none_or(|(highest, ..)| bid > highest) {
                best = Some((bid, program_id, program.target));
            }
        }
        let Some((_, winner, target)) = best else {
            break;
        };
        path.winner = winner;
        machine.observer.choose(winner, target);
        match target {
            Target::Atomic(_) => break,
            Target::Team(next) => team_id = next,
        }
    }
    path
}

/// The program's bid in this decision; runs it unless another visited team has.
#[inline(always)]
fn bid<S: BorrowMut<[f32]> + ?Sized, O: Observer>(
    policy: &Policy<'_>,
    machine: &mut Machine<'_, S, O>,
    vectors: Vectors<O>,
    team: &Team,
    program_id: ProgramId,
    program: &Program,
    path: &mut Path,
) -> f32 {
    let slot = usize::from(program_id.0);
    if let Some(bid) = machine.bids.get(slot)
        && !bid.is_nan()
    {
        return *bid;
    }
    if policy.header.register_mode == RegisterMode::Stateless {
        reset_registers(policy, machine.words.borrow_mut(), program);
    }
    machine.observer.run(program_id, program.code_len);
    run(policy, machine, vectors, team, program);
    path.instructions += u32::from(program.code_len);
    let bid = load(machine.words.borrow_mut(), program.state_start);
    if let Some(place) = machine.bids.get_mut(slot) {
        *place = bid;
    }
    bid
}

/// Sets a program's registers to their initial values.
#[inline(always)]
pub(crate) fn reset_registers(policy: &Policy<'_>, words: &mut [f32], program: &Program) {
    let len = program.register_words(usize::from(policy.header.width));
    fill_initial(
        policy,
        words,
        program.state_start,
        program.constants_start,
        len,
    );
}

/// Sets `len` words at `start` to the constants from `constants_start` on, or to zero if there are none.
pub(crate) fn fill_initial(
    policy: &Policy<'_>,
    words: &mut [f32],
    start: u16,
    constants_start: u32,
    len: usize,
) {
    let Some(place) = words
        .get_mut(usize::from(start)..)
        .and_then(|rest| rest.get_mut(..len))
    else {
        return;
    };
    match policy.header.initial_values {
        InitialValues::Zero => place.fill(0.0),
        InitialValues::Evolved => {
            let constants = policy.tables.constants.get(constants_start as usize..);
            for (word, bytes) in place.iter_mut().zip(constants.unwrap_or_default()) {
                *word = f32::from_le_bytes(*bytes);
            }
        }
    }
}

/// Runs a program's code: stretches of scalar instructions and of all others in turn.
#[inline(always)]
fn run<S: BorrowMut<[f32]> + ?Sized, O: Observer>(
    policy: &Policy<'_>,
    machine: &mut Machine<'_, S, O>,
    vectors: Vectors<O>,
    team: &Team,
    program: &Program,
) {
    let mut code = policy.tables.code(program);
    // Each turn executes an instruction at least, so this bounds the loop whatever the two functions do.
    for _ in 0..=program.code_len {
        code = scalars(policy, machine.words, &mut machine.observer, code);
        if code.is_empty() {
            return;
        }
        let mut shared = Shared {
            streams: &mut *machine.streams,
            indexed: &mut *machine.indexed,
            observer: &mut machine.observer,
        };
        let words = machine.words.borrow_mut();
        code = vectors(policy, words, &mut shared, team, program, code);
    }
}
