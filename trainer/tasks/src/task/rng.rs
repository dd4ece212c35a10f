//! The random stream of a task.

use rand_core::Rng as _;
use rand_distr::{Distribution as _, StandardNormal};
use tpg_runtime::rng::{Pcg32, mix64};

/// A random stream for initial states and masks: PCG-XSH-RR 64/32, the same on every machine.
///
/// # Examples
/// ```
/// use tpg_tasks::task::Rng;
/// let (mut a, mut b) = (Rng::new(7), Rng::new(7));
/// assert_eq!(a.word(), b.word());
/// assert!((-0.05..0.05).contains(&a.uniform(-0.05, 0.05)));
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rng(Pcg32);

impl Rng {
    /// Makes the stream of a seed: state `mix64(seed, 0)`, sequence `mix64(seed, 1)`.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(Pcg32::new(mix64(&[seed, 0]), mix64(&[seed, 1])))
    }

    /// Draws 64 bits: two steps of the generator, the first one the low half.
    pub fn word(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Draws a number from `low` inclusive to `high`, by one [`word`](Self::word).
    ///
    /// The number is `low + (high - low) * u` with `u = (word >> 11) * 2^-53`, as Gymnasium's `uniform` computes it.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        const UNIT: f64 = 1.0 / (1u64 << 53) as f64;
        low + (high - low) * ((self.word() >> 11) as f64 * UNIT)
    }

    /// Draws a whole number below `n` by one [`word`](Self::word): `word · n / 2⁶⁴`, whose bias is below `n / 2⁶⁴`.
    pub fn below(&mut self, n: u64) -> u64 {
        ((u128::from(self.word()) * u128::from(n)) >> 64) as u64
    }

    /// Says yes with probability `p`, by one [`word`](Self::word).
    pub fn chance(&mut self, p: f64) -> bool {
        self.uniform(0.0, 1.0) < p
    }

    /// Draws a standard normal number by the Ziggurat method, which takes one word, in 1 of 100 draws more.
    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The words were computed apart from this code, by the PCG reference implementation's formulas.
    #[test]
    fn the_stream_of_a_seed_never_changes() {
        let mut rng = Rng::new(1);
        let words = [rng.word(), rng.word()];
        assert_eq!(
            words,
            [10_798_851_881_544_152_062, 10_160_577_908_703_186_283]
        );
    }

    #[test]
    fn uniform_is_the_documented_function_of_one_word() {
        let (mut rng, mut words) = (Rng::new(3), Rng::new(3));
        for _ in 0..1000 {
            let unit = (words.word() >> 11) as f64 / 2f64.powi(53);
            assert_eq!(
                rng.uniform(-0.1, 0.1).to_bits(),
                (-0.1 + 0.2 * unit).to_bits()
            );
        }
    }

    #[test]
    fn normal_has_mean_0_and_variance_1() {
        const COUNT: i32 = 100_000;
        let mut rng = Rng::new(4);
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..COUNT {
            let x = rng.normal();
            sum += x;
            squares += x * x;
        }
        // Five standard errors: 1/sqrt(n) for the mean, sqrt(2/n) for the variance.
        assert!((sum / f64::from(COUNT)).abs() < 0.016);
        assert!((squares / f64::from(COUNT) - 1.0).abs() < 0.023);
    }
}
