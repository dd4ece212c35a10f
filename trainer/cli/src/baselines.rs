//! The baselines of `tpg eval --baselines`: policies without evolution, on the same episodes.

use std::convert::Infallible;

use nalgebra::{DMatrix, DVector};
use tpg_runtime::{Action, Reset};
use tpg_tasks::eval::{
    Arena, ConstantController, Controller, Episode, RandomController, Reply, evaluate,
};
use tpg_tasks::exit_status::Failure;
use tpg_tasks::score::Setup;

/// Values that the autoregression looks back on: more than the delay of Mackey-Glass, 17.
const ORDER: usize = 20;
/// Singular values below this share of the greatest say nothing of the series.
const SMALLEST: f64 = 1e-9;

/// A baseline's name, and its returns.
pub type Baseline = (&'static str, Vec<f64>);

/// The zero policy and the random one; where a series is to be continued, persistence and a linear autoregression too.
pub fn baselines(setup: &Setup) -> Result<Vec<Baseline>, Failure> {
    let mut arena = setup.arena()?;
    let actions = arena.task().spec().actions;
    let mut found = vec![
        (
            "zero",
            returns(setup, &mut arena, ConstantController::zero(actions))?,
        ),
        (
            "random",
            returns(setup, &mut arena, RandomController::new(actions))?,
        ),
    ];
    if let Some(series) = arena.task().known_series() {
        let fitted = Autoregression::fit(series);
        found.push((
            "persistence",
            returns(setup, &mut arena, Autoregression::persistence())?,
        ));
        if let Some(fitted) = fitted {
            found.push(("autoregression", returns(setup, &mut arena, fitted)?));
        }
    }
    Ok(found)
}

fn returns(
    setup: &Setup,
    arena: &mut Arena,
    controller: impl Controller<Error = Infallible>,
) -> Result<Vec<f64>, Failure> {
    let mut controller = setup.disturbed(arena, controller)?;
    let episodes: Vec<Episode> = evaluate(arena, &mut controller, setup.episode_seeds())?;
    Ok(episodes.iter().map(|episode| episode.total).collect())
}

/// Predicts the next value of a series as a constant and a weighted sum of the last ones, within 0 and 1.
struct Autoregression {
    constant: f64,
    /// Of the last value, of the one before it, and so on.
    weights: Vec<f64>,
    /// The last values, the newest first. Before the first one of an episode all were like it.
    past: Vec<f64>,
    began: bool,
    predicted: [f32; 1],
}

impl Autoregression {
    fn new(constant: f64, weights: Vec<f64>) -> Self {
        Autoregression {
            constant,
            past: vec![0.0; weights.len()],
            weights,
            began: false,
            predicted: [0.0],
        }
    }

    /// Predicts that nothing changes.
    fn persistence() -> Self {
        Autoregression::new(0.0, vec![1.0])
    }

    /// The weights with the least squared error of one step ahead. `None` if the series is too short, or if it has none.
    fn fit(series: &[f64]) -> Option<Self> {
        let rows = series
            .len()
            .checked_sub(ORDER)
            .filter(|rows| *rows > ORDER)?;
        let seen = DMatrix::from_fn(rows, ORDER + 1, |row, k| match k {
            0 => 1.0,
            k => series[row + ORDER - k],
        });
        let next = DVector::from_fn(rows, |row, _| series[row + ORDER]);
        let svd = seen.svd(true, true);
        let smallest = SMALLEST * svd.singular_values.max();
        let solution = svd.solve(&next, smallest).ok()?;
        let (constant, weights) = solution.as_slice().split_first()?;
        Some(Autoregression::new(*constant, weights.to_vec()))
    }
}

impl Controller for Autoregression {
    type Error = Infallible;

    fn reset(&mut self, _: Reset, _: u64) -> Result<(), Infallible> {
        self.began = false;
        Ok(())
    }

    fn decide(&mut self, observation: &[f32]) -> Result<Reply<'_>, Infallible> {
        let value = observation.first().copied().map_or(0.0, f64::from);
        if !self.began {
            self.past.fill(value);
            self.began = true;
        }
        self.past.rotate_right(1);
        self.past[0] = value;
        let pairs = self.weights.iter().zip(&self.past);
        let next = self.constant + pairs.map(|(weight, value)| weight * value).sum::<f64>();
        self.predicted = [next.clamp(0.0, 1.0) as f32];
        Ok(Reply {
            action: Action::Continuous(&self.predicted),
            instructions: 0,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The prediction for the value that follows these.
    fn next(controller: &mut Autoregression, values: &[f64]) -> f32 {
        let _ = controller.reset(Reset::Agent, 0);
        let mut predicted = f32::NAN;
        for value in values {
            let reply = controller.decide(&[*value as f32]);
            if let Ok(Reply {
                action: Action::Continuous([value]),
                ..
            }) = reply
            {
                predicted = *value;
            }
        }
        predicted
    }

    #[test]
    fn a_wave_is_continued_and_persistence_repeats() {
        let wave: Vec<f64> = (0..300)
            .map(|t| 0.5 + 0.4 * (0.3 * f64::from(t)).sin())
            .collect();
        let mut fitted = Autoregression::fit(&wave[..200]).expect("long enough");
        assert!((f64::from(next(&mut fitted, &wave[200..250])) - wave[250]).abs() < 1e-4);
        let last = next(&mut Autoregression::persistence(), &wave[200..250]);
        assert!((f64::from(last) - wave[249]).abs() < 1e-6);
        assert!(Autoregression::fit(&wave[..40]).is_none());
    }
}
