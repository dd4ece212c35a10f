//! What an observer of a decision is told. An observer cannot change the decision.

use crate::tables::{ProgramId, Section, Target, TeamId};

/// A place in the memory that programs share.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum MemoryAddress {
    /// A slot of the memory of the team that runs the program.
    Slot(Section, u16),
    /// A cell of indexed memory: row · 8 + column.
    Cell(u16),
}

/// Follows one decision, in the order of events.
///
/// Every method does nothing unless it is implemented. What happens between [`Observer::enter`] and the next belongs
/// to that team; memory accesses between [`Observer::run`] and [`Observer::bid`] belong to that program.
pub trait Observer {
    /// The decision comes to a team.
    fn enter(&mut self, team_id: TeamId) {
        let _ = team_id;
    }

    /// A program is skipped because it leads to a visited team.
    fn skip(&mut self, program_id: ProgramId) {
        let _ = program_id;
    }

    /// A program begins to run its instructions; all of them are executed.
    fn run(&mut self, program_id: ProgramId, instructions: u16) {
        let _ = (program_id, instructions);
    }

    /// The running program reads a place of shared memory, or a part of it.
    fn read(&mut self, address: MemoryAddress) {
        let _ = address;
    }

    /// The running program writes a place of shared memory. Writes to places that nobody reads are not made.
    fn write(&mut self, address: MemoryAddress) {
        let _ = address;
    }

    /// A program bids in the current team, after its run or with the bid of an earlier one.
    fn bid(&mut self, program_id: ProgramId, bid: f32) {
        let _ = (program_id, bid);
    }

    /// A program wins the current team; where outputs have programs of their own, the highest bidder of all.
    fn choose(&mut self, program_id: ProgramId, target: Target) {
        let _ = (program_id, target);
    }

    /// A program gives an output that has programs of its own; after all programs have bid, once for each output.
    fn give(&mut self, program_id: ProgramId, output: u16) {
        let _ = (program_id, output);
    }

    /// Room for what the front end's model predicts of an observation, [`FrontEnd::words`](crate::front_end::FrontEnd::words)
    /// of it. With less, nothing is predicted and [`Observer::predict`] is not called.
    ///
    /// The model runs for the observer then, also where nothing is missing. Its multiplications count for no decision.
    fn room(&mut self) -> &mut [f32] {
        &mut []
    }

    /// The model has predicted an element of the observation: by `change`, in standardised units. `residual` is what is
    /// perceived of it less what was predicted, `None` if the element is missing.
    ///
    /// Called for each element that the model predicts, in order, before the decision comes to a team.
    fn predict(&mut self, input: u16, change: f32, residual: Option<f32>) {
        let _ = (input, change, residual);
    }
}

/// An observer that ignores every event, at no cost.
impl Observer for () {}

#[cfg(feature = "trace")]
impl Observer for &mut dyn Observer {
    fn enter(&mut self, team_id: TeamId) {
        (**self).enter(team_id);
    }

    fn skip(&mut self, program_id: ProgramId) {
        (**self).skip(program_id);
    }

    fn run(&mut self, program_id: ProgramId, instructions: u16) {
        (**self).run(program_id, instructions);
    }

    fn read(&mut self, address: MemoryAddress) {
        (**self).read(address);
    }

    fn write(&mut self, address: MemoryAddress) {
        (**self).write(address);
    }

    fn bid(&mut self, program_id: ProgramId, bid: f32) {
        (**self).bid(program_id, bid);
    }

    fn choose(&mut self, program_id: ProgramId, target: Target) {
        (**self).choose(program_id, target);
    }

    fn give(&mut self, program_id: ProgramId, output: u16) {
        (**self).give(program_id, output);
    }

    fn room(&mut self) -> &mut [f32] {
        (**self).room()
    }

    fn predict(&mut self, input: u16, change: f32, residual: Option<f32>) {
        (**self).predict(input, change, residual);
    }
}
