//! The interface of every task.

use std::fmt;

use super::Rng;
use super::scene::{Pose, Scene};
use tpg_runtime::Action;
use tpg_runtime::tables::Range;

/// What a task is, apart from its physics.
#[derive(Debug, Clone, PartialEq)]
pub struct Spec {
    /// Full name, which ends in a version that changes whenever results can change, such as `hopper-v4`.
    pub name: String,
    /// The elements of the observation, in order.
    pub inputs: Vec<Channel>,
    /// The values that the action sets, in order; for a discrete task one channel, the action's index.
    pub outputs: Vec<Channel>,
    /// The actions that the task accepts.
    pub actions: ActionSpace,
    /// Steps after which the caller ends an episode that did not end by itself.
    pub max_steps: u32,
    /// Simulated time between two decisions, in microseconds.
    pub period_us: u32,
}

/// One element of an observation or of an action.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// What the value is, in lower case with underscores.
    pub name: String,
    /// What 1.0 stands for, such as `m/s`, or `200 N m` for a motor driven by a number from -1 to 1; `index` for an
    /// action's index.
    pub unit: String,
    /// Whether the value is a velocity, which [`Observability::VelocitiesRemoved`](super::Observability) hides.
    pub velocity: bool,
    /// The values that it can have, in its unit. `None` if nothing is known of an input, and if an output has the range of
    /// [`ActionSpace::Continuous`]. The range of an input is information: nothing holds it to that.
    pub range: Option<Range>,
}

/// The actions that a task accepts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ActionSpace {
    /// An index below this number.
    Discrete(u16),
    /// Several values, each within this range, or within a narrower one of its [`Channel`].
    Continuous {
        /// How many values an action has.
        len: u16,
        /// The least value of each.
        low: f32,
        /// The greatest value of each.
        high: f32,
    },
}

impl fmt::Display for ActionSpace {
    /// In words, such as `one of 3 actions` or `6 values from -1 to 1`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Discrete(count) => write!(f, "one of {count} actions"),
            Self::Continuous { len: 1, low, high } => write!(f, "1 value from {low} to {high}"),
            Self::Continuous { len, low, high } => write!(f, "{len} values from {low} to {high}"),
        }
    }
}

/// The outcome of one control step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Reward of this step; 0 when the simulation became unstable.
    pub reward: f64,
    /// The terms of the reward that training may weight differently.
    pub terms: Terms,
    /// Whether the episode ended here, by failure or by success; reaching [`Spec::max_steps`] is the caller's to see.
    pub terminated: bool,
    /// Whether the simulator lost the state, so that the episode failed and its state means nothing.
    pub unstable: bool,
}

/// Terms of a step's reward: reward = progress + alive − control.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Terms {
    /// What the step earned for not having failed.
    pub alive: f64,
    /// What it paid for control.
    pub control: f64,
}

/// Whether a described task differs from episode to episode as its file says: its `[randomize]`, and the `offset` of its
/// observations. No built-in task does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Randomization {
    /// As the file says.
    #[default]
    On,
    /// All episodes have the model as its file has it, and true observations.
    Off,
}

/// The state of MuJoCo's simulation of a robot.
#[cfg(feature = "render")]
pub type Simulation = mujoco_rs::prelude::MjData<std::sync::Arc<mujoco_rs::prelude::MjModel>>;

/// A plant that a policy controls.
///
/// `reset` and `step` never allocate, lock or log after the first use of a task in a process.
pub trait Task: Send {
    /// What the task is.
    fn spec(&self) -> &Spec;

    /// Starts an episode from a random initial state, leaving nothing of the last one.
    ///
    /// An instance that was used before and a fresh one give the same bits afterwards.
    fn reset(&mut self, rng: &mut Rng);

    /// Writes the observation, one value for each of [`Spec::inputs`].
    ///
    /// Each value is computed in f64 and rounded once; a value that f32 cannot hold as a finite number becomes 0. Of
    /// a slice that is too short or too long only the common part is written.
    fn observe(&self, observation: &mut [f32]);

    /// Advances the plant by one control period under an action within [`Spec::actions`].
    ///
    /// An action of the wrong kind counts as zeros in a continuous task, and as index 0 in a discrete one.
    fn step(&mut self, action: Action<'_>) -> Step;

    /// Another plant of this task, to run an episode beside this one; `None` where a step takes so long that episodes gain
    /// nothing from deciding in lock-step.
    fn twin(&self) -> Option<Box<dyn Task>> {
        None
    }

    /// The part of a series that training may see, if the task asks to continue one: what is observed, in order.
    fn known_series(&self) -> Option<&[f64]> {
        None
    }

    /// Why the last [`step`](Self::step) was [`unstable`](Step::unstable), such as `BADQACC at DOF 0 (joint "hip"), step 1`,
    /// with the control step counted from 1; `None` where it was not, or where the task cannot become unstable.
    fn instability(&self) -> Option<String> {
        None
    }

    /// What the task looks like; nothing where that is not known.
    fn scene(&self) -> Scene {
        Scene::default()
    }

    /// The state of MuJoCo's simulation, for MuJoCo's own renderer; `None` where the task is computed here.
    #[cfg(feature = "render")]
    fn simulation(&self) -> Option<&Simulation> {
        None
    }

    /// Appends where each solid of [`scene`](Self::scene) is now. Changes nothing of the task.
    fn poses(&self, poses: &mut Vec<Pose>) {
        let _ = poses;
    }
}

/// One row of a table of channels: name, unit, whether it is a velocity.
pub(super) type ChannelRow = (&'static str, &'static str, bool);

/// Turns a table of channels into the form that [`Spec`] has.
pub(super) fn channels(rows: &[ChannelRow]) -> Vec<Channel> {
    let channel = |&(name, unit, velocity): &ChannelRow| Channel {
        name: name.into(),
        unit: unit.into(),
        velocity,
        range: None,
    };
    rows.iter().map(channel).collect()
}

/// Writes values as an observation, by the rule of [`Task::observe`].
pub(super) fn write(observation: &mut [f32], values: &[f64]) {
    for (out, &value) in observation.iter_mut().zip(values) {
        *out = round(value);
    }
}

/// Rounds one value by the rule of [`Task::observe`].
pub(crate) fn round(value: f64) -> f32 {
    let rounded = value as f32;
    if rounded.is_finite() { rounded } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn non_finite_values_are_observed_as_zero() {
        let mut observation = [1.0; 5];
        write(
            &mut observation,
            &[f64::NAN, f64::INFINITY, 1e300, 0.1, -2.0],
        );
        assert_eq!(
            observation.map(f32::to_bits),
            [0.0, 0.0, 0.0, 0.1, -2.0f32].map(f32::to_bits)
        );
    }
}
