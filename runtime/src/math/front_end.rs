//! What a front end computes: standardised observations, and the model that stands in for blank ones.

use super::{clamp, finite};

/// Perceived elements lie between minus and plus this.
pub const LIMIT: f32 = 10.0;

/// Whether every element of an observation is a zero of either sign, or not finite, which counts as +0.
#[must_use]
pub fn is_blank(observation: &[f32]) -> bool {
    observation.iter().all(|x| finite(*x) == 0.0)
}

/// An element that was observed, in the front end's units: (x − `mean`) · `scale`.
#[inline(always)]
#[must_use]
pub fn standardise(x: f32, mean: f32, scale: f32) -> f32 {
    clamp(finite((finite(x) - mean) * scale), -LIMIT, LIMIT)
}

/// An element that was not observed: the one before and what the model adds.
#[inline(always)]
#[must_use]
pub fn predict(x: f32, change: f32) -> f32 {
    clamp(finite(x + change), -LIMIT, LIMIT)
}

/// A discrete action as a variable of the model: its number, less that of the middle one.
#[must_use]
pub fn centred(action: u16, actions: u16) -> f32 {
    f32::from(action) - f32::from(actions.saturating_sub(1)) * 0.5
}

/// What the model adds to each believed element: the sums over the monomials in the variables up to `degree`, each times
/// its row of `coefficients`, one for each element of `sums`.
///
/// Monomials come depth first: 1, and then for each variable itself, its products with itself and each later one, and
/// of each such product those with its last factor and each later variable. Sums start from +0.
#[inline(never)]
pub fn changes(sums: &mut [f32], variables: &[f32], degree: u8, coefficients: &[[u8; 4]]) {
    sums.fill(0.0);
    let mut rows = coefficients.chunks(sums.len().max(1));
    let mut add = |monomial: f32| {
        let row = rows.next().unwrap_or_default();
        for (sum, coefficient) in sums.iter_mut().zip(row) {
            *sum += monomial * f32::from_le_bytes(*coefficient);
        }
    };
    add(1.0);
    for (i, x) in variables.iter().enumerate() {
        add(*x);
        if degree < 2 {
            continue;
        }
        for (j, y) in variables.iter().enumerate().skip(i) {
            let product = x * y;
            add(product);
            if degree < 3 {
                continue;
            }
            for z in variables.iter().skip(j) {
                add(product * z);
            }
        }
    }
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "the bits are the definition")]
mod tests {
    extern crate std;
    use std::vec::Vec;

    use super::*;

    #[test]
    fn monomials_come_depth_first() {
        // One element, coefficients that tell the monomials apart by decimal places.
        let value = |degree, variables: &[f32], index: usize, len: usize| {
            let mut coefficients = std::vec![[0; 4]; len];
            coefficients[index] = 1.0f32.to_le_bytes();
            let mut sums = [7.0];
            changes(&mut sums, variables, degree, &coefficients);
            sums[0]
        };
        let order = |degree, len| -> Vec<f32> {
            (0..len)
                .map(|k| value(degree, &[2.0, 3.0], k, len))
                .collect()
        };
        assert_eq!(order(1, 3), [1.0, 2.0, 3.0]);
        assert_eq!(order(2, 6), [1.0, 2.0, 4.0, 6.0, 3.0, 9.0]);
        assert_eq!(
            order(3, 10),
            [1.0, 2.0, 4.0, 8.0, 12.0, 6.0, 18.0, 3.0, 9.0, 27.0]
        );
    }

    #[test]
    fn what_is_perceived_is_finite_and_bounded() {
        assert!(is_blank(&[0.0, -0.0, f32::NAN]) && !is_blank(&[0.0, 1e-40]));
        assert_eq!(standardise(3.0, 1.0, 0.5), 1.0);
        assert_eq!(standardise(f32::NAN, 1.0, 0.5), -0.5);
        assert_eq!(standardise(3.0, 1.0, 100.0), 10.0);
        assert_eq!(standardise(f32::MAX, -f32::MAX, 1.0), 0.0);
        assert_eq!(predict(9.0, 2.0), 10.0);
        assert_eq!(predict(9.0, f32::INFINITY), 0.0);
        assert_eq!([0, 1, 2].map(|k| centred(k, 3)), [-1.0, 0.0, 1.0]);
        assert_eq!([0, 1].map(|k| centred(k, 2)), [-0.5, 0.5]);
    }
}
