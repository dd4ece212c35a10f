//! The settings of tuning.

use serde::{Deserialize, Serialize};

use crate::keys::{Key, is_default};

/// Most programs of a team that has grown.
const MOST_MEMBERS: u64 = 1000;
/// Most iterations or generations that a setting of tuning counts.
const LONGEST: u64 = 1_000_000_000;
/// Smallest standard deviation of noise, and shortest step.
const SMALLEST_MOVE: f64 = 1e-9;
/// Largest of both, and largest margin.
const LARGEST: f64 = 1e6;

/// How the constants of the best agents are tuned; `presets/defaults.toml` explains every key.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct TuningParams {
    /// Agents that are tuned at a time, one for each lineage. 0 turns tuning off.
    #[serde(rename = "lines")]
    pub lineages: u32,
    /// Iterations of each lineage in a generation.
    pub iterations: u32,
    /// Directions of an iteration, each tried forwards and backwards.
    pub directions: u32,
    /// Directions that an update uses: those with the best trials.
    pub top: u32,
    /// Episodes of each trial.
    pub episodes: u32,
    /// Standard deviation of what a trial adds to each constant.
    pub noise: f64,
    /// Length of a step, in standard deviations of the scores.
    pub step: f64,
    /// Iterations after which noise and step have halved; they go on halving at this rate. 0 keeps them as they are.
    #[serde(default, skip_serializing_if = "is_default")]
    pub half_life: u32,
    /// Generations between two means of a lineage's last quarter. 0: none are made.
    pub mean_every: u32,
    /// Generations for which a lineage may lie behind the best agent before it is replaced by it. 0: without limit.
    pub patience: u32,
    /// A lineage lies behind if its score is lower than the best one by more than this share of it.
    pub margin: f64,
    /// Iterations after which a lineage's team grows, once. 0: never.
    pub grow_after: u32,
    /// Programs of a team that has grown.
    pub grow_to: u32,
    /// Iterations after which only the best lineage goes on. 0: all go on.
    pub one_after: u32,
    /// Whether the worse half of the lineages ends at a time, after equal parts of `one_after`. Otherwise all but the best end
    /// after `one_after`.
    #[serde(default, skip_serializing_if = "is_default")]
    pub halve: bool,
    /// Iterations after which the programs of a lineage's team get a memory, once. 0: never.
    pub remember_after: u32,
}

impl Default for TuningParams {
    fn default() -> Self {
        TuningParams {
            lineages: 0,
            iterations: 1,
            directions: 16,
            top: 8,
            episodes: 1,
            noise: 0.03,
            step: 0.02,
            half_life: 0,
            mean_every: 10,
            patience: 60,
            margin: 0.3,
            grow_after: 0,
            grow_to: 2,
            one_after: 0,
            halve: false,
            remember_after: 0,
        }
    }
}

impl TuningParams {
    pub(crate) const KEYS: &[Key] = &[
        Key::whole("lines", 0, 10_000),
        Key::whole("iterations", 1, 1_000_000),
        Key::whole("directions", 1, 10_000),
        Key::whole("top", 1, 10_000),
        Key::whole("episodes", 1, 1000),
        Key::number("noise", SMALLEST_MOVE, LARGEST),
        Key::number("step", SMALLEST_MOVE, LARGEST),
        Key::whole("half-life", 0, LONGEST),
        Key::whole("mean-every", 0, LONGEST),
        Key::whole("patience", 0, LONGEST),
        Key::number("margin", 0.0, LARGEST),
        Key::whole("grow-after", 0, LONGEST),
        Key::whole("grow-to", 1, MOST_MEMBERS),
        Key::whole("one-after", 0, LONGEST),
        Key::flag("halve"),
        Key::whole("remember-after", 0, LONGEST),
    ];

    /// These settings with noise and step as they are after a lineage has made this many iterations.
    #[must_use]
    pub fn cooled(&self, iterations: u64) -> Self {
        if self.half_life == 0 {
            return *self;
        }
        let share = libm::exp2(-(iterations as f64) / f64::from(self.half_life));
        TuningParams {
            noise: self.noise * share,
            step: self.step * share,
            ..*self
        }
    }

    /// Number of lineages that go on once the oldest has made this many iterations.
    #[must_use]
    pub fn lineages_after(&self, iterations: u64) -> u32 {
        let after = u64::from(self.one_after);
        if after == 0 || (iterations < after && !self.halve) {
            return self.lineages;
        }
        // The least number of halvings that leaves one lineage.
        let halvings = u64::from(self.lineages)
            .next_power_of_two()
            .trailing_zeros();
        let done = iterations.min(after) * u64::from(halvings) / after;
        u64::from(self.lineages).div_ceil(1 << done) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lineages_end_at_once_or_half_of_them_at_a_time() {
        let lineages = |halve, lineages| {
            let params = TuningParams {
                lineages,
                one_after: 30,
                halve,
                ..TuningParams::default()
            };
            [0, 9, 10, 20, 29, 30, u64::MAX].map(|iterations| params.lineages_after(iterations))
        };
        assert_eq!(lineages(false, 8), [8, 8, 8, 8, 8, 1, 1]);
        assert_eq!(lineages(true, 8), [8, 8, 4, 2, 2, 1, 1]);
        assert_eq!(lineages(true, 5), [5, 5, 3, 2, 2, 1, 1]);
        assert_eq!(lineages(true, 1), [1; 7]);
        assert_eq!(lineages(true, u32::MAX)[6], 1);
        let all = TuningParams {
            lineages: 3,
            ..TuningParams::default()
        };
        assert_eq!(all.lineages_after(u64::MAX), 3);
    }

    #[test]
    fn noise_and_step_halve_with_every_half_life() {
        let params = TuningParams {
            noise: 0.4,
            step: 0.8,
            half_life: 10,
            ..TuningParams::default()
        };
        let close = |a: f64, b: f64| (a - b).abs() < 1e-12;
        for (iterations, share) in [(0, 1.0), (10, 0.5), (20, 0.25)] {
            let cooled = params.cooled(iterations);
            assert!(close(cooled.noise, 0.4 * share) && close(cooled.step, 0.8 * share));
        }
        assert_eq!(params.cooled(u64::MAX).half_life, 10);
        let warm = TuningParams::default();
        assert_eq!(warm.cooled(1000), warm);
    }
}
