//! Augmented random search, version V1-t of the paper: steps along the best of several directions, each tried both ways.

use super::TuningParams;
use tpg_tasks::task::Rng;

/// One iteration, with its directions drawn and its trials to be scored.
pub struct Search<'a> {
    params: &'a TuningParams,
    base: &'a [f32],
    directions: Vec<Vec<f32>>,
}

/// Scores of the two trials of one direction. A score that is not finite counts as none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trial {
    /// Score of base + noise · direction.
    pub forwards: f64,
    /// Score of base − noise · direction.
    pub backwards: f64,
}

impl Trial {
    fn best(&self) -> f64 {
        self.forwards.max(self.backwards)
    }

    fn is_finite(&self) -> bool {
        self.forwards.is_finite() && self.backwards.is_finite()
    }
}

impl<'a> Search<'a> {
    /// Draws `directions` directions from N(0, I), each as long as `base`.
    #[must_use]
    pub fn new(params: &'a TuningParams, base: &'a [f32], rng: &mut Rng) -> Self {
        let mut direction = || base.iter().map(|_| rng.normal() as f32).collect();
        Search {
            params,
            base,
            directions: (0..params.directions).map(|_| direction()).collect(),
        }
    }

    /// Constants of a trial. Trials 0 to n − 1 go forwards along the n directions, trials n to 2n − 1 backwards.
    #[must_use]
    pub fn constants(&self, trial: usize) -> Vec<f32> {
        let directions = self.directions.len();
        let noise = if trial < directions {
            self.params.noise as f32
        } else {
            -self.params.noise as f32
        };
        let direction = &self.directions[trial % directions];
        let moved = self.base.iter().zip(direction).map(|(x, d)| x + noise * d);
        moved.map(bounded).collect()
    }

    /// The constants after a step: base + step / (b σ) Σ (forwards − backwards) · direction. The sum is over the b = `top`
    /// directions whose better trial scores highest. σ is the standard deviation of their 2b scores.
    ///
    /// Trials come in the order of the directions. If no direction has two finite scores, or σ is 0, the constants stay.
    #[must_use]
    pub fn step(&self, trials: &[Trial]) -> Vec<f32> {
        let mut used: Vec<(&Trial, &Vec<f32>)> = trials.iter().zip(&self.directions).collect();
        used.retain(|(trial, _)| trial.is_finite());
        // The sort is stable, so that among equals the direction that was drawn first wins.
        used.sort_by(|a, b| b.0.best().total_cmp(&a.0.best()));
        used.truncate(self.params.top as usize);
        let scores: Vec<f64> = used
            .iter()
            .flat_map(|(trial, _)| [trial.forwards, trial.backwards])
            .collect();
        let spread = tpg_tasks::stats::standard_deviation(&scores);
        let mut constants = self.base.to_vec();
        if spread <= 0.0 {
            return constants;
        }
        let factor = self.params.step / (used.len() as f64 * spread);
        for (trial, direction) in used {
            let length = (factor * (trial.forwards - trial.backwards)) as f32;
            for (x, d) in constants.iter_mut().zip(direction) {
                *x += length * d;
            }
        }
        constants.into_iter().map(bounded).collect()
    }
}

/// Keeps constants finite: NaN becomes 0, larger numbers the largest.
fn bounded(x: f32) -> f32 {
    if x.is_nan() {
        0.0
    } else {
        x.clamp(f32::MIN, f32::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Climbs −|x − target|², whose top is 0.
    #[test]
    fn a_hill_is_climbed() {
        let params = TuningParams::default();
        let target = [1.0f32, -2.0, 0.5, 0.0, 3.0];
        let score = |x: &[f32]| -> f64 {
            let errors = x.iter().zip(&target).map(|(x, t)| f64::from(x - t));
            -errors.map(|e| e * e).sum::<f64>()
        };
        let mut rng = Rng::new(1);
        let mut base = vec![0.0; target.len()];
        assert!(score(&base) < -14.0);
        for _ in 0..500 {
            let search = Search::new(&params, &base, &mut rng);
            let n = params.directions as usize;
            let trials: Vec<Trial> = (0..n)
                .map(|k| Trial {
                    forwards: score(&search.constants(k)),
                    backwards: score(&search.constants(n + k)),
                })
                .collect();
            base = search.step(&trials);
        }
        assert!(score(&base) > -0.05, "{base:?}");
    }

    #[test]
    fn without_spread_or_scores_nothing_moves() {
        let (params, base) = (TuningParams::default(), [1.0, 2.0]);
        let search = Search::new(&params, &base, &mut Rng::new(2));
        for (forwards, backwards) in [(3.0, 3.0), (f64::NEG_INFINITY, 1.0)] {
            let trial = Trial {
                forwards,
                backwards,
            };
            assert_eq!(search.step(&[trial; 16]), base);
        }
    }
}
