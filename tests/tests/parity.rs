//! The tasks compute what Gymnasium computes.
//!
//! `scripts/parity.py` wrote the trajectories in `golden/parity`; `scripts/parity` writes far more of them and runs
//! this test on those, with their folder in `TPG_PARITY_DIR`.
//!
//! MuJoCo's robots are replayed from their initial state and compared in every bit, on the platform where the
//! trajectories were made. CartPole is compared step by step, to a rounding error: its sine comes from `libm` here and
//! from NumPy there.

use serde::Deserialize;
use std::{env, fs, path::PathBuf};
use tpg_runtime::Action;
use tpg_trainer::task::{CartPole, Task};

/// One line of a trajectory file.
#[derive(Deserialize)]
struct Episode<A> {
    seed: u64,
    /// CartPole: the state before each step and after the last.
    #[serde(default)]
    states: Vec<[f64; 4]>,
    /// The robots: initial positions and velocities.
    #[cfg(feature = "mujoco")]
    #[serde(default)]
    qpos: Vec<f64>,
    #[cfg(feature = "mujoco")]
    #[serde(default)]
    qvel: Vec<f64>,
    start: Vec<f32>,
    actions: Vec<A>,
    observations: Vec<Vec<f32>>,
    rewards: Vec<f64>,
    terminated: Vec<bool>,
}

fn episodes<A: for<'a> Deserialize<'a>>(task: &str) -> Vec<Episode<A>> {
    let golden = || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/golden/parity"));
    let path = env::var_os("TPG_PARITY_DIR")
        .map_or_else(golden, PathBuf::from)
        .join(format!("{task}.jsonl"));
    let text =
        fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let line = |text| {
        serde_json::from_str(text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    };
    let episodes: Vec<_> = text.lines().map(line).collect();
    assert!(!episodes.is_empty(), "{} is empty", path.display());
    episodes
}

/// How far a task was from Gymnasium.
#[derive(Default)]
struct Tally {
    steps: usize,
    differing: usize,
    largest: f64,
    where_largest: String,
}

impl Tally {
    /// Counts one step by its pairs of ours and Gymnasium's; step 0 is the initial observation.
    fn step(&mut self, seed: u64, t: usize, pairs: impl IntoIterator<Item = (f64, f64)>) {
        let mut differs = false;
        for (ours, theirs) in pairs {
            differs |= ours.to_bits() != theirs.to_bits();
            let difference = (ours - theirs).abs();
            // A NaN is further away than anything.
            if difference > self.largest || difference.is_nan() {
                self.largest = if difference.is_nan() {
                    f64::INFINITY
                } else {
                    difference
                };
                self.where_largest = format!(" (seed {seed}, step {t})");
            }
        }
        self.steps += usize::from(t > 0);
        self.differing += usize::from(differs);
    }

    fn print(&self, task: &str) {
        let Self {
            steps,
            differing,
            largest,
            where_largest,
        } = self;
        println!(
            "{task}: {steps} steps, {differing} with a differing bit, largest difference {largest:e}{where_largest}"
        );
    }
}

/// Pairs of observations, one longer than the other if their lengths differ.
fn pairs(ours: &[f32], theirs: &[f32]) -> Vec<(f64, f64)> {
    assert_eq!(ours.len(), theirs.len(), "length of the observation");
    ours.iter()
        .zip(theirs)
        .map(|(&a, &b)| (f64::from(a), f64::from(b)))
        .collect()
}

fn observe(task: &dyn Task) -> Vec<f32> {
    let mut observation = vec![f32::NAN; task.spec().inputs.len()];
    task.observe(&mut observation);
    observation
}

#[test]
fn cartpole_differs_by_no_more_than_rounding() {
    /// Two units in the last place of the greatest numbers that occur, below 4 in magnitude.
    const STATE_TOLERANCE: f64 = 1e-15;
    /// One unit in the last place of an f32 below 4: where a difference in f64 tips the rounding.
    const OBSERVATION_TOLERANCE: f64 = 2.4e-7;

    let (mut states, mut observations) = (Tally::default(), Tally::default());
    let mut ends = 0;
    for episode in episodes::<u16>("cartpole-v1") {
        let seed = episode.seed;
        let mut task = CartPole::new();
        task.set_state(episode.states[0]);
        observations.step(seed, 0, pairs(&observe(&task), &episode.start));
        for (t, &action) in episode.actions.iter().enumerate() {
            task.set_state(episode.states[t]);
            let step = task.step(Action::Discrete(action));
            states.step(
                seed,
                t + 1,
                task.state().into_iter().zip(episode.states[t + 1]),
            );
            observations.step(
                seed,
                t + 1,
                pairs(&observe(&task), &episode.observations[t]),
            );
            assert_eq!(
                step.reward.to_bits(),
                episode.rewards[t].to_bits(),
                "reward, seed {seed}, step {t}"
            );
            assert_eq!(
                step.terminated, episode.terminated[t],
                "end, seed {seed}, step {t}"
            );
            ends += usize::from(step.terminated);
        }
    }
    states.print("cartpole-v1, state");
    observations.print("cartpole-v1, observation");
    assert!(ends > 0, "no episode ended, so the ends were not compared");
    assert!(states.largest <= STATE_TOLERANCE && observations.largest <= OBSERVATION_TOLERANCE);
}

#[cfg(feature = "mujoco")]
mod robots {
    use super::*;
    use tpg_trainer::task::mujoco::{DoublePendulum, Hopper, Version};

    /// Where MuJoCo and the C library are those that made the golden trajectories, and so every bit counts.
    const EXACT: bool = cfg!(all(target_os = "linux", target_arch = "x86_64"));
    /// Elsewhere rounding errors grow with time: how long they are followed, and how far they may grow.
    const STEPS_ELSEWHERE: usize = 20;
    const TOLERANCE_ELSEWHERE: f64 = 1e-4;

    fn replay(name: &str, start: impl Fn(&[f64], &[f64]) -> Box<dyn Task>) {
        let mut tally = Tally::default();
        let mut ends = 0;
        for episode in episodes::<Vec<f32>>(name) {
            let seed = episode.seed;
            let mut task = start(&episode.qpos, &episode.qvel);
            assert_eq!(task.spec().name, name);
            tally.step(seed, 0, pairs(&observe(&*task), &episode.start));
            let steps = if EXACT {
                episode.actions.len()
            } else {
                STEPS_ELSEWHERE.min(episode.actions.len())
            };
            for (t, action) in episode.actions[..steps].iter().enumerate() {
                let step = task.step(Action::Continuous(action));
                let mut compared = pairs(&observe(&*task), &episode.observations[t]);
                compared.push((step.reward, episode.rewards[t]));
                tally.step(seed, t + 1, compared);
                assert!(!step.unstable, "unstable, seed {seed}, step {t}");
                assert_eq!(
                    step.terminated, episode.terminated[t],
                    "end, seed {seed}, step {t}"
                );
                ends += usize::from(step.terminated);
            }
        }
        tally.print(name);
        assert!(ends > 0, "no episode ended, so the ends were not compared");
        if EXACT {
            assert_eq!(tally.differing, 0, "steps with a differing bit");
        } else {
            assert!(
                tally.largest <= TOLERANCE_ELSEWHERE,
                "{}{}",
                tally.largest,
                tally.where_largest
            );
        }
    }

    fn double_pendulum(version: Version) -> impl Fn(&[f64], &[f64]) -> Box<dyn Task> {
        move |positions, velocities| {
            let mut task = DoublePendulum::new(version);
            task.set_state(
                positions.try_into().expect("3 positions"),
                velocities.try_into().expect("3 velocities"),
            );
            Box::new(task)
        }
    }

    fn hopper(version: Version) -> impl Fn(&[f64], &[f64]) -> Box<dyn Task> {
        move |positions, velocities| {
            let mut task = Hopper::new(version);
            task.set_state(
                positions.try_into().expect("6 positions"),
                velocities.try_into().expect("6 velocities"),
            );
            Box::new(task)
        }
    }

    #[test]
    fn inverted_double_pendulum_v4_is_gymnasiums() {
        replay("inverted-double-pendulum-v4", double_pendulum(Version::V4));
    }

    #[test]
    fn inverted_double_pendulum_v5_is_gymnasiums() {
        replay("inverted-double-pendulum-v5", double_pendulum(Version::V5));
    }

    #[test]
    fn hopper_v4_is_gymnasiums() {
        replay("hopper-v4", hopper(Version::V4));
    }

    #[test]
    fn hopper_v5_is_gymnasiums() {
        replay("hopper-v5", hopper(Version::V5));
    }
}
