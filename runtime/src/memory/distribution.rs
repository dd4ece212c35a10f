//! Tables of the distributions by which memory is written.

use super::WriteDistribution;
use crate::isa::{INDEXED_ROWS, SLOTS};

/// ⌊F(j + 1) · 2³²⌋ for j = 0..6, F the cumulative distribution.
type SlotThresholds = [u32; SLOTS - 1];
/// ⌊p(i) · 2³²⌋ for i = 0..49 rows from the middle.
type RowThresholds = [u32; INDEXED_ROWS / 2];

/// A write goes to slot ⌊x⌋ clamped to 0..7 for x ~ N(M/2, (M/6)²), M = 8 (thesis Equation 3.4.1).
const NORMAL_SLOTS: SlotThresholds = [
    52_503_710,
    286_934_744,
    973_357_066,
    2_147_483_648,
    3_321_610_229,
    4_008_032_551,
    4_242_463_585,
];

/// The same for x of Cauchy's distribution around M/2 with scale M/6.
const CAUCHY_SLOTS: SlotThresholds = [
    571_767_258,
    803_876_323,
    1_267_733_622,
    2_147_483_648,
    3_027_233_673,
    3_491_090_972,
    3_723_200_037,
];

const UNIFORM_SLOTS: SlotThresholds = [
    0x2000_0000,
    0x4000_0000,
    0x6000_0000,
    0x8000_0000,
    0xA000_0000,
    0xC000_0000,
    0xE000_0000,
];

/// p(i) = 0.25 / (0.5 π (i² + 0.25)) (thesis Equation 2.4.2).
const CAUCHY_ROWS: RowThresholds = cauchy_rows();

#[expect(
    clippy::float_arithmetic,
    reason = "a table made by the compiler, not register arithmetic"
)]
#[expect(
    clippy::indexing_slicing,
    reason = "a constant expression cannot iterate; the compiler checks it"
)]
const fn cauchy_rows() -> RowThresholds {
    let mut table = [0; INDEXED_ROWS / 2];
    let mut i = 0;
    while i < table.len() {
        let p = 0.25 / (0.5 * core::f64::consts::PI * ((i * i) as f64 + 0.25));
        table[i] = (p * 4_294_967_296.0) as u32;
        i += 1;
    }
    table
}

/// p(i) ∝ exp(−(i + ½)² / 2(R/6)²), R = 100 rows, with the sum of [`CAUCHY_ROWS`].
const NORMAL_ROWS: RowThresholds = [
    177_279_332,
    176_642_274,
    175_375_017,
    173_491_158,
    171_010_787,
    167_960_131,
    164_371_094,
    160_280_697,
    155_730_451,
    150_765_649,
    145_434_620,
    139_787_951,
    133_877_692,
    127_756_567,
    121_477_206,
    115_091_405,
    108_649_449,
    102_199_485,
    95_786_967,
    89_454_189,
    83_239_886,
    77_178_941,
    71_302_161,
    65_636_151,
    60_203_268,
    55_021_644,
    50_105_292,
    45_464_265,
    41_104_871,
    37_029_935,
    33_239_091,
    29_729_108,
    26_494_221,
    23_526_481,
    20_816_098,
    18_351_781,
    16_121_062,
    14_110_604,
    12_306_488,
    10_694_468,
    9_260_209,
    7_989_487,
    6_868_368,
    5_883_351,
    5_021_489,
    4_270_481,
    3_618_742,
    3_055_449,
    2_570_567,
    2_154_861,
];

/// The mean of [`CAUCHY_ROWS`]. Every row has this threshold.
const UNIFORM_ROW: u32 = 73_895_819;

impl WriteDistribution {
    /// Whether this build executes policies that write so.
    #[must_use]
    pub const fn is_built(self) -> bool {
        cfg!(feature = "write-distributions") || matches!(self, Self::Thesis)
    }

    /// This one, known to be the thesis's to a build that has no other: its tables are not in the firmware then.
    pub(crate) const fn built(self) -> Self {
        if cfg!(feature = "write-distributions") {
            self
        } else {
            Self::Thesis
        }
    }

    /// A write of team memory goes to the slot that equals the number of these at or below a 32-bit draw.
    #[inline]
    #[must_use]
    pub const fn slot_thresholds(self) -> &'static [u32; SLOTS - 1] {
        match self {
            Self::Thesis => &NORMAL_SLOTS,
            Self::Uniform => &UNIFORM_SLOTS,
            Self::Exchanged => &CAUCHY_SLOTS,
        }
    }

    /// A write of indexed memory reaches a cell so many rows from the middle where a 32-bit draw is below this.
    #[inline]
    pub(super) fn row_threshold(self, distance: usize) -> u32 {
        let table = match self {
            Self::Thesis => &CAUCHY_ROWS,
            Self::Uniform => return UNIFORM_ROW,
            Self::Exchanged => &NORMAL_ROWS,
        };
        table.get(distance).copied().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;

    /// An integral by the trapezoidal rule: independent of how the tables were made.
    fn integral(density: impl Fn(f64) -> f64, from: f64, to: f64) -> f64 {
        let n = 400_000;
        let step = (to - from) / f64::from(n);
        let inner: f64 = (1..n).map(|i| density(from + step * f64::from(i))).sum();
        step * (inner + 0.5 * (density(from) + density(to)))
    }

    #[test]
    fn slot_thresholds_are_the_cumulative_distributions() {
        let normal = |x: f64| (-0.5 * x * x).exp() / core::f64::consts::TAU.sqrt();
        let cauchy = |x: f64| 1.0 / (core::f64::consts::PI * (1.0 + x * x));
        for j in 0..SLOTS - 1 {
            // Both are symmetric: half of all lies below the middle.
            let z = (j as f64 + 1.0 - 4.0) / (8.0 / 6.0);
            let shares = [
                (NORMAL_SLOTS[j], 0.5 + integral(normal, 0.0, z)),
                (CAUCHY_SLOTS[j], 0.5 + integral(cauchy, 0.0, z)),
                (UNIFORM_SLOTS[j], (j as f64 + 1.0) / 8.0),
            ];
            for (threshold, share) in shares {
                let exact = share * 4_294_967_296.0;
                assert!((exact - f64::from(threshold)).abs() < 2.0, "{j}: {exact}");
            }
        }
    }

    #[test]
    fn all_distributions_write_as_many_cells() {
        assert_eq!((CAUCHY_ROWS[0], CAUCHY_ROWS[49]), (2_734_261_102, 284_670));
        let sum =
            |d: WriteDistribution| (0..50).map(|i| u64::from(d.row_threshold(i))).sum::<u64>();
        let [thesis, uniform, normal] = [
            WriteDistribution::Thesis,
            WriteDistribution::Uniform,
            WriteDistribution::Exchanged,
        ]
        .map(sum);
        assert!(thesis.abs_diff(uniform) < 100 && thesis.abs_diff(normal) < 100);
        for (i, pair) in NORMAL_ROWS.windows(2).enumerate() {
            let ratio = f64::from(pair[1]) / f64::from(pair[0]);
            let exact =
                (-((i as f64 + 1.5).powi(2) - (i as f64 + 0.5).powi(2)) / 2.0 * 0.0036).exp();
            assert!((ratio - exact).abs() < 1e-6, "row {i}: {ratio}, {exact}");
        }
    }
}
