//! Random streams and probabilities of memory writes, for the interpreter and for policies that are compiled.

mod distribution;

use rand_core::Rng as _;

pub use crate::blob::WriteDistribution;
use crate::isa::{INDEXED_ROWS, REGISTERS};
use crate::rng::{Pcg32, mix64, mix64_next};
use crate::tables::Section;

/// Section number of indexed memory in seeds. No section of team memory has it, so the streams differ.
const INDEXED_SECTION: u64 = Section::ALL.len() as u64;

/// The stream from which a section of a team's memory draws its slots.
#[must_use]
pub fn slot_stream(agent_seed: u64, stream_key: u32, section: Section) -> Pcg32 {
    let (key, section) = (u64::from(stream_key), section as u64);
    Pcg32::new(mix64(&[agent_seed, key, section]), mix64(&[key, section]))
}

/// The slot that the stream's next draw selects, 0 to 7. It is the number of thresholds at or below the draw.
#[inline]
pub fn draw_slot(stream: &mut Pcg32, distribution: WriteDistribution) -> usize {
    let draw = stream.next_u32();
    let thresholds = distribution.slot_thresholds();
    thresholds.iter().filter(|t| **t <= draw).count()
}

/// The threshold of `cell` (row · 8 + column). A write reaches the cell if its 32-bit draw is below it.
#[inline]
#[must_use]
pub fn write_threshold(cell: u16, distribution: WriteDistribution) -> u32 {
    let row = usize::from(cell) / REGISTERS;
    let half = INDEXED_ROWS / 2;
    let distance = if row < half {
        half - 1 - row
    } else {
        row - half
    };
    distribution.row_threshold(distance)
}

/// Decides which cells the writes of indexed memory reach.
///
/// Each draw is a hash of stream, write and cell. So cells that nobody reads need no draw.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct IndexedStream {
    stream: u64,
    writes: u64,
}

impl IndexedStream {
    /// The stream of an agent, before its first write.
    #[must_use]
    pub fn new(agent_seed: u64) -> Self {
        IndexedStream {
            stream: mix64(&[agent_seed, 0, INDEXED_SECTION]),
            writes: 0,
        }
    }

    /// Begins the next write.
    #[inline]
    pub fn begin_write(&mut self) -> IndexedWrite {
        let write = self.writes;
        self.writes = write.wrapping_add(1);
        IndexedWrite {
            hash: mix64(&[self.stream, write]),
        }
    }
}

/// One write of indexed memory. It holds the hash of stream and write; each draw adds a cell to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IndexedWrite {
    hash: u64,
}

impl IndexedWrite {
    /// Whether this write reaches `cell` (row · 8 + column).
    #[inline]
    #[must_use]
    pub fn reaches(self, cell: u16, distribution: WriteDistribution) -> bool {
        self.draw(cell) < write_threshold(cell, distribution)
    }

    /// Which of these cells this write reaches, each with its place in the list.
    #[inline]
    pub(crate) fn reached(
        self,
        cells: &[[u8; 2]],
        distribution: WriteDistribution,
    ) -> impl Iterator<Item = (usize, u16)> {
        let (mut row, mut threshold) = (u16::MAX, 0);
        cells.iter().enumerate().filter_map(move |(k, bytes)| {
            let cell = u16::from_le_bytes(*bytes);
            // Cells ascend, so most have the row of the cell before. The threshold depends on the row alone.
            if cell / REGISTERS as u16 != row {
                row = cell / REGISTERS as u16;
                threshold = write_threshold(cell, distribution);
            }
            (self.draw(cell) < threshold).then_some((k, cell))
        })
    }

    #[inline]
    const fn draw(self, cell: u16) -> u32 {
        (mix64_next(self.hash, cell as u64) >> 32) as u32
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::isa::SLOTS;
    use std::vec::Vec;

    #[test]
    fn slot_frequencies_follow_the_thresholds() {
        let mut stream = slot_stream(7, 1, Section::Vector);
        let mut counts = [0u32; SLOTS];
        for _ in 0..100_000 {
            counts[draw_slot(&mut stream, WriteDistribution::Thesis)] += 1;
        }
        // Shares of N(4, (4/3)²), floored and clamped.
        let shares = [
            0.0122, 0.0546, 0.1598, 0.2734, 0.2734, 0.1598, 0.0546, 0.0122,
        ];
        for (count, share) in counts.iter().zip(shares) {
            assert!(
                (f64::from(*count) / 1e5 - share).abs() < 0.005,
                "{counts:?}"
            );
        }
    }

    #[test]
    fn writes_are_most_frequent_in_the_middle() {
        let mut stream = IndexedStream::new(3);
        let mut rows = [0u32; INDEXED_ROWS];
        for _ in 0..20_000 {
            let write = stream.begin_write();
            for (row, count) in rows.iter_mut().enumerate() {
                *count +=
                    u32::from(write.reaches((row * REGISTERS) as u16, WriteDistribution::Thesis));
            }
        }
        let share: Vec<f64> = rows.iter().map(|n| f64::from(*n) / 2e4).collect();
        for (row, exact) in [
            (49, core::f64::consts::FRAC_2_PI),
            (50, core::f64::consts::FRAC_2_PI),
            (48, 0.1273),
            (51, 0.1273),
            (45, 0.0098),
        ] {
            assert!(
                (share[row] - exact).abs() < 0.01,
                "row {row}: {}",
                share[row]
            );
        }
    }
}
