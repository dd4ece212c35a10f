//! What an agent is asked and what it answers.

use core::fmt;

use crate::tables::ProgramId;

/// The action of one decision. Its values are within the policy's action range.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Action<'a> {
    /// Index of the chosen action of a discrete task, from 0.
    Discrete(u16),
    /// One value for each output of a continuous task, in the task's unit.
    Continuous(&'a [f32]),
}

/// One decision: the action and how it came about.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Decision<'a> {
    /// What the plant is to do.
    pub action: Action<'a>,
    /// The program that won at the last team. Where outputs have programs of their own: the highest bidder of all.
    pub winner: ProgramId,
    /// Instructions executed. A front end counts its multiplications.
    pub instructions: u32,
    /// Teams visited, at least 1.
    pub teams: u16,
}

/// What begins when an agent is reset. The policy's [`ResetScope`](crate::blob::ResetScope) decides what that clears.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Reset {
    /// The agent starts: its first episode of an evaluation.
    Agent,
    /// A further episode of the same agent.
    Episode,
}

/// What an agent forgets between two decisions of an experiment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Restore {
    /// The registers of its programs.
    Registers,
    /// The memory that programs share.
    Memory,
    /// Both.
    All,
}

/// The elements of an observation, with NaN where `missing` is true.
pub(crate) fn masked<'o>(
    observation: &'o [f32],
    missing: &'o [bool],
) -> Result<impl ExactSizeIterator<Item = f32> + Clone + 'o, ObservationError> {
    if observation.len() != missing.len() {
        return Err(ObservationError {
            needed: observation.len(),
            got: missing.len(),
        });
    }
    let pairs = observation.iter().zip(missing);
    Ok(pairs.map(|(x, missing)| if *missing { f32::NAN } else { *x }))
}

/// An observation, or the mask of one, of another length than is needed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ObservationError {
    /// Length that the policy expects, or that a mask needs.
    pub needed: usize,
    /// Length that was given.
    pub got: usize,
}

impl fmt::Display for ObservationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { needed, got } = self;
        write!(
            f,
            "observation or mask has {got} elements, the policy expects {needed}"
        )
    }
}

impl core::error::Error for ObservationError {}
