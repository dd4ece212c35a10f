//! Sets of outputs.

use crate::verify::MAX_OUTPUTS;

const WORDS: usize = MAX_OUTPUTS as usize / 32;

/// A set of outputs, a bit for each that a policy may have.
#[derive(Debug, Default)]
pub(crate) struct OutputSet([u32; WORDS]);

impl OutputSet {
    /// Adds an output. Returns whether it is new. Numbers that no output has are never in the set.
    #[inline]
    pub(crate) fn insert(&mut self, output: u16) -> bool {
        let bit = 1 << (output % 32);
        let Some(word) = self.0.get_mut(usize::from(output / 32)) else {
            return false;
        };
        let new = *word & bit == 0;
        *word |= bit;
        new
    }

    /// The first output that is not in the set; [`MAX_OUTPUTS`] if all are.
    pub(crate) fn first_missing(&self) -> u16 {
        let mut before = 0;
        for word in self.0 {
            let run = word.trailing_ones() as u16;
            before += run;
            if run < 32 {
                break;
            }
        }
        before
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outputs_enter_once_and_the_first_gap_is_found() {
        let mut set = OutputSet::default();
        assert_eq!(set.first_missing(), 0);
        assert!((0..MAX_OUTPUTS).all(|output| output == 70 || set.insert(output)));
        assert_eq!(set.first_missing(), 70);
        assert!(set.insert(70) && !set.insert(70) && !set.insert(MAX_OUTPUTS));
        assert_eq!(set.first_missing(), MAX_OUTPUTS);
    }
}
