//! Checks that the header agrees with itself and with the lengths of the tables.

use super::error::VerifyError;
use crate::blob::{ActionKind, Header, MemoryModel, RegisterMode, ResetScope};
use crate::isa::Group;
use crate::parts::{Feature, Field};
use crate::tables::{Tables, Target};

/// Largest vector width that the interpreter supports.
pub const MAX_WIDTH: u16 = 32;
/// Most outputs of a continuous policy. Before version 3 it is the vector width.
pub const MAX_OUTPUTS: u16 = 256;
/// Largest number of state words: 65 535. Every offset must fit in 16 bits, including the offset just past the end.
pub const MAX_WORDS: u32 = u16::MAX as u32;

/// Most programs of a policy of version 3.
pub(super) const MAX_PROGRAMS: u16 = 2048;
/// Most teams of a policy of version 3.
const MAX_TEAMS: u16 = 512;
/// Most random streams of a policy of version 3: three for each team.
const MAX_STREAMS: u16 = 1536;

/// The length of a table as a `u32`, the type that errors use.
pub(super) fn count<T>(table: &[T]) -> u32 {
    u32::try_from(table.len()).unwrap_or(u32::MAX)
}

pub(super) fn require(field: Field, needed: u32, got: u32) -> Result<(), VerifyError> {
    if needed == got {
        Ok(())
    } else {
        Err(VerifyError::Header { field, needed, got })
    }
}

pub(super) fn at_most(field: Field, limit: u32, got: u32) -> Result<(), VerifyError> {
    if got <= limit {
        Ok(())
    } else {
        Err(VerifyError::Header {
            field,
            needed: limit,
            got,
        })
    }
}

/// Checks that this build has every part of the runtime that the policy needs.
fn check_features(header: &Header) -> Result<(), VerifyError> {
    let group = Group::ALL
        .iter()
        .find(|group| header.groups & group.bit() != 0 && !group.is_built());
    let missing = if let Some(group) = group {
        Some(group.feature())
    } else if !header.write_distribution.is_built() {
        Some(Feature::WriteDistributions)
    } else if header.front_end.is_some() && !cfg!(feature = "front-end") {
        Some(Feature::FrontEnd)
    } else if header.history > 1 && !cfg!(feature = "history") {
        Some(Feature::History)
    } else if !header.action_kind.is_built() {
        Some(Feature::ActionPrograms)
    } else {
        None
    };
    match missing {
        Some(feature) => Err(VerifyError::Unsupported { feature }),
        None => Ok(()),
    }
}

pub(super) fn check_header(header: &Header, tables: &Tables<'_>) -> Result<(), VerifyError> {
    check_features(header)?;
    require(
        Field::Programs,
        count(tables.programs),
        u32::from(header.programs),
    )?;
    require(Field::Teams, count(tables.teams), u32::from(header.teams))?;
    at_most(
        Field::Teams,
        u32::from(Target::MAX),
        u32::from(header.teams),
    )?;
    if header.has_missing_values() {
        at_most(
            Field::Programs,
            u32::from(MAX_PROGRAMS),
            u32::from(header.programs),
        )?;
        at_most(Field::Teams, u32::from(MAX_TEAMS), u32::from(header.teams))?;
        at_most(
            Field::Streams,
            u32::from(MAX_STREAMS),
            u32::from(header.streams),
        )?;
    }
    at_most(Field::Words, MAX_WORDS, header.words)?;
    at_most(Field::Width, u32::from(MAX_WIDTH), u32::from(header.width))?;
    let counts = [
        (Field::Width, header.width),
        (Field::Observation, header.observation_len),
        (Field::Actions, header.actions),
        (Field::Teams, header.teams),
    ];
    for (field, count) in counts {
        if count == 0 {
            return Err(VerifyError::Header {
                field,
                needed: 1,
                got: 0,
            });
        }
    }
    if usize::from(header.window) < header.observed() {
        return Err(VerifyError::Header {
            field: Field::Window,
            needed: u32::try_from(header.observed()).unwrap_or(u32::MAX),
            got: u32::from(header.window),
        });
    }
    if header.action_kind != ActionKind::Discrete {
        let (low, high) = (header.action_low, header.action_high);
        let negative_zero = |x: f32| x.to_bits() == 1 << 31;
        let two_zeros = negative_zero(low) || negative_zero(high);
        if !(low.is_finite() && high.is_finite() && low <= high)
            || (two_zeros && header.has_missing_values())
        {
            return Err(VerifyError::ActionRange);
        }
        let most = if header.has_missing_values() {
            MAX_OUTPUTS
        } else {
            header.width
        };
        at_most(Field::Actions, u32::from(most), u32::from(header.actions))?;
        if header.action_kind == ActionKind::Each {
            require(Field::Teams, 1, u32::from(header.teams))?;
            // A policy with one output is stored as `Continuous`. The format allows only one encoding of a policy.
            if header.actions < 2 {
                return Err(VerifyError::Header {
                    field: Field::Actions,
                    needed: 2,
                    got: u32::from(header.actions),
                });
            }
        }
    } else {
        at_most(
            Field::Actions,
            u32::from(Target::MAX) + 1,
            u32::from(header.actions),
        )?;
        // A discrete policy has no range. Unused fields must be zero, so that a policy has only one encoding.
        if header.action_low.to_bits() != 0 || header.action_high.to_bits() != 0 {
            return Err(VerifyError::ActionRange);
        }
    }
    // The scope is `EveryDecision` if and only if neither registers nor memory keep values between decisions.
    let stateless =
        header.register_mode == RegisterMode::Stateless && header.memory_model == MemoryModel::None;
    if stateless != (header.reset_scope == ResetScope::EveryDecision) {
        return Err(VerifyError::Header {
            field: Field::ResetScope,
            needed: if stateless {
                ResetScope::EveryDecision as u32
            } else {
                ResetScope::PerEpisode as u32
            },
            got: header.reset_scope as u32,
        });
    }
    if header.memory_model != MemoryModel::Indexed {
        require(Field::Cells, 0, count(tables.cells))?;
    }
    Ok(())
}
