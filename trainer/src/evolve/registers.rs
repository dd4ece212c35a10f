//! Sets of registers.

use serde::{Deserialize, Serialize};
use tpg_runtime::tables::Section;

/// A set of registers, or of slots of a team's memory: a bit for each scalar, vector and matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Registers(pub [u8; 3]);

impl Registers {
    /// All eight of each kind.
    pub const ALL: Registers = Registers([u8::MAX; 3]);

    /// Adds one.
    pub fn insert(&mut self, section: Section, register: u8) {
        self.0[section as usize] |= 1 << register;
    }

    pub(super) fn remove(&mut self, section: Section, register: u8) {
        self.0[section as usize] &= !(1 << register);
    }

    /// Whether it is one of them.
    #[must_use]
    pub fn contains(self, section: Section, register: u8) -> bool {
        self.of(section) & (1 << register) != 0
    }

    /// Those of either set.
    #[must_use]
    pub fn union(self, other: Registers) -> Registers {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        Registers([a | x, b | y, c | z])
    }

    /// Those of one kind, a bit for each.
    #[must_use]
    pub fn of(self, section: Section) -> u8 {
        self.0[section as usize]
    }

    /// Number of those of one kind.
    #[must_use]
    pub fn count(self, section: Section) -> usize {
        self.of(section).count_ones() as usize
    }

    /// Words that they take.
    #[must_use]
    pub fn words(self, width: u16) -> usize {
        let words = |s: &Section| self.count(*s) * s.slot_words(usize::from(width));
        Section::ALL.iter().map(words).sum()
    }
}
