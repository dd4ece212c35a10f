//! Fits a model of one step by least squares.

use nalgebra::{Cholesky, DMatrix};
use tpg_runtime::math::standardise;

use super::FrontEndParams;

/// Number of fits after the first in which outliers lose weight.
const ROUNDS: usize = 5;

/// Pairs of observations in the front end's units.
pub(super) struct Pairs<'a> {
    /// One after another: observation, action, next observation.
    pub raw: &'a [f32],
    /// Length of an observation.
    pub inputs: usize,
    /// Number of the action's variables.
    pub actions: usize,
    /// What is subtracted from each element.
    pub means: &'a [f32],
    /// What the differences are multiplied by.
    pub scales: &'a [f32],
    /// Distance from the means, in standard deviations, at which a pair loses weight. 0 weighs all alike.
    pub weighting: f64,
}

/// The normal equations of all columns at once.
///
/// A model of fewer columns uses some of the rows and columns, so that one pass over the data serves every choice of columns.
pub(super) struct Normal {
    /// The numbers of the variables in each monomial, ascending.
    pub factors: Vec<Vec<u16>>,
    /// Sums of products of two monomials.
    pub gram: DMatrix<f64>,
    /// Sums of products of a monomial and a target: a row for each monomial, a column for each target.
    pub cross: DMatrix<f64>,
    /// Sum of each target's squares.
    pub squares: Vec<f64>,
}

/// The numbers of the variables in each monomial up to a degree, in the runtime's order, which is depth first.
pub(super) fn monomials(variables: u16, degree: u8) -> Vec<Vec<u16>> {
    fn extend(all: &mut Vec<Vec<u16>>, prefix: &[u16], variables: u16, degree: u8) {
        all.push(prefix.to_vec());
        if degree == 0 {
            return;
        }
        for next in prefix.last().copied().unwrap_or(0)..variables {
            let longer = [prefix, &[next]].concat();
            extend(all, &longer, variables, degree - 1);
        }
    }
    let mut all = Vec::new();
    extend(&mut all, &[], variables, degree);
    all
}

impl Pairs<'_> {
    fn stride(&self) -> usize {
        2 * self.inputs + self.actions
    }

    /// Coefficients of a model of these columns: for each monomial one for each column. `None` if the pairs do not determine them.
    ///
    /// With an `outlier` error the fit is repeated [`ROUNDS`] times, each time with weights min(1, (outlier / error)²), where
    /// `error` is that of the fit before. No polynomial predicts steps in which the body hits a stop. A fit that tries to is wrong
    /// everywhere else.
    pub(super) fn model(&self, columns: &[u16], params: &FrontEndParams) -> Option<Vec<f32>> {
        let degree = params.degree;
        let targets: Vec<usize> = (0..columns.len()).collect();
        let fit = |weight: &dyn Fn(usize) -> f64| {
            let normal = self.sums(columns, degree, false, weight);
            let all: Vec<usize> = (0..normal.factors.len()).collect();
            normal.solve(&all, &targets, params.ridge)
        };
        let mut found = fit(&|_| 1.0)?;
        if params.outlier > 0.0 {
            for _ in 0..ROUNDS {
                let residuals = self.residuals(columns, degree, &found);
                let weight = |number: usize| (params.outlier / residuals[number]).powi(2).min(1.0);
                found = fit(&weight)?;
            }
        }
        // nalgebra stores columns, the runtime reads rows.
        let rows = found.transpose();
        let coefficients: Vec<f32> = rows.iter().map(|x| *x as f32).collect();
        coefficients
            .iter()
            .all(|x| x.is_finite())
            .then_some(coefficients)
    }

    /// Sums over all pairs, in their order. Each is weighted by its nearness to the means and by `weight` of its number. Targets are
    /// the changes of the columns. With `statics` they are the columns themselves, and actions are no variables.
    pub(super) fn sums(
        &self,
        columns: &[u16],
        degree: u8,
        statics: bool,
        weight: impl Fn(usize) -> f64,
    ) -> Normal {
        let factors = self.factors(columns, degree, statics);
        let (n, c) = (factors.len(), columns.len());
        let (mut gram, mut cross) = (vec![0.0; n * n], vec![0.0; n * c]);
        let mut squares = vec![0.0; c];
        self.each(columns, &factors, statics, |number, near, phi, targets| {
            let weight = near * weight(number);
            if weight == 0.0 {
                return;
            }
            for i in 0..n {
                let scaled = weight * phi[i];
                for (sum, x) in gram[i * n..=i * n + i].iter_mut().zip(phi) {
                    *sum += scaled * x;
                }
                for (sum, y) in cross[i * c..(i + 1) * c].iter_mut().zip(targets) {
                    *sum += scaled * y;
                }
            }
            for (sum, y) in squares.iter_mut().zip(targets) {
                *sum += weight * y * y;
            }
        });
        let gram = DMatrix::from_fn(n, n, |i, j| gram[i.max(j) * n + i.min(j)]);
        Normal {
            factors,
            gram,
            cross: DMatrix::from_row_slice(n, c, &cross),
            squares,
        }
    }

    /// The largest absolute error of each pair among the columns, under these coefficients of all monomials.
    fn residuals(&self, columns: &[u16], degree: u8, coefficients: &DMatrix<f64>) -> Vec<f64> {
        let factors = self.factors(columns, degree, false);
        let mut residuals = Vec::with_capacity(self.raw.len() / self.stride());
        self.each(columns, &factors, false, |_, _, phi, targets| {
            let error = |(target, column): (&f64, nalgebra::DVectorView<'_, f64>)| {
                let predicted: f64 = column.iter().zip(phi).map(|(a, x)| a * x).sum();
                (predicted - target).abs()
            };
            let columns = targets.iter().zip(coefficients.column_iter());
            residuals.push(columns.map(error).fold(0.0, f64::max));
        });
        residuals
    }

    fn factors(&self, columns: &[u16], degree: u8, statics: bool) -> Vec<Vec<u16>> {
        let actions = if statics { 0 } else { self.actions };
        monomials((columns.len() + actions) as u16, degree)
    }

    /// Calls `visit` for each pair with its number, its weight by nearness, its monomials and its targets.
    fn each(
        &self,
        columns: &[u16],
        factors: &[Vec<u16>],
        statics: bool,
        mut visit: impl FnMut(usize, f64, &[f64], &[f64]),
    ) {
        // Each monomial is an earlier one times one more variable.
        let parents: Vec<(usize, usize)> = factors
            .iter()
            .map(|list| match list.split_last() {
                Some((last, prefix)) => {
                    let parent = factors.iter().position(|f| f == prefix).unwrap_or(0);
                    (parent, usize::from(*last))
                }
                None => (0, 0),
            })
            .collect();
        let (mut values, mut targets) = (Vec::new(), vec![0.0; columns.len()]);
        let mut phi = vec![1.0; factors.len()];
        for (number, pair) in self.raw.chunks_exact(self.stride()).enumerate() {
            let (first, rest) = pair.split_at(self.inputs);
            let (action, second) = rest.split_at(self.actions);
            let z = |o: &[f32], column: u16| {
                let k = usize::from(column);
                f64::from(standardise(o[k], self.means[k], self.scales[k]))
            };
            values.clear();
            values.extend(columns.iter().map(|k| z(first, *k)));
            let near = self.nearness(&values);
            for ((target, k), before) in targets.iter_mut().zip(columns).zip(&values) {
                *target = if statics {
                    *before
                } else {
                    z(second, *k) - before
                };
            }
            if !statics {
                values.extend(action.iter().map(|u| f64::from(*u)));
            }
            for (k, (parent, variable)) in parents.iter().enumerate().skip(1) {
                phi[k] = phi[*parent] * values[*variable];
            }
            visit(number, near, &phi, &targets);
        }
    }

    /// exp(−‖z‖² / (n w²)) of n standardised values, where w is the weighting; 1 without weighting.
    fn nearness(&self, z: &[f64]) -> f64 {
        if self.weighting == 0.0 {
            return 1.0;
        }
        let squares: f64 = z.iter().map(|z| z * z).sum();
        // libm gives the same bits with any C library.
        libm::exp(-squares / z.len() as f64 / (self.weighting * self.weighting))
    }
}

impl Normal {
    /// Coefficients for these targets from these monomials alone: a row for each monomial, a column for each target. `None` if the
    /// sums do not determine them.
    ///
    /// The equations are scaled so that their diagonal is 1. Then `ridge` is added to it.
    pub(super) fn solve(
        &self,
        monomials: &[usize],
        targets: &[usize],
        ridge: f64,
    ) -> Option<DMatrix<f64>> {
        let scale: Vec<f64> = monomials
            .iter()
            .map(|k| {
                let diagonal = self.gram[(*k, *k)];
                if diagonal > 0.0 {
                    1.0 / diagonal.sqrt()
                } else {
                    1.0
                }
            })
            .collect();
        let n = monomials.len();
        let scaled = DMatrix::from_fn(n, n, |i, j| {
            let own = if i == j { ridge } else { 0.0 };
            self.gram[(monomials[i], monomials[j])] * scale[i] * scale[j] + own
        });
        let right = DMatrix::from_fn(n, targets.len(), |i, q| {
            self.cross[(monomials[i], targets[q])] * scale[i]
        });
        let solution = Cholesky::new(scaled)?.solve(&right);
        let coefficients = DMatrix::from_fn(n, targets.len(), |i, q| solution[(i, q)] * scale[i]);
        coefficients
            .iter()
            .all(|x| x.is_finite())
            .then_some(coefficients)
    }

    /// Weighted sum of squared errors of each target, under these coefficients of these monomials.
    pub(super) fn errors(
        &self,
        monomials: &[usize],
        targets: &[usize],
        coefficients: &DMatrix<f64>,
    ) -> Vec<f64> {
        let error = |(q, target): (usize, &usize)| {
            let mut error = self.squares[*target];
            for (i, a) in monomials.iter().enumerate() {
                let mut row = -2.0 * self.cross[(*a, *target)];
                for (j, b) in monomials.iter().enumerate() {
                    row += self.gram[(*a, *b)] * coefficients[(j, q)];
                }
                error += coefficients[(i, q)] * row;
            }
            error.max(0.0)
        };
        targets.iter().enumerate().map(error).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tpg_tasks::task::Rng;

    #[test]
    fn monomials_stand_in_the_runtimes_order() {
        let order = monomials(2, 2);
        let expected: [&[u16]; 6] = [&[], &[0], &[0, 0], &[0, 1], &[1], &[1, 1]];
        assert_eq!(order, expected);
        assert_eq!(
            monomials(7, 3).len() as u64,
            tpg_runtime::front_end::monomials(7, 3)
        );
    }

    /// A known quadratic model is found again from noiseless pairs, and errors are those of the residuals.
    #[test]
    fn a_model_is_found_again() {
        let mut rng = Rng::new(3);
        let (means, scales) = ([0.5, -1.0], [2.0, 0.5]);
        let mut raw = Vec::new();
        for _ in 0..400 {
            let [x, y, u] = [(); 3].map(|()| rng.uniform(-1.0, 1.0) as f32);
            // In standardised units x' = x + 0.1 y − 0.2 x u, y' = 0.9 y.
            let next = [x + 0.1 * y - 0.2 * x * u, 0.9 * y];
            let back = |z: [f32; 2]| [z[0] / scales[0] + means[0], z[1] / scales[1] + means[1]];
            raw.extend(back([x, y]).iter().chain(&[u]).chain(&back(next)).copied());
        }
        let pairs = Pairs {
            raw: &raw,
            inputs: 2,
            actions: 1,
            means: &means,
            scales: &scales,
            weighting: 0.0,
        };
        let normal = pairs.sums(&[0, 1], 2, false, |_| 1.0);
        let all: Vec<usize> = (0..normal.factors.len()).collect();
        let found = normal.solve(&all, &[0, 1], 1e-9).expect("determined");
        for (k, factors) in normal.factors.iter().enumerate() {
            let expected = match factors.as_slice() {
                [1] => [0.1, -0.1],
                [0, 2] => [-0.2, 0.0],
                _ => [0.0, 0.0],
            };
            for (q, expected) in expected.into_iter().enumerate() {
                assert!(
                    (found[(k, q)] - expected).abs() < 1e-4,
                    "{factors:?}: {}",
                    found[(k, q)]
                );
            }
        }
        let errors = normal.errors(&all, &[0, 1], &found);
        assert!(errors.iter().all(|e| *e < 1e-6), "{errors:?}");
        // Without y, what it does to x remains.
        let some: Vec<usize> = all
            .iter()
            .copied()
            .filter(|k| !normal.factors[*k].contains(&1))
            .collect();
        let poorer = normal.solve(&some, &[0], 1e-9).expect("determined");
        let left = normal.errors(&some, &[0], &poorer)[0] / normal.gram[(0, 0)];
        assert!((left - 0.01 / 3.0).abs() < 1e-3, "{left}");
    }

    /// A body that now and then hits a stop: what the stop does to some pairs must not bend the model of all others.
    #[test]
    fn outliers_lose_their_weight() {
        let mut rng = Rng::new(4);
        let mut raw = Vec::new();
        for _ in 0..1000 {
            let [x, u] = [(); 2].map(|()| rng.uniform(-1.0, 1.0) as f32);
            let free = x + 0.2 * u;
            raw.extend([x, u, if free > 0.9 { 0.0 } else { free }]);
        }
        let pairs = Pairs {
            raw: &raw,
            inputs: 1,
            actions: 1,
            means: &[0.0],
            scales: &[1.0],
            weighting: 0.0,
        };
        let worst = |outlier: f64| {
            let params = FrontEndParams {
                outlier,
                ..FrontEndParams::default()
            };
            let found = pairs.model(&[0], &params).expect("determined");
            let gaps = found.iter().zip([0.0, 0.0, 0.2]);
            gaps.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
        };
        assert!(worst(0.0) > 0.05, "{}", worst(0.0));
        assert!(worst(0.01) < 1e-3, "{}", worst(0.01));
    }
}
