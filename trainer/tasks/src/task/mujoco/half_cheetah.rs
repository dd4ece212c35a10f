//! HalfCheetah.

use super::Version;
use super::sim::{Model, Sim, UNSTABLE, control};
use crate::task::spec::{channels, write};
use crate::task::{ActionSpace, Rng, Spec, Step, Task, Terms};
use tpg_runtime::Action;

pub(super) static MODEL: Model = Model::new(include_str!(concat!(
    env!("TPG_MODELS_DIR"),
    "/half_cheetah.xml"
)));
const FRAME_SKIP: u32 = 5;
const RESET_NOISE: f64 = 0.1;
const CONTROL_WEIGHT: f32 = 0.1;

/// A planar runner with a front and a back leg that has to run forwards: Gymnasium's HalfCheetah.
///
/// The reward of a step is the forward velocity of the torso in m/s, minus 0.1 times the squared norm of the action
/// (T Eq 3.5.7). The episode never ends by itself. Versions 4 and 5 differ in name alone.
#[derive(Debug)]
pub struct HalfCheetah {
    spec: Spec,
    sim: Sim,
    /// Seconds of one control step.
    period: f64,
}

impl HalfCheetah {
    /// Makes the task, standing and at rest.
    #[must_use]
    pub fn new(version: Version) -> Self {
        let name = match version {
            Version::V4 => "half-cheetah-v4",
            Version::V5 => "half-cheetah-v5",
        };
        let spec = Spec {
            name: name.into(),
            inputs: channels(&[
                ("torso_height", "m", false),
                ("torso_angle", "rad", false),
                ("back_thigh_angle", "rad", false),
                ("back_shin_angle", "rad", false),
                ("back_foot_angle", "rad", false),
                ("front_thigh_angle", "rad", false),
                ("front_shin_angle", "rad", false),
                ("front_foot_angle", "rad", false),
                ("torso_forward_velocity", "m/s", true),
                ("torso_upward_velocity", "m/s", true),
                ("torso_angular_velocity", "rad/s", true),
                ("back_thigh_angular_velocity", "rad/s", true),
                ("back_shin_angular_velocity", "rad/s", true),
                ("back_foot_angular_velocity", "rad/s", true),
                ("front_thigh_angular_velocity", "rad/s", true),
                ("front_shin_angular_velocity", "rad/s", true),
                ("front_foot_angular_velocity", "rad/s", true),
            ]),
            outputs: channels(&[
                ("back_thigh_torque", "120 N m", false),
                ("back_shin_torque", "90 N m", false),
                ("back_foot_torque", "60 N m", false),
                ("front_thigh_torque", "120 N m", false),
                ("front_shin_torque", "60 N m", false),
                ("front_foot_torque", "30 N m", false),
            ]),
            actions: ActionSpace::Continuous {
                len: 6,
                low: -1.0,
                high: 1.0,
            },
            max_steps: 1000,
            period_us: 50_000,
        };
        let mut sim = Sim::new(&MODEL, FRAME_SKIP);
        sim.reset(|_| {});
        let period = sim.period();
        Self { spec, sim, period }
    }

    /// Starts an episode from these positions and velocities of the nine joints, in the order of the model (m, rad,
    /// m/s, rad/s).
    pub fn set_state(&mut self, positions: [f64; 9], velocities: [f64; 9]) {
        self.sim.reset(|data| {
            data.qpos_mut().copy_from_slice(&positions);
            data.qvel_mut().copy_from_slice(&velocities);
        });
    }
}

impl Task for HalfCheetah {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn reset(&mut self, rng: &mut Rng) {
        self.sim.reset(|data| {
            for position in data.qpos_mut() {
                *position += rng.uniform(-RESET_NOISE, RESET_NOISE);
            }
            for velocity in data.qvel_mut() {
                *velocity += rng.normal() * RESET_NOISE;
            }
        });
    }

    fn observe(&self, observation: &mut [f32]) {
        let (q, v) = (self.sim.data.qpos(), self.sim.data.qvel());
        let mut values = [0.0; 17];
        values[..8].copy_from_slice(&q[1..]);
        values[8..].copy_from_slice(v);
        write(observation, &values);
    }

    fn step(&mut self, action: Action<'_>) -> Step {
        let control = control::<6>(action);
        let before = self.sim.data.qpos()[0];
        if !self.sim.advance(&control) {
            return UNSTABLE;
        }
        let forward = (self.sim.data.qpos()[0] - before) / self.period;
        // In f32, the type of the actions of Gymnasium's action space.
        let cost = CONTROL_WEIGHT * control.iter().fold(0.0, |sum, x| sum + x * x);
        Step {
            reward: forward - f64::from(cost),
            terms: Terms {
                alive: 0.0,
                control: f64::from(cost),
            },
            terminated: false,
            unstable: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reward_is_the_velocity_less_the_cost_of_control() {
        let mut task = HalfCheetah::new(Version::V4);
        let before = task.sim.data.qpos()[0];
        let step = task.step(Action::Continuous(&[1.0, -1.0, 1.0, -1.0, 1.0, -1.0]));
        let forward = (task.sim.data.qpos()[0] - before) / 0.05;
        assert!((step.reward - (forward - 0.6)).abs() < 1e-7, "{step:?}");
        assert!(!step.terminated);
    }

    #[test]
    fn lying_on_its_back_does_not_end_the_episode() {
        let mut task = HalfCheetah::new(Version::V5);
        let mut positions = [0.0; 9];
        positions[2] = std::f64::consts::PI;
        task.set_state(positions, [0.0; 9]);
        for _ in 0..100 {
            let step = task.step(Action::Continuous(&[0.0; 6]));
            assert!(!step.terminated && !step.unstable);
        }
    }

    #[test]
    fn a_lost_state_fails_the_episode_until_the_next_reset() {
        let mut task = HalfCheetah::new(Version::V4);
        task.set_state([0.0; 9], [1e12; 9]);
        assert_eq!(task.step(Action::Continuous(&[0.0; 6])), UNSTABLE);
        let next = |task: &mut HalfCheetah| {
            task.reset(&mut Rng::new(1));
            task.step(Action::Continuous(&[0.5; 6]))
        };
        let (ours, fresh) = (next(&mut task), next(&mut HalfCheetah::new(Version::V4)));
        assert_eq!(ours.reward.to_bits(), fresh.reward.to_bits());
        assert!(!ours.unstable);
    }
}
