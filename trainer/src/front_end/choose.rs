//! Chooses from the data which columns a model describes.
//!
//! It starts from all columns and drops one at a time, the one whose loss worsens the predictions of the others least. A column
//! can be dropped if no other column's squared error grows by more than [`MISSED`] of its squared change, and if the column is of
//! no use itself. It is of no use if it is a function of the others, or if the model predicts it hardly better than its mean or its
//! last value. Errors are those of held-out pairs. Models have the degree in use, at least 2.

use super::fit::{Normal, Pairs};

/// Largest growth of a column's squared error when another column is dropped, as a share of its squared change.
const MISSED: f64 = 0.02;
/// A column is a function of the others if at most this share of its variance remains unexplained.
const FUNCTION: f64 = 0.002;
/// Predicting a column is of use if the error is below this share of that of its last value and of its mean.
const USEFUL: f64 = 0.9;
/// One of this many pairs is held out.
const HELD_OUT: usize = 5;
/// Least degree of the models. A cosine is a function of the square of the sine.
const LEAST_DEGREE: u8 = 2;

/// Sums over the pairs for fitting, and over those that are held out.
struct Split {
    fit: Normal,
    test: Normal,
}

impl Split {
    fn new(pairs: &Pairs<'_>, columns: &[u16], degree: u8, statics: bool) -> Self {
        let share = |held_out: bool| {
            pairs.sums(columns, degree, statics, |number| {
                f64::from(u8::from(number.is_multiple_of(HELD_OUT) == held_out))
            })
        };
        Split {
            fit: share(false),
            test: share(true),
        }
    }

    /// Held-out squared errors of the targets, predicted from the variables that are kept.
    fn errors(
        &self,
        kept: impl Fn(usize) -> bool,
        targets: &[usize],
        ridge: f64,
    ) -> Option<Vec<f64>> {
        let monomials: Vec<usize> = (0..self.fit.factors.len())
            .filter(|k| self.fit.factors[*k].iter().all(|v| kept(usize::from(*v))))
            .collect();
        let coefficients = self.fit.solve(&monomials, targets, ridge)?;
        Some(self.test.errors(&monomials, targets, &coefficients))
    }
}

/// The columns to describe, ascending. There is at least one.
pub(super) fn columns(pairs: &Pairs<'_>, degree: u8, ridge: f64) -> Vec<u16> {
    let degree = degree.max(LEAST_DEGREE);
    let all: Vec<u16> = (0..pairs.inputs as u16).collect();
    let steps = Split::new(pairs, &all, degree, false);
    let statics = Split::new(pairs, &all, degree, true);
    let mut kept: Vec<usize> = (0..all.len()).collect();
    while kept.len() > 1 {
        let Some(column) = dispensable(&steps, &statics, &kept, all.len(), ridge) else {
            break;
        };
        kept.retain(|k| *k != column);
    }
    kept.into_iter().map(|k| k as u16).collect()
}

/// The column to drop next; `None` if each is needed.
fn dispensable(
    steps: &Split,
    statics: &Split,
    kept: &[usize],
    inputs: usize,
    ridge: f64,
) -> Option<usize> {
    let now = steps.errors(|v| v >= inputs || kept.contains(&v), kept, ridge)?;
    let mut best: Option<(f64, usize)> = None;
    for (place, column) in kept.iter().enumerate() {
        let others: Vec<usize> = kept.iter().copied().filter(|k| k != column).collect();
        let without = |v: usize| others.contains(&v);
        let static_error = statics.errors(without, &[*column], ridge)?;
        let is_function = static_error[0] <= FUNCTION * statics.test.squares[*column];
        let known = steps.test.squares[*column].min(statics.test.squares[*column]);
        let is_useful = now[place] < USEFUL * known;
        if is_useful && !is_function {
            continue;
        }
        let then = steps.errors(|v| v >= inputs || without(v), &others, ridge)?;
        let before = now.iter().enumerate().filter(|(k, _)| *k != place);
        let missed = before
            .zip(&then)
            .zip(&others)
            .map(|(((_, before), then), other)| {
                // Relative to the squared change, so that units do not matter.
                let change = steps.test.squares[*other].max(f64::MIN_POSITIVE);
                (then - before) / change
            })
            .fold(0.0, f64::max);
        if missed <= MISSED && best.is_none_or(|(least, _)| missed < least) {
            best = Some((missed, *column));
        }
    }
    best.map(|(_, column)| column)
}

#[cfg(test)]
mod tests {
    use super::*;
    use tpg_tasks::task::Rng;

    /// The columns are position, sine and cosine of an angle near the upright, speed, and noise. The cosine and the noise are
    /// dropped. The position stays although nothing depends on it.
    #[test]
    fn functions_of_others_and_noise_go() {
        let mut rng = Rng::new(5);
        let mut raw = Vec::new();
        for _ in 0..2000 {
            let [x, angle, speed, u] = [(); 4].map(|()| rng.uniform(-0.6, 0.6));
            let mut noise = || rng.uniform(-1.0, 1.0);
            let see = |x: f64, angle: f64, speed: f64, noise: f64| {
                [x, libm::sin(angle), libm::cos(angle), speed, noise].map(|x| x as f32)
            };
            let before = see(x, angle, speed, noise());
            let after = see(
                x + 0.1 * u + 0.05 * speed,
                angle + 0.1 * speed,
                speed + 0.3 * libm::sin(angle) - 0.2 * u,
                noise(),
            );
            raw.extend(before.iter().chain(&[u as f32]).chain(&after).copied());
        }
        let pairs = Pairs {
            raw: &raw,
            inputs: 5,
            actions: 1,
            means: &[0.0, 0.0, 0.8, 0.0, 0.0],
            scales: &[2.0, 2.0, 8.0, 2.0, 2.0],
            weighting: 0.0,
        };
        assert_eq!(columns(&pairs, 3, 1e-6), [0, 1, 3]);
    }
}
