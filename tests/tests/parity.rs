//! The tasks compute what Gymnasium computes.
//!
//! `scripts/parity.py` wrote the trajectories in `golden/parity`; `scripts/parity` writes far more of them and runs
//! this test on those, with their folder in `TPG_PARITY_DIR`.
//!
//! MuJoCo's robots are replayed from their initial state and compared in every bit, on the platform where the
//! trajectories were made. CartPole, Acrobot and Pendulum are compared step by step, to a rounding error: their sine
//! comes from `libm` here and from NumPy there.

use serde::Deserialize;
use std::{env, fs, path::PathBuf};
use tpg_runtime::Action;
use tpg_tasks::task::{Acrobot, CartPole, Pendulum, Task};

/// One line of a trajectory file.
#[derive(Deserialize)]
struct Episode<A> {
    seed: u64,
    /// Tasks computed here: the state before each step and after the last.
    #[serde(default)]
    states: Vec<Vec<f64>>,
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

/// An action as a trajectory holds it.
trait Taken: for<'a> Deserialize<'a> {
    fn action(&self) -> Action<'_>;
}

impl Taken for u16 {
    fn action(&self) -> Action<'_> {
        Action::Discrete(*self)
    }
}

impl Taken for Vec<f32> {
    fn action(&self) -> Action<'_> {
        Action::Continuous(self)
    }
}

/// How far a task computed here may be from Gymnasium after one step.
struct Tolerance {
    state: f64,
    observation: f64,
    reward: f64,
}

/// Replays a task that is computed here, each step from Gymnasium's own state; returns how many steps ended an episode.
fn replay_steps<A: Taken, T: Task, const N: usize>(
    task: &mut T,
    set_state: impl Fn(&mut T, [f64; N]),
    state: impl Fn(&T) -> [f64; N],
    tolerance: &Tolerance,
) -> usize {
    let name = task.spec().name.clone();
    let (mut states, mut observations) = (Tally::default(), Tally::default());
    let mut rewards = Tally::default();
    let mut ends = 0;
    for episode in episodes::<A>(&name) {
        let seed = episode.seed;
        let states_before: Vec<[f64; N]> = episode
            .states
            .iter()
            .map(|state| state.as_slice().try_into().expect("length of the state"))
            .collect();
        set_state(task, states_before[0]);
        observations.step(seed, 0, pairs(&observe(task), &episode.start));
        for (t, taken) in episode.actions.iter().enumerate() {
            set_state(task, states_before[t]);
            let step = task.step(taken.action());
            let after = states_before[t + 1];
            states.step(seed, t + 1, state(task).into_iter().zip(after));
            let observed = observe(task);
            observations.step(seed, t + 1, pairs(&observed, &episode.observations[t]));
            rewards.step(seed, t + 1, [(step.reward, episode.rewards[t])]);
            let end = episode.terminated[t];
            assert_eq!(step.terminated, end, "end, seed {seed}, step {t}");
            ends += usize::from(step.terminated);
        }
    }
    states.print(&format!("{name}, state"));
    observations.print(&format!("{name}, observation"));
    rewards.print(&format!("{name}, reward"));
    assert!(states.largest <= tolerance.state, "state");
    assert!(observations.largest <= tolerance.observation, "observation");
    assert!(rewards.largest <= tolerance.reward, "reward");
    ends
}

#[test]
fn cartpole_differs_by_no_more_than_rounding() {
    let tolerance = Tolerance {
        // Two units in the last place of the greatest numbers that occur, below 4 in magnitude.
        state: 1e-15,
        // One unit in the last place of an f32 below 4: where a difference in f64 tips the rounding.
        observation: 2.4e-7,
        reward: 0.0,
    };
    let mut task = CartPole::new();
    let (set_state, state) = (CartPole::set_state, CartPole::state);
    let ends = replay_steps::<u16, _, _>(&mut task, set_state, state, &tolerance);
    assert!(ends > 0, "no episode ended, so the ends were not compared");
}

#[test]
fn acrobot_differs_by_no_more_than_rounding() {
    let tolerance = Tolerance {
        // Four units in the last place of the greatest velocities, below 32.
        state: 1.5e-14,
        // One unit in the last place of an f32 below 32.
        observation: 2e-6,
        reward: 0.0,
    };
    let mut task = Acrobot::new();
    let (set_state, state) = (Acrobot::set_state, Acrobot::state);
    let ends = replay_steps::<u16, _, _>(&mut task, set_state, state, &tolerance);
    assert!(ends > 0, "no episode ended, so the ends were not compared");
}

#[test]
fn pendulum_differs_by_no_more_than_rounding() {
    let tolerance = Tolerance {
        // Two units in the last place of angles below 64.
        state: 1.5e-14,
        // One unit in the last place of an f32 up to 8.
        observation: 4.8e-7,
        // One unit in the last place of the f32 cost of a torque, below 0.004: NumPy squares it by C's `powf`.
        reward: 2.4e-10,
    };
    let mut task = Pendulum::new();
    let (set_state, state) = (Pendulum::set_state, Pendulum::state);
    let ends = replay_steps::<Vec<f32>, _, _>(&mut task, set_state, state, &tolerance);
    assert_eq!(ends, 0);
}

#[cfg(feature = "mujoco")]
mod robots {
    use super::*;
    use tpg_tasks::task::mujoco::Robot;

    /// Where MuJoCo and the C library are those that made the golden trajectories, and so every bit counts.
    const EXACT: bool = cfg!(all(target_os = "linux", target_arch = "x86_64"));
    /// Elsewhere rounding errors grow with time: how long they are followed, and how far they may grow.
    const STEPS_ELSEWHERE: usize = 20;
    const TOLERANCE_ELSEWHERE: f64 = 1e-4;

    /// Replays whole episodes; returns how many steps ended one.
    fn replay(name: &str) -> usize {
        let mut tally = Tally::default();
        let mut ends = 0;
        for episode in episodes::<Vec<f32>>(name) {
            let seed = episode.seed;
            let mut task = Robot::builtin(name);
            task.set_state(&episode.qpos, &episode.qvel);
            assert_eq!(task.spec().name, name);
            tally.step(seed, 0, pairs(&observe(&task), &episode.start));
            let steps = if EXACT {
                episode.actions.len()
            } else {
                STEPS_ELSEWHERE.min(episode.actions.len())
            };
            for (t, action) in episode.actions[..steps].iter().enumerate() {
                let step = task.step(Action::Continuous(action));
                let mut compared = pairs(&observe(&task), &episode.observations[t]);
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
        if EXACT {
            assert_eq!(tally.differing, 0, "{name}: steps with a differing bit");
        } else {
            assert!(
                tally.largest <= TOLERANCE_ELSEWHERE,
                "{name}: {}{}",
                tally.largest,
                tally.where_largest
            );
        }
        ends
    }

    #[test]
    fn inverted_double_pendulum_is_gymnasiums() {
        let v4 = replay("inverted-double-pendulum-v4");
        let v5 = replay("inverted-double-pendulum-v5");
        assert!(v4 > 0 && v5 > 0, "the ends were not compared");
    }

    #[test]
    fn hopper_is_gymnasiums() {
        let v4 = replay("hopper-v4");
        let v5 = replay("hopper-v5");
        assert!(v4 > 0 && v5 > 0, "the ends were not compared");
    }

    #[test]
    fn half_cheetah_is_gymnasiums() {
        let v4 = replay("half-cheetah-v4");
        let v5 = replay("half-cheetah-v5");
        assert_eq!((v4, v5), (0, 0));
    }

    #[test]
    fn inverted_pendulum_is_gymnasiums() {
        let (v4, v5) = (
            replay("inverted-pendulum-v4"),
            replay("inverted-pendulum-v5"),
        );
        assert!(v4 > 0 && v5 > 0, "the ends were not compared");
    }

    #[test]
    fn walker_is_gymnasiums() {
        let (v4, v5) = (replay("walker2d-v4"), replay("walker2d-v5"));
        assert!(v4 > 0 && v5 > 0, "the ends were not compared");
    }

    #[test]
    fn swimmer_is_gymnasiums() {
        assert_eq!((replay("swimmer-v4"), replay("swimmer-v5")), (0, 0));
    }

    #[test]
    fn reacher_is_gymnasiums() {
        assert_eq!((replay("reacher-v4"), replay("reacher-v5")), (0, 0));
    }

    #[test]
    fn pusher_is_gymnasiums() {
        assert_eq!(replay("pusher-v5"), 0);
    }

    #[test]
    fn ant_is_gymnasiums() {
        replay("ant-v4");
        replay("ant-v5");
    }

    #[test]
    fn humanoid_is_gymnasiums() {
        replay("humanoid-v4");
        replay("humanoid-v5");
    }

    #[test]
    fn humanoid_standup_is_gymnasiums() {
        assert_eq!(
            (replay("humanoid-standup-v4"), replay("humanoid-standup-v5")),
            (0, 0)
        );
    }
}
