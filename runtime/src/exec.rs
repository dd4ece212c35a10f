//! One decision: visit teams and run their programs. It is bounded and cannot panic.
//!
//! [`crate::verify`] has checked every offset. Accesses go through `get` all the same: even a policy that a faulty
//! verifier let through can only compute a wrong number.

mod context;
mod elementwise;
mod rows;
mod scalars;
mod vectors;

use core::borrow::BorrowMut;

use crate::blob::RegisterMode;
use crate::memory::IndexedStream;
use crate::rng::Pcg32;
use crate::tables::{Code, Program, ProgramId, Target, Team, TeamId};
use crate::trace::Observer;
use crate::verify::Policy;

use context::Context;
pub(crate) use context::{fill_initial, reset_registers};
use scalars::{load, scalars};
pub use vectors::vectors;

/// A policy with the state of its agent, wherever that is kept. `S` is an array or a slice of words.
pub struct Machine<'s, 'p, S: ?Sized> {
    pub policy: &'s Policy<'p>,
    pub words: &'s mut S,
    /// The bid of every program that ran in this decision. NaN for the others; no bid is ever NaN.
    pub bids: &'s mut [f32],
    pub visited: &'s mut [bool],
    pub streams: &'s mut [Pcg32],
    pub indexed: &'s mut IndexedStream,
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
pub type Vectors<O> = for<'c> fn(&mut [f32], &mut Context<'_, O>, Code<'c>) -> Code<'c>;

/// One decision in progress.
pub struct Run<'m, 's, 'p, S: ?Sized, O> {
    pub machine: &'m mut Machine<'s, 'p, S>,
    pub observer: O,
}

impl<S: BorrowMut<[f32]> + ?Sized, O: Observer> Run<'_, '_, '_, S, O> {
    /// Decides; the observation lies in the window already.
    ///
    /// `vectors` is an argument all the way and no field, so that compilers see which function it is and call it directly.
    #[inline(always)]
    pub fn decide(&mut self, vectors: Vectors<O>) -> Path {
        let policy = self.machine.policy;
        self.machine.bids.fill(f32::NAN);
        self.machine.visited.fill(false);
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
            if let Some(seen) = self.machine.visited.get_mut(usize::from(team_id.0)) {
                *seen = true;
            }
            path.teams += 1;
            self.observer.enter(team_id);
            let mut best: Option<(f32, ProgramId, Target)> = None;
            for program_id in policy.tables.members(&team) {
                let Some(program) = policy.tables.program(program_id) else {
                    continue;
                };
                if let Target::Team(TeamId(next)) = program.target
                    && self.was_visited(next)
                {
                    self.observer.skip(program_id);
                    continue;
                }
                let (bid, instructions) = self.bid(vectors, &team, program_id, &program);
                path.instructions += instructions;
                self.observer.bid(program_id, bid);
                // Only a higher bid takes over: of equals the earlier program wins.
                if best.is_none_or(|(highest, ..)| bid > highest) {
                    best = Some((bid, program_id, program.target));
                }
            }
            let Some((_, winner, target)) = best else {
                break;
            };
            path.winner = winner;
            self.observer.choose(winner, target);
            match target {
                Target::Atomic(_) => break,
                Target::Team(next) => team_id = next,
            }
        }
        path
    }

    #[inline(always)]
    fn was_visited(&self, team: u16) -> bool {
        self.machine
            .visited
            .get(usize::from(team))
            .is_none_or(|visited| *visited)
    }

    /// The program's bid in this decision, and the instructions executed for it: none if another team has run it.
    #[inline(always)]
    fn bid(
        &mut self,
        vectors: Vectors<O>,
        team: &Team,
        program_id: ProgramId,
        program: &Program,
    ) -> (f32, u32) {
        let number = usize::from(program_id.0);
        if let Some(bid) = self.machine.bids.get(number)
            && !bid.is_nan()
        {
            return (*bid, 0);
        }
        let policy = self.machine.policy;
        if policy.header.register_mode == RegisterMode::Stateless {
            reset_registers(policy, self.machine.words.borrow_mut(), program);
        }
        self.observer.run(program_id, program.code_len);
        self.execute(vectors, team, program);
        let bid = load(self.machine.words.borrow_mut(), program.state_start);
        if let Some(place) = self.machine.bids.get_mut(number) {
            *place = bid;
        }
        (bid, u32::from(program.code_len))
    }

    /// Executes a program's code: stretches of scalar instructions and of all others in turn.
    #[inline(always)]
    fn execute(&mut self, vectors: Vectors<O>, team: &Team, program: &Program) {
        let Machine {
            policy,
            words,
            streams,
            indexed,
            ..
        } = &mut *self.machine;
        let mut code = policy.tables.code(program);
        // Each turn executes at least one instruction, so this bounds the loop whatever the two functions do.
        for _ in 0..=program.code_len {
            code = scalars(policy, *words, &mut self.observer, code);
            if code.is_empty() {
                return;
            }
            let mut context = Context {
                policy,
                team,
                program,
                streams,
                indexed,
                observer: &mut self.observer,
            };
            code = vectors((*words).borrow_mut(), &mut context, code);
        }
    }
}
