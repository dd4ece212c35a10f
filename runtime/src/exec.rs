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
use crate::math::{Mask, Word};
use crate::memory::IndexedStream;
use crate::rng::Pcg32;
use crate::tables::{Code, Program, ProgramId, Target, Team, TeamId};
use crate::trace::Observer;
use crate::verify::Policy;

use context::Context;
pub(crate) use context::{fill_initial, lanes, reset_registers};
use scalars::{load, scalars};
pub use vectors::vectors;

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

impl Path {
    /// Before the first team.
    pub const START: Self = Path {
        winner: ProgramId(0),
        instructions: 0,
        teams: 0,
    };
}

/// [`vectors`] of one vector width.
pub type Vectors<V, O> = for<'c> fn(&mut [V], &mut Context<'_, V, O>, Code<'c>) -> Code<'c>;

/// One decision in progress, of each lane.
pub struct Run<'m, 's, 'p, V: Word, S: ?Sized, O> {
    pub machine: &'m mut Machine<'s, 'p, V, S>,
    pub paths: V::Each<Path>,
    pub observer: O,
}

impl<V: Word, S: BorrowMut<[V]> + ?Sized, O: Observer> Run<'_, '_, '_, V, S, O> {
    /// Decides in the lanes of the mask; their observations lie in the window already.
    ///
    /// `vectors` is an argument all the way and no field, so that compilers see which function it is and call it directly.
    #[inline(always)]
    pub fn decide(&mut self, vectors: Vectors<V, O>, deciding: V::Mask) {
        let policy = self.machine.policy;
        self.machine.bids.fill(V::splat(f32::NAN));
        self.machine.visited.fill(V::Mask::NONE);
        // The team that each lane comes to, `None` at the end of its path.
        let mut next = V::each(None);
        for lane in lanes::<V>(deciding) {
            put(&mut next, lane, Some(TeamId(0)));
        }
        // A lane visits a team at most once: programs that lead to visited teams take no part.
        for _ in 0..usize::from(policy.header.teams) * V::LANES {
            let Some(team_id) = next.as_ref().iter().find_map(|team| *team) else {
                break;
            };
            let here = V::Mask::of(|lane| next.as_ref().get(lane) == Some(&Some(team_id)));
            let (bids, winners) = self.visit(vectors, team_id, here);
            for lane in lanes::<V>(here) {
                let winner = winners.as_ref().get(lane).copied().unwrap_or_default();
                let program = match bids.lane(lane).is_nan() {
                    // No program could bid.
                    true => None,
                    false => policy.tables.program(winner),
                };
                let target = program.map(|program| program.target);
                if let (Some(target), Some(path)) = (target, self.paths.as_mut().get_mut(lane)) {
                    path.winner = winner;
                    self.observer.choose(winner, target);
                }
                let team = match target {
                    Some(Target::Team(team)) => Some(team),
                    _ => None,
                };
                put(&mut next, lane, team);
            }
        }
    }

    /// Lets the programs of a team bid. Returns each lane's highest bid, NaN if there is none, and the program that made it.
    #[inline(always)]
    fn visit(
        &mut self,
        vectors: Vectors<V, O>,
        team_id: TeamId,
        here: V::Mask,
    ) -> (V, V::Each<ProgramId>) {
        let policy = self.machine.policy;
        let (mut best, mut winners) = (V::splat(f32::NAN), V::each(ProgramId(0)));
        let Some(team) = policy.tables.team(team_id) else {
            return (best, winners);
        };
        if let Some(seen) = self.machine.visited.get_mut(usize::from(team_id.0)) {
            *seen = seen.or(here);
        }
        for lane in lanes::<V>(here) {
            if let Some(path) = self.paths.as_mut().get_mut(lane) {
                path.teams += 1;
            }
        }
        self.observer.enter(team_id);
        for program_id in policy.tables.members(&team) {
            let Some(program) = policy.tables.program(program_id) else {
                continue;
            };
            let mut bidding = here;
            if let Target::Team(TeamId(next)) = program.target {
                bidding = here.without(self.visited(next));
                if !bidding.any() {
                    self.observer.skip(program_id);
                    continue;
                }
            }
            let bid = self.bid(vectors, &team, program_id, &program, bidding);
            self.observer.bid(program_id, bid.lane(0));
            // Only a higher bid takes over: of equals the earlier program wins.
            let higher = bidding.and(bid.test2(best, |bid, best| bid > best || best.is_nan()));
            best = bid.select(higher, best);
            for lane in lanes::<V>(higher) {
                put(&mut winners, lane, program_id);
            }
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
        vectors: Vectors<V, O>,
        team: &Team,
        program_id: ProgramId,
        program: &Program,
        bidding: V::Mask,
    ) -> V {
        let number = usize::from(program_id.0);
        let known = self.machine.bids.get(number).copied();
        let known = known.unwrap_or(V::splat(f32::NAN));
        let running = bidding.and(known.test(f32::is_nan));
        if !running.any() {
            return known;
        }
        let policy = self.machine.policy;
        if policy.header.register_mode == RegisterMode::Stateless {
            reset_registers(policy, self.machine.words.borrow_mut(), program, running);
        }
        self.observer.run(program_id, program.code_len);
        self.execute(vectors, team, program, running);
        let bid = load(self.machine.words.borrow_mut(), program.state_start);
        let bid = bid.select(running, known);
        if let Some(place) = self.machine.bids.get_mut(number) {
            *place = bid;
        }
        for lane in lanes::<V>(running) {
            if let Some(path) = self.paths.as_mut().get_mut(lane) {
                path.instructions += u32::from(program.code_len);
            }
        }
        bid
    }

    /// Executes a program's code: stretches of scalar instructions and of all others in turn.
    #[inline(always)]
    fn execute(
        &mut self,
        vectors: Vectors<V, O>,
        team: &Team,
        program: &Program,
        running: V::Mask,
    ) {
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
            code = scalars(policy, *words, running, &mut self.observer, code);
            if code.is_empty() {
                return;
            }
            let mut context = Context {
                policy,
                team,
                program,
                running,
                streams,
                indexed,
                observer: &mut self.observer,
            };
            code = vectors((*words).borrow_mut(), &mut context, code);
        }
    }
}

/// Sets a lane's value.
#[inline(always)]
fn put<T: Copy>(each: &mut impl AsMut<[T]>, lane: usize, value: T) {
    if let Some(place) = each.as_mut().get_mut(lane) {
        *place = value;
    }
}
