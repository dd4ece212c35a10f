//! Evolved constants: initial values of registers, or of slots of a team's memory.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use tpg_runtime::isa::REGISTERS;
use tpg_runtime::tables::Section;

use super::Registers;

/// The constants of some registers or slots: scalars first, then vectors, then matrices, each kind by its numbers.
///
/// Clones share them until they change.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Constants {
    registers: Registers,
    values: Arc<[f32]>,
}

impl Default for Constants {
    fn default() -> Self {
        Constants {
            registers: Registers::default(),
            values: Arc::default(),
        }
    }
}

impl Constants {
    /// Constants of these registers, one `value` after another.
    #[must_use]
    pub fn new(registers: Registers, width: u16, mut value: impl FnMut() -> f32) -> Self {
        Constants {
            registers,
            values: (0..registers.words(width)).map(|_| value()).collect(),
        }
    }

    pub(crate) fn from_parts(registers: Registers, values: Arc<[f32]>) -> Self {
        Constants { registers, values }
    }

    /// Whose constants they are.
    #[must_use]
    pub fn registers(&self) -> Registers {
        self.registers
    }

    /// All of them, in order.
    #[must_use]
    pub fn values(&self) -> &Arc<[f32]> {
        &self.values
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Where the constants of a register begin among all, if it has some.
    #[must_use]
    pub fn start(&self, section: Section, register: u8, width: u16) -> Option<usize> {
        if !self.registers.contains(section, register) {
            return None;
        }
        let mut before = Registers::default();
        for kind in Section::ALL.into_iter().take(section as usize) {
            before.0[kind as usize] = self.registers.of(kind);
        }
        before.0[section as usize] = self.registers.of(section) & ((1u8 << register) - 1);
        Some(before.words(width))
    }

    /// The constants of a register, if it has some.
    #[must_use]
    pub fn get(&self, section: Section, register: u8, width: u16) -> Option<&[f32]> {
        let start = self.start(section, register, width)?;
        self.values
            .get(start..)?
            .get(..section.slot_words(usize::from(width)))
    }

    /// Makes them those of these registers. Registers that have constants keep them, others get one `value` after another.
    pub fn fit(&mut self, registers: Registers, width: u16, mut value: impl FnMut() -> f32) {
        if registers == self.registers {
            return;
        }
        let mut values = Vec::with_capacity(registers.words(width));
        for section in Section::ALL {
            let words = section.slot_words(usize::from(width));
            for register in members(registers, section) {
                match self.get(section, register, width) {
                    Some(kept) => values.extend_from_slice(kept),
                    None => values.extend((0..words).map(|_| value())),
                }
            }
        }
        *self = Constants::from_parts(registers, values.into());
    }

    /// Gives a register that has constants others, one `value` after another.
    pub fn set(
        &mut self,
        section: Section,
        register: u8,
        width: u16,
        mut value: impl FnMut() -> f32,
    ) {
        let words = section.slot_words(usize::from(width));
        if let Some(start) = self.start(section, register, width) {
            let mut values = self.values.to_vec();
            for x in values.iter_mut().skip(start).take(words) {
                *x = value();
            }
            self.values = values.into();
        }
    }

    /// The same registers with other constants, as many as they have.
    #[must_use]
    pub fn with_values(&self, values: impl Into<Arc<[f32]>>) -> Self {
        Constants::from_parts(self.registers, values.into())
    }
}

/// The numbers of a set's registers of one kind, ascending.
pub(crate) fn members(registers: Registers, section: Section) -> impl Iterator<Item = u8> {
    (0..REGISTERS as u8).filter(move |k| registers.contains(section, *k))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn registers_keep_their_constants_when_others_come_and_go() {
        let width = 2;
        let mut next = 0.0;
        let mut count = || {
            next += 1.0;
            next
        };
        let mut constants = Constants::new(Registers([0b101, 0b10, 0b1]), width, &mut count);
        assert_eq!(constants.values().len(), 2 + 2 + 4);
        assert_eq!(
            constants.get(Section::Vector, 1, width),
            Some(&[3.0, 4.0][..])
        );
        assert_eq!(constants.get(Section::Vector, 0, width), None);
        constants.fit(Registers([0b110, 0b11, 0b1]), width, &mut count);
        assert_eq!(
            constants.values().to_vec(),
            [9.0, 2.0, 10.0, 11.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]
        );
        let shared = Arc::as_ptr(constants.values());
        constants.fit(Registers([0b110, 0b11, 0b1]), width, || f32::NAN);
        assert_eq!(Arc::as_ptr(constants.values()), shared);
        constants.set(Section::Matrix, 0, width, || 0.0);
        constants.set(Section::Matrix, 7, width, || f32::NAN);
        assert_eq!(
            constants.get(Section::Matrix, 0, width),
            Some(&[0.0; 4][..])
        );
        assert_eq!(constants.start(Section::Vector, 1, width), Some(4));
    }
}
