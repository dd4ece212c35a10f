//! One decision: visit teams and run their programs. It is bounded and cannot panic.
//!
//! [`crate::verify`] has checked every offset. Accesses go through `get` all the same: even a policy that a faulty
//! verifier let through can only compute a wrong number.

mod context;
mod elementwise;
mod rows;
mod scalars;
mod shared;
mod vectors;

use core::borrow::BorrowMut;

use crate::blob::RegisterMode;
use crate::math::{Mask, Word};
use crate::memory::IndexedStream;
use crate::rng::Pcg32;
use crate::tables::{Code, Program, ProgramId, ProgramRecord, Target, Team, TeamId, TeamRecord};
use crate::trace::Observer;
use crate::verify::Policy;

use context::Context;
pub(crate) use context::{fill_initial, lanes, reset_registers};
use scalars::{load, scalars};
use shared::shared;
use vectors::vectors;

/// A policy with the state of its agent, wherever that is kept, or with the states of several agents that run in lock-step.
/// `S` is an array or a slice of words.
pub struct Machine<'s, 'p, V: Word, S: ?Sized> {
    pub policy: &'s Policy<'p>,
    pub words: &'s mut S,
    /// The bid of every program that ran in this decision. NaN for the others; no bid is ever NaN.
    pub bids: &'s mut [V],
    /// The lanes that have visited each team in this decision.
    pub visited: &'s mut [V::Mask],
    /// Those of the first stream, one for each lane, and so on.
    pub streams: &'s mut [Pcg32],
    /// One for each lane.
    pub indexed: &'s mut [IndexedStream],
}

/// How decisions came about, with a number for each lane.
#[derive(Clone, Copy)]
pub struct Paths<V: Word> {
    /// The program that won at the last team.
    pub winner: <V::Mask as Mask>::Numbers,
    /// Instructions executed.
    pub instructions: <V::Mask as Mask>::Numbers,
    /// Teams visited.
    pub teams: <V::Mask as Mask>::Numbers,
}

impl<V: Word> Paths<V> {
    /// Before the first team.
    pub fn start() -> Self {
        Paths {
            winner: V::Mask::numbers(0),
            instructions: V::Mask::numbers(0),
            teams: V::Mask::numbers(0),
        }
    }

    /// The winner, the number of instructions and that of teams in a lane.
    #[inline(always)]
    pub fn of(&self, lane: usize) -> (ProgramId, u32, u16) {
        (
            ProgramId(number(&self.winner, lane) as u16),
            number(&self.instructions, lane),
            number(&self.teams, lane) as u16,
        )
    }
}

/// No team: the end of a lane's path.
const END: u32 = u32::MAX;

/// The operations that are compiled for one vector width, and that width. Firmware knows both when it is built.
#[derive(Clone, Copy)]
pub struct Vectors<V: Word> {
    pub run: for<'c> fn(&mut [V], V::Mask, Code<'c>) -> Code<'c>,
    pub width: usize,
}

impl<V: Word> Vectors<V> {
    /// Those of width `W`.
    #[inline(always)]
    pub const fn of<const W: usize>() -> Self {
        Vectors {
            run: vectors::<V, W>,
            width: W,
        }
    }
}

/// One decision in progress, of each lane.
pub struct Run<'m, 's, 'p, V: Word, S: ?Sized, O> {
    pub machine: &'m mut Machine<'s, 'p, V, S>,
    pub paths: Paths<V>,
    pub observer: O,
}

impl<V: Word, S: BorrowMut<[V]> + ?Sized, O: Observer> Run<'_, '_, '_, V, S, O> {
    /// Decides in the lanes of the mask; their observations lie in the window already.
    ///
    /// `vectors` is an argument all the way and no field, so that compilers see which function and width it is.
    #[inline(always)]
    pub fn decide(&mut self, vectors: Vectors<V>, deciding: V::Mask) {
        let policy = self.machine.policy;
        self.machine.bids.fill(V::splat(f32::NAN));
        self.machine.visited.fill(V::Mask::NONE);
        // The team that each lane comes to; of all lanes that have not reached the end of their paths, the first one's is visited.
        let mut next = V::Mask::numbers(END);
        deciding.put(&mut next, 0);
        // A lane visits a team at most once: programs that lead to visited teams take no part.
        for _ in 0..usize::from(policy.header.teams) * V::LANES {
            let Some(team) = next.as_ref().iter().find(|team| **team != END) else {
                break;
            };
            let team = *team;
            let here = V::Mask::having(&next, team);
            let (highest, winners) = self.visit(vectors, TeamId(team as u16), here);
            here.put(&mut next, END);
            let mut won = here.without(highest.test(f32::is_nan));
            // Lanes that have the same winner go on together.
            while let Some(lane) = lanes::<V>(won).next() {
                let number = number(&winners, lane);
                let alike = won.and(V::Mask::having(&winners, number));
                won = won.without(alike);
                let winner = ProgramId(number as u16);
                let target = policy.tables.program(winner).unwrap_or_default().target;
                alike.put(&mut self.paths.winner, number);
                self.observer.choose(winner, target);
                if let Target::Team(TeamId(team)) = target {
                    alike.put(&mut next, u32::from(team));
                }
            }
        }
    }

    /// Lets the programs of a team bid. Returns each lane's highest bid, NaN if there is none, and the program that made it.
    #[inline(always)]
    fn visit(
        &mut self,
        vectors: Vectors<V>,
        team_id: TeamId,
        here: V::Mask,
    ) -> (V, <V::Mask as Mask>::Numbers) {
        let policy = self.machine.policy;
        let (mut best, mut winners) = (V::splat(f32::NAN), V::Mask::numbers(0));
        let Some(team) = policy.tables.teams.get(usize::from(team_id.0)) else {
            return (best, winners);
        };
        if let Some(seen) = self.machine.visited.get_mut(usize::from(team_id.0)) {
            *seen = seen.or(here);
        }
        here.add(&mut self.paths.teams, 1);
        self.observer.enter(team_id);
        for program_id in policy.tables.members(&Team::from_bytes(team)) {
            let Some(program) = policy.tables.programs.get(usize::from(program_id.0)) else {
                continue;
            };
            let mut bidding = here;
            if let Target::Team(TeamId(next)) = Program::from_bytes(program).target {
                bidding = here.without(self.visited(next));
                if !bidding.any() {
                    self.observer.skip(program_id);
                    continue;
                }
            }
            let bid = self.bid(vectors, team, program_id, program, bidding);
            self.observer.bid(program_id, bid.lane(0));
            // Only a higher bid takes over: of equals the earlier program wins.
            let higher = bidding.and(bid.test2(best, |bid, best| bid > best || best.is_nan()));
            best = bid.select(higher, best);
            higher.put(&mut winners, u32::from(program_id.0));
        }
        (best, winners)
    }

    /// The lanes that have visited a team.
    #[inline(always)]
    fn visited(&self, team: u16) -> V::Mask {
        let visited = self.machine.visited.get(usize::from(team));
        visited.copied().unwrap_or(V::Mask::ALL)
    }

    /// The program's bids in this decision. It runs in those lanes of `bidding` in which no other team has run it.
    #[inline(always)]
    fn bid(
        &mut self,
        vectors: Vectors<V>,
        team: &TeamRecord,
        program_id: ProgramId,
        program: &ProgramRecord,
        bidding: V::Mask,
    ) -> V {
        let number = usize::from(program_id.0);
        let known = self.machine.bids.get(number).copied();
        let known = known.unwrap_or(V::splat(f32::NAN));
        let running = bidding.and(known.test(f32::is_nan));
        if !running.any() {
            return known;
        }
        let bid = self.run(vectors, team, program_id, program, running);
        let bid = bid.select(running, known);
        if let Some(place) = self.machine.bids.get_mut(number) {
            *place = bid;
        }
        bid
    }

    /// Runs the program and returns its bids.
    #[inline(always)]
    fn run(
        &mut self,
        vectors: Vectors<V>,
        team: &TeamRecord,
        program_id: ProgramId,
        record: &ProgramRecord,
        running: V::Mask,
    ) -> V {
        let policy = self.machine.policy;
        let program = Program::from_bytes(record);
        let words = &mut *self.machine.words;
        if policy.header.register_mode == RegisterMode::Stateless {
            reset_registers(policy, words.borrow_mut(), &program, running);
        }
        self.observer.run(program_id, program.code_len);
        running.add(&mut self.paths.instructions, program.code_len.into());
        let code = policy.tables.code(&program);
        let rest = scalars(policy, words, running, &mut self.observer, code);
        if !rest.is_empty() {
            self.run_on(vectors, team, record, running, rest);
        }
        load(self.machine.words.borrow_mut(), program.state_start)
    }

    /// Executes what is left of a program's code at the first instruction that is not scalar: stretches on vectors, on shared
    /// memory and on scalars in turn.
    ///
    /// On hosts this is a function of its own, so that the walk over programs of scalar instructions has few variables.
    #[cfg_attr(target_pointer_width = "64", inline(never))]
    #[cfg_attr(not(target_pointer_width = "64"), inline(always))]
    fn run_on(
        &mut self,
        vectors: Vectors<V>,
        team: &TeamRecord,
        program: &ProgramRecord,
        running: V::Mask,
        mut code: Code<'_>,
    ) {
        let Machine {
            policy,
            words,
            streams,
            indexed,
            ..
        } = &mut *self.machine;
        // Each turn executes at least one instruction, so this bounds the loop whatever the three functions do.
        for _ in 0..=code.len() {
            code = (vectors.run)((*words).borrow_mut(), running, code);
            if !code.is_empty() {
                let mut context = Context {
                    policy,
                    team,
                    program,
                    running,
                    streams,
                    indexed,
                    observer: &mut self.observer,
                };
                code = shared((*words).borrow_mut(), &mut context, vectors.width, code);
            }
            if !code.is_empty() {
                code = scalars(policy, *words, running, &mut self.observer, code);
            }
            if code.is_empty() {
                return;
            }
        }
    }
}

/// A lane's number.
#[inline(always)]
fn number(numbers: &impl AsRef<[u32]>, lane: usize) -> u32 {
    numbers.as_ref().get(lane).copied().unwrap_or(0)
}
