//! Means and standard deviations of observations.

use serde::{Deserialize, Serialize};

/// Least standard deviation by which elements are scaled, so that elements that hardly vary do not become large.
const LEAST_SPREAD: f64 = 0.01;

/// Running means and sums of squared deviations of each element, in f64.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Moments {
    count: f64,
    means: Vec<f64>,
    squares: Vec<f64>,
}

impl Moments {
    /// Of observations of this length, of which there are none yet.
    #[must_use]
    pub fn new(inputs: usize) -> Self {
        Moments {
            count: 0.0,
            means: vec![0.0; inputs],
            squares: vec![0.0; inputs],
        }
    }

    /// Whether they are of observations of this length.
    pub(super) fn are_of(&self, inputs: usize) -> bool {
        self.means.len() == inputs && self.squares.len() == inputs
    }

    /// Forgets everything, in place.
    pub fn clear(&mut self) {
        self.count = 0.0;
        self.means.fill(0.0);
        self.squares.fill(0.0);
    }

    /// Adds an observation (Welford's method).
    pub fn add(&mut self, observation: &[f32]) {
        self.count += 1.0;
        let own = self.means.iter_mut().zip(&mut self.squares);
        for ((mean, squares), x) in own.zip(observation) {
            let before = f64::from(*x) - *mean;
            *mean += before / self.count;
            *squares += before * (f64::from(*x) - *mean);
        }
    }

    /// Adds the observations of others (method of Chan, Golub and LeVeque). The order of merging determines the bits.
    pub fn merge(&mut self, other: &Moments) {
        if other.count == 0.0 {
            return;
        }
        let all = self.count + other.count;
        for k in 0..self.means.len() {
            let gap = other.means[k] - self.means[k];
            self.means[k] += gap * (other.count / all);
            self.squares[k] += other.squares[k] + gap * gap * (self.count * other.count / all);
        }
        self.count = all;
    }

    /// The means, and the reciprocals of the standard deviations, each rounded to f32 once. Zeros and ones before the second
    /// observation.
    #[must_use]
    pub fn scaling(&self) -> (Vec<f32>, Vec<f32>) {
        if self.count < 2.0 {
            return (vec![0.0; self.means.len()], vec![1.0; self.means.len()]);
        }
        let spread = |squares: &f64| (squares / self.count).sqrt().max(LEAST_SPREAD);
        (
            self.means.iter().map(|mean| *mean as f32).collect(),
            self.squares
                .iter()
                .map(|s| (1.0 / spread(s)) as f32)
                .collect(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn merged_moments_are_those_of_all() {
        let data: Vec<[f32; 2]> = (0..50u8)
            .map(|k| [f32::from(k % 7) - 3.0, 100.0 + f32::from(k)])
            .collect();
        let of = |part: &[[f32; 2]]| {
            let mut moments = Moments::new(2);
            part.iter().for_each(|x| moments.add(x));
            moments
        };
        let all = of(&data);
        let mut merged = Moments::new(2);
        for part in data.chunks(9) {
            merged.merge(&of(part));
        }
        merged.merge(&Moments::new(2));
        assert!(
            (all.means[1] - 124.5).abs() < 1e-9 && (all.squares[1] / 50.0 - 208.25).abs() < 1e-9
        );
        for k in 0..2 {
            assert!((all.means[k] - merged.means[k]).abs() < 1e-9);
            assert!((all.squares[k] - merged.squares[k]).abs() < 1e-6);
        }
        assert_eq!(Moments::new(1).scaling(), (vec![0.0], vec![1.0]));
        let mut still = Moments::new(1);
        still.add(&[5.0]);
        still.add(&[5.0]);
        assert_eq!(still.scaling(), (vec![5.0], vec![100.0]));
    }
}
