//! InvertedDoublePendulum.

use super::Version;
use super::sim::{Model, Sim, UNSTABLE, control, square};
use crate::task::spec::{ChannelRow, channels, write};
use crate::task::{ActionSpace, Rng, Spec, Step, Task, Terms};
use tpg_runtime::Action;

pub(super) static MODEL: Model = Model::without_contacts(include_str!(concat!(
    env!("TPG_MODELS_DIR"),
    "/inverted_double_pendulum.xml"
)));
const FRAME_SKIP: u32 = 5;
const RESET_NOISE: f64 = 0.1;
/// Observed velocities (m/s, rad/s) and forces (N, N m) are clipped to plus and minus this.
const CLIP: f64 = 10.0;

/// Version 5 lacks the last two.
const INPUTS: [ChannelRow; 11] = [
    ("cart_position", "m", false),
    ("pole_1_sine", "1", false),
    ("pole_2_sine", "1", false),
    ("pole_1_cosine", "1", false),
    ("pole_2_cosine", "1", false),
    ("cart_velocity", "m/s", true),
    ("pole_1_angular_velocity", "rad/s", true),
    ("pole_2_angular_velocity", "rad/s", true),
    ("cart_constraint_force", "N", false),
    ("pole_1_constraint_torque", "N m", false),
    ("pole_2_constraint_torque", "N m", false),
];

/// Two poles, one on top of the other, on a cart that a motor pulls along a rail: Gymnasium's InvertedDoublePendulum.
///
/// The reward of a step is 10 - (0.01x² + (y - 2)²) - (10⁻³ω₁² + 5·10⁻³ω₂²) with the tip at (x, y) (T Eq 3.5.1-3,
/// brackets and squares as in Gymnasium); the episode ends when y ≤ 1. Version 5 leaves out the 10 in that last
/// step, and the two constraint torques of the poles in the observation.
#[derive(Debug)]
pub struct DoublePendulum {
    spec: Spec,
    sim: Sim,
    version: Version,
}

impl DoublePendulum {
    /// Makes the task, upright and at rest.
    #[must_use]
    pub fn new(version: Version) -> Self {
        let (name, inputs) = match version {
            Version::V4 => ("inverted-double-pendulum-v4", INPUTS.len()),
            Version::V5 => ("inverted-double-pendulum-v5", INPUTS.len() - 2),
        };
        let spec = Spec {
            name: name.into(),
            inputs: channels(&INPUTS[..inputs]),
            outputs: channels(&[("cart_force", "500 N", false)]),
            actions: ActionSpace::Continuous {
                len: 1,
                low: -1.0,
                high: 1.0,
            },
            max_steps: 1000,
            period_us: 50_000,
        };
        let mut sim = Sim::new(&MODEL, FRAME_SKIP);
        sim.reset(|_| {});
        Self { spec, sim, version }
    }

    /// Starts an episode from these positions and velocities of the cart and the two hinges (m, rad, m/s, rad/s).
    pub fn set_state(&mut self, positions: [f64; 3], velocities: [f64; 3]) {
        self.sim.reset(|data| {
            data.qpos_mut().copy_from_slice(&positions);
            data.qvel_mut().copy_from_slice(&velocities);
        });
    }
}

impl Task for DoublePendulum {
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
        let data = &self.sim.data;
        let (q, v, f) = (data.qpos(), data.qvel(), data.qfrc_constraint());
        let clip = |x: f64| x.clamp(-CLIP, CLIP);
        let values = [
            q[0],
            q[1].sin(),
            q[2].sin(),
            q[1].cos(),
            q[2].cos(),
            clip(v[0]),
            clip(v[1]),
            clip(v[2]),
            clip(f[0]),
            clip(f[1]),
            clip(f[2]),
        ];
        write(observation, &values[..self.spec.inputs.len()]);
    }

    fn step(&mut self, action: Action<'_>) -> Step {
        if !self.sim.advance(&control::<1>(action)) {
            return UNSTABLE;
        }
        let data = &self.sim.data;
        let ([x, _, y], v) = (data.site_xpos()[0], data.qvel());
        let distance = 0.01 * square(x) + square(y - 2.0);
        let velocity = 1e-3 * square(v[1]) + 5e-3 * square(v[2]);
        let terminated = y <= 1.0;
        let alive = if terminated && self.version == Version::V5 {
            0.0
        } else {
            10.0
        };
        Step {
            reward: alive - distance - velocity,
            terms: Terms {
                alive,
                control: 0.0,
            },
            terminated,
            unstable: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn upright_and_at_rest_the_reward_is_nearly_ten() {
        let mut task = DoublePendulum::new(Version::V4);
        let step = task.step(Action::Continuous(&[0.0]));
        // The tip stands at 1.2 m, 0.8 below the 2 m of the formula.
        assert!((step.reward - (10.0 - 0.64)).abs() < 1e-3, "{step:?}");
        assert!(!step.terminated);
    }

    #[test]
    fn a_fall_ends_the_episode_and_version_5_withholds_the_bonus() {
        let fall = |version| {
            let mut task = DoublePendulum::new(version);
            task.set_state([0.0, 1.0, 1.0], [0.0; 3]);
            task.step(Action::Continuous(&[0.0]))
        };
        let (v4, v5) = (fall(Version::V4), fall(Version::V5));
        assert!(v4.terminated && v5.terminated);
        assert!((v4.reward - v5.reward - 10.0).abs() < 1e-9);
    }

    #[test]
    fn a_lost_state_fails_the_episode_until_the_next_reset() {
        let mut task = DoublePendulum::new(Version::V4);
        task.set_state([0.0; 3], [1e12, 0.0, 0.0]);
        assert_eq!(task.step(Action::Continuous(&[0.0])), UNSTABLE);
        assert_eq!(task.step(Action::Continuous(&[0.0])), UNSTABLE);
        task.reset(&mut Rng::new(1));
        assert!(!task.step(Action::Continuous(&[0.0])).unstable);
        assert!(!std::path::Path::new("MUJOCO_LOG.TXT").exists());
    }

    #[test]
    fn an_action_of_the_wrong_kind_is_no_control() {
        let (mut a, mut b) = (
            DoublePendulum::new(Version::V4),
            DoublePendulum::new(Version::V4),
        );
        assert_eq!(
            a.step(Action::Discrete(1)),
            b.step(Action::Continuous(&[0.0]))
        );
        assert_eq!(
            a.step(Action::Continuous(&[])),
            b.step(Action::Continuous(&[0.0]))
        );
    }
}
