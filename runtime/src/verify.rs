//! View to verified policy: nothing in a blob is trusted before it has passed here.

mod error;
mod header;
mod programs;
mod teams;

use crate::blob::{Blob, Header};
use crate::front_end::FrontEnd;
use crate::registers::{Location, RegisterMap};
use crate::tables::{Instruction, Program, Tables};

pub use error::VerifyError;
pub use header::{MAX_WIDTH, MAX_WORDS};

use header::{check_header, count, require};
use programs::check_programs;
use teams::{check_members, check_memory};

/// What one decision can cost at most.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Bounds {
    /// Instructions executed: every program runs at most once; a front end counts its multiplications.
    pub instructions: u32,
    /// Single-precision operations, weighted by the [cost classes](crate::isa::Cost).
    pub weighted_operations: u64,
    /// Teams visited.
    pub teams: u16,
}

/// A policy that has passed every check; only this can decide.
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

    /// Checks every table of a blob, so that deciding needs no check that can fail.
    ///
    /// Takes no memory, and time linear in the tables but for this: each team looks through the code of each member.
    ///
    /// # Errors
    /// Any [`VerifyError`] but [`VerifyError::Decode`].
    pub fn verify(blob: &Blob<'a>) -> Result<Self, VerifyError> {
        let (header, tables) = (*blob.header(), *blob.tables());
        check_header(&header, &tables)?;
        finite(tables.constants, "constants")?;
        finite(tables.memory, "memory")?;
        check_front_end(&header, &tables)?;
        let memory_start = check_programs(&header, &tables)?;
        let words = check_memory(&header, &tables, memory_start)?;
        require("words", words, header.words)?;
        require("groups", groups(&tables), u32::from(header.groups))?;
        check_members(&header, &tables)?;
        let bounds = bounds(&header, &tables);
        if !tables.memory.is_empty() {
            let kept = words - (memory_start as u32);
            require("memory image words", kept, count(tables.memory))?;
        }
        let labels = usize::from(header.observation_len) + header.outputs();
        let mut lines = lines(tables.labels);
        if lines.clone().count() != labels || !lines.all(is_label) {
            return Err(VerifyError::Labels);
        }
        Ok(Policy {
            header,
            tables,
            memory_start,
            bounds,
        })
    }

    /// What the header says.
    #[must_use]
    pub const fn header(&self) -> &Header {
        &self.header
    }

    /// The tables.
    #[must_use]
    pub const fn tables(&self) -> &Tables<'a> {
        &self.tables
    }

    /// What one decision can cost at most.
    #[must_use]
    pub const fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    /// What happens to observations before programs see them; `None` where they see them as they are.
    #[must_use]
    #[inline]
    pub fn front_end(&self) -> Option<FrontEnd<'a>> {
        match self.tables.front_end {
            [] => None,
            section => FrontEnd::view(section, &self.header),
        }
    }

    /// Where an operand of an instruction of `program` lies, if it is a register or in the observation window.
    ///
    /// `at` is a field of the instruction, or [`Program::output`]. `None` for state words that the program does not reach
    /// this way, such as cells of indexed memory.
    #[must_use]
    pub fn locate(&self, program: &Program, at: u16) -> Option<Location> {
        RegisterMap::of(&self.header, program).locate(usize::from(at))
    }

    /// First state word of the kept cells of indexed memory: behind the teams' memory.
    pub(crate) const fn cells_start(&self) -> usize {
        (self.header.words as usize).saturating_sub(self.tables.cells.len())
    }

    /// Name and unit of every input, in order.
    pub fn inputs(&self) -> impl Iterator<Item = (&'a str, &'a str)> + use<'a> {
        let inputs = usize::from(self.header.observation_len);
        labels(self.tables.labels).take(inputs)
    }

    /// Name and unit of every continuous output, in order.
    pub fn outputs(&self) -> impl Iterator<Item = (&'a str, &'a str)> + use<'a> {
        let inputs = usize::from(self.header.observation_len);
        labels(self.tables.labels).skip(inputs)
    }
}

/// Checks that a front end is announced exactly where there is one, and that it is sound.
fn check_front_end(header: &Header, tables: &Tables<'_>) -> Result<(), VerifyError> {
    let words = match tables.front_end {
        [] => None,
        // The header's check has refused what announces one.
        _ if cfg!(not(feature = "front-end")) => return Err(VerifyError::FrontEndMalformed),
        section => {
            let front_end =
                FrontEnd::read(section, header).ok_or(VerifyError::FrontEndMalformed)?;
            Some(front_end.words(header) as u32)
        }
    };
    let announced = header.front_end.map(u32::from);
    if words.is_some() != announced.is_some() {
        return Err(VerifyError::FrontEndMalformed);
    }
    require(
        "front-end words",
        words.unwrap_or(0),
        announced.unwrap_or(0),
    )
}

fn labels(text: &str) -> impl Iterator<Item = (&str, &str)> {
    lines(text).map(|line| line.split_once('\t').unwrap_or_default())
}

/// The lines of a text; unlike `str::lines`, without a way into a panic that the compiler cannot rule out.
fn lines(mut text: &str) -> impl Iterator<Item = &str> + Clone {
    core::iter::from_fn(move || {
        let (line, rest) = text.split_once('\n').unwrap_or((text, ""));
        let more = !text.is_empty();
        text = rest;
        more.then_some(line)
    })
}

fn is_label(line: &str) -> bool {
    line.matches('\t').count() == 1 && !line.starts_with('\t')
}

fn finite(words: &[[u8; 4]], table: &'static str) -> Result<(), VerifyError> {
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

/// Every program runs at most once in a decision, so the sum over all of them is a bound.
fn bounds(header: &Header, tables: &Tables<'_>) -> Bounds {
    let cells = tables.cells.len() as u16;
    let weight = |bytes: &[u8; Instruction::BYTES]| {
        Instruction::from_bytes(bytes).map_or(0, |i| i.op.cost().weight(header.width, cells))
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
        weighted_operations: tables.code.iter().map(weight).sum::<u64>() + operations,
        teams: header.teams,
    }
}

/// Bits of the instruction groups that the code uses.
fn groups(tables: &Tables<'_>) -> u32 {
    let bits = |bytes: &[u8; Instruction::BYTES]| {
        Instruction::from_bytes(bytes).map_or(0, |i| u32::from(i.op.group().bit()))
    };
    tables
        .code
        .iter()
        .fold(0, |groups, code| groups | bits(code))
}
