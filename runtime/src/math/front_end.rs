//! The arithmetic of a front end: standardises observations, and predicts by a model what is missing of them.

use super::{clamp, finite};

/// Standardised and predicted elements are limited to −`LIMIT` to +`LIMIT`.
pub const LIMIT: f32 = 10.0;

/// Whether every element of an observation is zero.
///
/// Zeros of both signs count. A non-finite element counts as +0.
#[must_use]
pub fn is_blank(observation: &[f32]) -> bool {
    observation.iter().all(|x| finite(*x) == 0.0)
}

/// Standardises an observed element: (x − `mean`) · `scale`, limited to ±[`LIMIT`].
///
/// A non-finite `x` counts as 0, and a non-finite result becomes 0.
#[inline(always)]
#[must_use]
pub fn standardise(x: f32, mean: f32, scale: f32) -> f32 {
    clamp(finite((finite(x) - mean) * scale), -LIMIT, LIMIT)
}

/// Predicts an element that was not observed: its last value `x` plus the model's `change`, limited to ±[`LIMIT`].
///
/// A non-finite sum becomes 0.
#[inline(always)]
#[must_use]
pub fn predict(x: f32, change: f32) -> f32 {
    clamp(finite(x + change), -LIMIT, LIMIT)
}

/// How far an element that is perceived is from what was predicted of it. A non-finite difference becomes 0.
#[inline(always)]
#[must_use]
pub fn residual(x: f32, predicted: f32) -> f32 {
    finite(x - predicted)
}

/// A discrete action as a variable of the model: its number minus the middle of all numbers, (`actions` − 1) / 2.
#[must_use]
pub fn centred(action: u16, actions: u16) -> f32 {
    f32::from(action) - f32::from(actions.saturating_sub(1)) * 0.5
}

/// Computes the changes that the model adds to the elements, and writes them to `sums`.
///
/// The model is a polynomial in `variables` up to `degree`, at most 3. Each monomial has one row of `coefficients`,
/// with one coefficient (f32, little-endian) for each element of `sums`. Each sum starts from +0.
///
/// The order of the monomials is depth first. The first is 1. Then comes each variable x. It is followed by its product
/// with each variable y, from x itself on. Each x·y is followed by its product with each variable z, from y itself on.
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
        // There is one element. Only one coefficient is 1, so the sum is the value of the monomial at `index`.
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
