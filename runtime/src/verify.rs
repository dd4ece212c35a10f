//! Verifies a decoded blob. The interpreter executes only policies that have passed these checks.

mod duplicates;
mod error;
mod header;
mod labels;
mod programs;
mod ranges;
mod teams;

use crate::blob::{Blob, Header, Missing, RegisterMode, default_range};
use crate::front_end::FrontEnd;
use crate::parts::{Field, Table};
use crate::registers::{Location, RegisterMap};
use crate::tables::{Instruction, Program, Range, Tables};

pub use error::VerifyError;
pub use header::{MAX_OUTPUTS, MAX_WIDTH, MAX_WORDS};

use duplicates::check_duplicates;
use header::{check_header, count, require};
use labels::{check_labels, check_texts, labels};
use programs::check_programs;
use ranges::check_ranges;
use teams::{check_members, check_memory};

/// Upper bounds of the cost of one decision.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Bounds {
    /// Number of instructions. Every program runs at most once. Each multiplication of a front end counts as one
    /// instruction.
    pub instructions: u32,
    /// Number of single-precision operations, weighted by the [cost classes](crate::isa::Cost).
    ///
    /// The walk over members, the window, and the registers that are reset count too, so that this number covers all
    /// work that grows with the policy.
    pub weighted_operations: u64,
    /// Number of members looked at: the length of all member lists together.
    pub members: u32,
    /// Number of teams visited.
    pub teams: u16,
}

/// A policy that has passed every check. Only such a policy can be executed.
#[derive(Debug, Clone, Copy)]
pub struct Policy<'a> {
    pub(crate) header: Header,
    pub(crate) tables: Tables<'a>,
    pub(crate) memory_start: usize,
    bounds: Bounds,
}

impl<'a> Policy<'a> {
    /// Decodes and verifies the bytes of a blob.
    ///
    /// # Errors
    /// Any [`VerifyError`].
    pub fn load(bytes: &'a [u8]) -> Result<Self, VerifyError> {
        Self::verify(&Blob::decode(bytes)?)
    }

    /// Checks the header and every table of a blob. A decision can then rely on them and need not check them again.
    ///
    /// Allocates no memory. Each table is read at most five times, with one exception: the members are read twice, and
    /// once more for each 128 programs, if programs read team memory.
    ///
    /// # Errors
    /// Any [`VerifyError`] except [`VerifyError::Decode`].
    // Its frame holds tables that a firmware's `main`, into which this could be inlined, would keep for good.
    #[inline(never)]
    pub fn verify(blob: &Blob<'a>) -> Result<Self, VerifyError> {
        let (header, tables) = (*blob.header(), *blob.tables());
        check_header(&header, &tables)?;
        finite(tables.constants, Table::Constants)?;
        finite(tables.memory, Table::Memory)?;
        check_front_end(&header, &tables)?;
        let memory_start = check_programs(&header, &tables)?;
        let words = check_memory(&header, &tables, memory_start)?;
        require(Field::Words, words, header.words)?;
        require(Field::Groups, groups(&tables), u32::from(header.groups))?;
        check_members(&header, &tables)?;
        if header.has_missing_values() {
            check_duplicates(&tables)?;
        }
        let bounds = bounds(&header, &tables);
        if !tables.memory.is_empty() {
            let kept = words - (memory_start as u32);
            require(Field::MemoryImage, kept, count(tables.memory))?;
        }
        check_labels(&header, &tables)?;
        check_ranges(&header, &tables)?;
        if header.has_missing_values() {
            check_texts(&tables)?;
            let (stored, computed) = (header.contract, blob.contract());
            if stored != computed {
                return Err(VerifyError::Contract { stored, computed });
            }
        }
        Ok(Policy {
            header,
            tables,
            memory_start,
            bounds,
        })
    }

    /// The header.
    #[must_use]
    pub const fn header(&self) -> &Header {
        &self.header
    }

    /// The tables.
    #[must_use]
    pub const fn tables(&self) -> &Tables<'a> {
        &self.tables
    }

    /// Upper bounds of the cost of one decision.
    #[must_use]
    pub const fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    /// The front end, which processes observations before programs read them. `None` if the policy has no front end.
    #[must_use]
    #[inline]
    pub fn front_end(&self) -> Option<FrontEnd<'a>> {
        match self.tables.front_end {
            [] => None,
            section => FrontEnd::view(section, &self.header),
        }
    }

    /// The register or the word of the observation window that an instruction of `program` refers to.
    ///
    /// `at` is a field of the instruction, or [`Program::output`]. Returns `None` for all other state words, such as
    /// cells of indexed memory.
    #[must_use]
    pub fn locate(&self, program: &Program, at: u16) -> Option<Location> {
        RegisterMap::of(&self.header, program).locate(usize::from(at))
    }

    /// The hash of the contract that plant and policy must agree on, for every version of the format.
    #[must_use]
    pub fn contract(&self) -> u64 {
        crate::blob::contract(&self.header, self.tables.labels, self.tables.ranges)
    }

    /// Index of the first state word of the kept cells of indexed memory. The cells follow the teams' memory.
    pub(crate) const fn cells_start(&self) -> usize {
        (self.header.words as usize).saturating_sub(self.tables.cells.len())
    }

    /// Name and unit of every element of the observation, in order.
    pub fn inputs(&self) -> impl Iterator<Item = (&'a str, &'a str)> + use<'a> {
        let inputs = usize::from(self.header.observation_len);
        labels(self.tables.labels).take(inputs)
    }

    /// Name and unit of every continuous output, in order. Empty for a discrete policy.
    pub fn outputs(&self) -> impl Iterator<Item = (&'a str, &'a str)> + use<'a> {
        let inputs = usize::from(self.header.observation_len);
        labels(self.tables.labels).skip(inputs)
    }

    /// The range of every element of the observation, in order: for information, nothing holds an observation to it.
    pub fn input_ranges(&self) -> impl Iterator<Item = Range> + use<'a> {
        let (header, ranges) = (self.header, self.tables.ranges);
        (0..usize::from(header.observation_len)).map(move |k| range(&header, ranges, k))
    }

    /// The range of every continuous output, in order, to which it is clamped. Empty for a discrete policy.
    pub fn output_ranges(&self) -> impl Iterator<Item = Range> + use<'a> {
        let (header, ranges) = (self.header, self.tables.ranges);
        let inputs = usize::from(header.observation_len);
        (0..header.outputs()).map(move |k| range(&header, ranges, inputs + k))
    }

    /// The ranges of the outputs, to which they are clamped.
    #[inline(always)]
    pub(crate) fn limits(&self) -> Limits<'a> {
        let header = &self.header;
        let inputs = usize::from(header.observation_len);
        Limits {
            common: Range {
                low: header.action_low,
                high: header.action_high,
            },
            own: self.tables.ranges.get(inputs..).unwrap_or_default(),
        }
    }
}

/// The ranges of a policy's outputs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits<'a> {
    common: Range,
    /// Of each output; empty if all have the common one.
    own: &'a [[u8; Range::BYTES]],
}

impl Limits<'_> {
    /// The range of output `k`.
    #[inline(always)]
    pub(crate) fn of(&self, k: usize) -> Range {
        self.own.get(k).map_or(self.common, Range::from_bytes)
    }
}

/// The range of channel `k`.
fn range(header: &Header, ranges: &[[u8; Range::BYTES]], k: usize) -> Range {
    ranges
        .get(k)
        .map_or_else(|| default_range(header, k), Range::from_bytes)
}

/// Checks the front end. The header must say that there is one if and only if the section is not empty.
fn check_front_end(header: &Header, tables: &Tables<'_>) -> Result<(), VerifyError> {
    let words = match tables.front_end {
        [] => None,
        // `check_header` has already refused headers with a front end, so the header has none here.
        _ if cfg!(not(feature = "front-end")) => return Err(VerifyError::FrontEndMalformed),
        section => {
            let front_end =
                FrontEnd::read(section, header).ok_or(VerifyError::FrontEndMalformed)?;
            Some(front_end.words(header) as u32)
        }
    };
    if header.has_missing_values() {
        // The header says what stands for a missing element, and so whether there is a section.
        let said = match tables.front_end {
            [] => Some(Missing::Zero),
            [kind, ..] => Missing::of_section(*kind),
        };
        if said != Some(header.missing) {
            return Err(VerifyError::FrontEndMalformed);
        }
    }
    let announced = header.front_end.map(u32::from);
    if words.is_some() != announced.is_some() {
        return Err(VerifyError::FrontEndMalformed);
    }
    require(
        Field::FrontEndWords,
        words.unwrap_or(0),
        announced.unwrap_or(0),
    )
}

fn finite(words: &[[u8; 4]], table: Table) -> Result<(), VerifyError> {
    match words
        .iter()
        .position(|w| !f32::from_le_bytes(*w).is_finite())
    {
        Some(index) => Err(VerifyError::NotFinite {
            table,
            index: u32::try_from(index).unwrap_or(u32::MAX),
        }),
        None => Ok(()),
    }
}

/// Computes the bounds. Every program runs at most once in a decision, so the sum over all programs is an upper bound.
fn bounds(header: &Header, tables: &Tables<'_>) -> Bounds {
    let cells = tables.cells.len() as u16;
    let weight = |bytes: &[u8; Instruction::BYTES]| {
        let weight = |i: Instruction| i.op.cost().weight(header.width, cells);
        match Instruction::from_bytes(bytes).map_or(0, weight) {
            // A write to indexed memory of which no cell is kept. It still counts the write.
            0 => 8,
            weight => weight,
        }
    };
    let front_end = match tables.front_end {
        _ if cfg!(not(feature = "front-end")) => None,
        section => FrontEnd::view(section, header),
    };
    let (multiplications, operations) = front_end.map_or((0, 0), |front_end| {
        (
            front_end.instructions(header),
            front_end.weighted_operations(header),
        )
    });
    Bounds {
        instructions: count(tables.code).saturating_add(multiplications),
        weighted_operations: tables.code.iter().map(weight).sum::<u64>()
            + operations
            + walk(header, tables),
        members: count(tables.members),
        teams: header.teams,
    }
}

/// Weighted operations of a decision besides its instructions: for visits and runs, members, window, outputs and registers
/// that are reset.
fn walk(header: &Header, tables: &Tables<'_>) -> u64 {
    let registers = |bytes: &[u8; Program::BYTES]| {
        let program = Program::from_bytes(bytes);
        program.register_words(usize::from(header.width)) as u64
    };
    let reset = match header.register_mode {
        RegisterMode::Stateless => tables.programs.iter().map(registers).sum(),
        RegisterMode::Stateful => 0,
    };
    u64::from(count(tables.members)) * header.action_kind.weight_of_member()
        + 8 * (u64::from(header.programs) + u64::from(header.teams))
        + u64::from(header.window)
        + (header.observed() as u64).saturating_sub(u64::from(header.observation_len))
        + 2 * header.outputs() as u64
        + reset
}

/// The instruction groups that the code uses, one bit each.
fn groups(tables: &Tables<'_>) -> u32 {
    let bits = |bytes: &[u8; Instruction::BYTES]| {
        Instruction::from_bytes(bytes).map_or(0, |i| u32::from(i.op.group().bit()))
    };
    tables
        .code
        .iter()
        .fold(0, |groups, code| groups | bits(code))
}
