//! The mean over the last quarter of a lineage's iterates, without keeping all of them.

use serde::{Deserialize, Serialize};

use crate::evolve::LARGEST_COUNT;

/// Blocks that are kept at most. The number is even, so that blocks merge in pairs.
const BLOCKS: usize = 32;

/// Sums of iterates in blocks of equal length. The length doubles whenever there would be more than 32 blocks.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct RecentMean {
    /// Iterates of a full block, a power of two.
    length: u64,
    /// Sums over the full blocks, the oldest first, then the sum over the open one.
    blocks: Vec<Vec<f64>>,
    /// Iterates in the open block.
    open: u64,
}

impl RecentMean {
    /// Adds an iterate. All have the same length.
    pub fn push(&mut self, iterate: &[f32]) {
        self.length = self.length.max(1);
        if self.blocks.is_empty() || self.open == self.length {
            if self.blocks.len() == BLOCKS {
                self.merge();
            }
            self.blocks.push(vec![0.0; iterate.len()]);
            self.open = 0;
        }
        self.open += 1;
        if let Some(block) = self.blocks.last_mut() {
            add(block, iterate.iter().map(|x| f64::from(*x)));
        }
    }

    /// Whether iterates can have made it.
    pub(crate) fn is_consistent(&self) -> bool {
        let length = self.blocks.first().map_or(0, Vec::len);
        self.blocks.len() <= BLOCKS
            && self.blocks.iter().all(|block| block.len() == length)
            && self.length <= LARGEST_COUNT / BLOCKS as u64
            && self.open <= self.length
    }

    /// Joins neighbouring blocks. All are full, and their number is even.
    fn merge(&mut self) {
        let pairs = std::mem::take(&mut self.blocks);
        for pair in pairs.chunks(2) {
            let mut sum = pair[0].clone();
            for other in &pair[1..] {
                add(&mut sum, other.iter().copied());
            }
            self.blocks.push(sum);
        }
        self.length *= 2;
        self.open = self.length;
    }

    /// The mean of the last quarter of the iterates, rounded up to whole blocks. `None` before the first iterate.
    #[must_use]
    pub fn last_quarter(&self) -> Option<Vec<f32>> {
        let full = self.blocks.len().checked_sub(1)?;
        let wanted = (full as u64 * self.length + self.open).div_ceil(4);
        let (mut sum, mut count) = (self.blocks[full].clone(), self.open);
        for block in self.blocks[..full].iter().rev() {
            if count >= wanted {
                break;
            }
            add(&mut sum, block.iter().copied());
            count += self.length;
        }
        Some(sum.iter().map(|x| (x / count as f64) as f32).collect())
    }
}

fn add(sum: &mut [f64], terms: impl Iterator<Item = f64>) {
    for (sum, term) in sum.iter_mut().zip(terms) {
        *sum += term;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_mean_of_about_a_quarter_and_stays_small() {
        let mut mean = RecentMean::default();
        assert_eq!(mean.last_quarter(), None);
        for k in 1..=1000u16 {
            mean.push(&[f32::from(k)]);
            assert!(mean.blocks.len() <= BLOCKS);
            // The mean of the last m of the numbers 1..=k is k − (m − 1)/2.
            let last = 2.0 * (f32::from(k) - mean.last_quarter().expect("some")[0]) + 1.0;
            let wanted = f32::from(k.div_ceil(4));
            let block = mean.length as f32;
            assert!(
                (wanted..wanted + block + 0.01).contains(&(last + 0.005)),
                "{k}: {last}"
            );
        }
        assert_eq!(mean.length, 32);
    }
}
