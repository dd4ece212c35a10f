//! Random streams and probabilities of memory writes, for the interpreter and for policies that are compiled.

use rand_core::Rng as _;

use crate::isa::{INDEXED_ROWS, REGISTERS, SLOTS};
use crate::rng::{Pcg32, mix64, mix64_next};
use crate::tables::Section;

/// The stream of indexed memory is told from the sections of team memory by this number.
const INDEXED_SECTION: u64 = Section::ALL.len() as u64;

/// ⌊Φ((j + 1 − M/2) / (M/6)) · 2³²⌋ for j = 0..6: a write goes to the slot that equals the number of
/// thresholds at or below a 32-bit draw, which is ⌊x⌋ clamped to 0..7 for x ~ N(M/2, (M/6)²), M = 8
/// (thesis Equation 3.4.1).
pub const SLOT_THRESHOLDS: [u32; SLOTS - 1] = [
    52_503_710,
    286_934_744,
    973_357_066,
    2_147_483_648,
    3_321_610_229,
    4_008_032_551,
    4_242_463_585,
];

/// ⌊p(i) · 2³²⌋ with p(i) = 0.25 / (0.5 π (i² + 0.25)), i rows from the middle (thesis Equation 2.4.2).
const WRITE_THRESHOLDS: [u32; INDEXED_ROWS / 2] = write_thresholds();

#[expect(
    clippy::float_arithmetic,
    reason = "a table made by the compiler, not register arithmetic"
)]
#[expect(
    clippy::indexing_slicing,
    reason = "a constant expression cannot iterate; the compiler checks it"
)]
const fn write_thresholds() -> [u32; INDEXED_ROWS / 2] {
    let mut table = [0; INDEXED_ROWS / 2];
    let mut i = 0;
    while i < table.len() {
        let p = 0.25 / (0.5 * core::f64::consts::PI * ((i * i) as f64 + 0.25));
        table[i] = (p * 4_294_967_296.0) as u32;
        i += 1;
    }
    table
}

/// The stream from which a section of a team's memory draws its slots.
#[must_use]
pub fn slot_stream(agent_seed: u64, stream_key: u32, section: Section) -> Pcg32 {
    let (key, section) = (u64::from(stream_key), section as u64);
    Pcg32::new(mix64(&[agent_seed, key, section]), mix64(&[key, section]))
}

/// The slot that a 32-bit draw selects.
#[inline]
pub(crate) fn slot_of(draw: u32) -> usize {
    SLOT_THRESHOLDS.iter().filter(|t| **t <= draw).count()
}

/// The slot that the stream's next draw selects.
#[inline]
pub fn draw_slot(stream: &mut Pcg32) -> usize {
    slot_of(stream.next_u32())
}

/// A write reaches `cell` (row · 8 + column) where its 32-bit draw is below this number.
#[inline]
#[must_use]
pub fn write_threshold(cell: u16) -> u32 {
    let row = usize::from(cell) / REGISTERS;
    let half = INDEXED_ROWS / 2;
    let distance = if row < half {
        half - 1 - row
    } else {
        row - half
    };
    WRITE_THRESHOLDS.get(distance).copied().unwrap_or(0)
}

/// Which cells the writes of indexed memory reach: a hash of stream, write and cell, so that cells
/// that nobody reads need no draw.
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

/// One write of indexed memory: the hash of stream and write, to which a cell is added.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IndexedWrite {
    hash: u64,
}

impl IndexedWrite {
    /// Whether this write reaches `cell` (row · 8 + column).
    #[inline]
    #[must_use]
    pub fn reaches(self, cell: u16) -> bool {
        let draw = mix64_next(self.hash, u64::from(cell)) >> 32;
        draw < u64::from(write_threshold(cell))
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    /// Φ by the trapezoidal rule on its density: independent of how the table was made.
    fn normal_cdf(z: f64) -> f64 {
        let n = 200_000;
        let (low, step) = (-10.0, (z + 10.0) / f64::from(n));
        let density = |x: f64| (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt();
        let inner: f64 = (1..n).map(|i| density(low + step * f64::from(i))).sum();
        step * (inner + 0.5 * (density(low) + density(z)))
    }

    #[test]
    fn slot_thresholds_are_the_normal_distribution() {
        for (j, threshold) in SLOT_THRESHOLDS.iter().enumerate() {
            let z = (j as f64 + 1.0 - 4.0) / (8.0 / 6.0);
            let exact = normal_cdf(z) * 4_294_967_296.0;
            assert!((exact - f64::from(*threshold)).abs() < 2.0, "{j}: {exact}");
        }
        assert_eq!(slot_of(0), 0);
        assert_eq!(slot_of(2_147_483_647), 3);
        assert_eq!(slot_of(2_147_483_648), 4);
        assert_eq!(slot_of(u32::MAX), 7);
    }

    #[test]
    fn slot_frequencies_follow_the_thresholds() {
        let mut stream = slot_stream(7, 1, Section::Vector);
        let mut counts = [0u32; SLOTS];
        for _ in 0..100_000 {
            counts[slot_of(stream.next_u32())] += 1;
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
        assert_eq!(WRITE_THRESHOLDS[0], 2_734_261_102);
        assert_eq!(WRITE_THRESHOLDS[49], 284_670);
        let mut stream = IndexedStream::new(3);
        let mut rows = [0u32; INDEXED_ROWS];
        for _ in 0..20_000 {
            let write = stream.begin_write();
            for (row, count) in rows.iter_mut().enumerate() {
                *count += u32::from(write.reaches((row * REGISTERS) as u16));
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
