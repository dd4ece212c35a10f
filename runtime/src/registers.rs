//! Where the registers of a program lie in the state.
//!
//! A program's registers are consecutive state words: scalars first, then vectors, then matrices row by row. The
//! observation window is at the start of the state, before the registers of every program.

use crate::blob::Header;
use crate::isa::Section;
use crate::tables::Program;

/// What one word of the state is to a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Location {
    /// This word of the observation window.
    Window(usize),
    /// This scalar register.
    Scalar(usize),
    /// A vector register and an element of it, 0 to W − 1.
    Vector(usize, usize),
    /// A matrix register and an element of it, row by row, 0 to W² − 1.
    Matrix(usize, usize),
}

/// The registers of one program: where they begin, and how many of each kind there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RegisterMap {
    width: usize,
    window: usize,
    start: usize,
    counts: [usize; 3],
}

impl RegisterMap {
    /// The map of a program whose registers begin at the state word `start`.
    ///
    /// `counts` are the numbers of scalar, vector and matrix registers.
    #[must_use]
    pub fn new(header: &Header, start: usize, counts: [u8; 3]) -> Self {
        RegisterMap {
            width: usize::from(header.width),
            window: usize::from(header.window),
            start,
            counts: counts.map(usize::from),
        }
    }

    /// The map of a stored program.
    #[must_use]
    pub fn of(header: &Header, program: &Program) -> Self {
        Self::new(header, usize::from(program.state_start), program.registers)
    }

    /// First state word of a register. `number` counts the registers of this kind from 0.
    ///
    /// The result has no meaning if the program has fewer registers of this kind.
    #[must_use]
    pub fn first_word(&self, kind: Section, number: usize) -> usize {
        let before = Section::ALL.iter().zip(self.counts).take(kind as usize);
        let words = before.map(|(kind, count)| count * kind.slot_words(self.width));
        self.start + words.sum::<usize>() + number * kind.slot_words(self.width)
    }

    /// What the state word `at` is to the program; `None` if it is neither in the window nor in a register of the program.
    #[must_use]
    pub fn locate(&self, at: usize) -> Option<Location> {
        if at < self.window {
            return Some(Location::Window(at));
        }
        let mut offset = at.checked_sub(self.start)?;
        for (kind, count) in Section::ALL.into_iter().zip(self.counts) {
            let words = kind.slot_words(self.width);
            if offset < count * words {
                // Never 0 here, which the compiler does not see.
                let (number, element) = (offset.checked_div(words)?, offset.checked_rem(words)?);
                return Some(match kind {
                    Section::Scalar => Location::Scalar(number),
                    Section::Vector => Location::Vector(number, element),
                    Section::Matrix => Location::Matrix(number, element),
                });
            }
            offset -= count * words;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_words_and_locations_agree() {
        let map = RegisterMap {
            width: 3,
            window: 9,
            start: 20,
            counts: [2, 1, 2],
        };
        assert_eq!(map.locate(8), Some(Location::Window(8)));
        assert_eq!(map.locate(9), None);
        assert_eq!(map.locate(21), Some(Location::Scalar(1)));
        assert_eq!(map.first_word(Section::Vector, 0), 22);
        assert_eq!(map.locate(24), Some(Location::Vector(0, 2)));
        assert_eq!(map.first_word(Section::Matrix, 1), 34);
        assert_eq!(map.locate(34), Some(Location::Matrix(1, 0)));
        assert_eq!(map.locate(42), Some(Location::Matrix(1, 8)));
        assert_eq!(map.locate(43), None);
    }
}
