//! Hopper.

use super::Version;
use super::sim::{Model, Sim, UNSTABLE, control};
use crate::task::spec::{channels, write};
use crate::task::{ActionSpace, Rng, Spec, Step, Task, Terms};
use tpg_runtime::Action;

pub(super) static MODEL: Model =
    Model::new(include_str!(concat!(env!("TPG_MODELS_DIR"), "/hopper.xml")));
const FRAME_SKIP: u32 = 4;
const RESET_NOISE: f64 = 5e-3;
/// Observed velocities (m/s, rad/s) are clipped to plus and minus this.
const CLIP: f64 = 10.0;
/// Metres.
const LEAST_HEIGHT: f64 = 0.7;
/// Radians.
const ANGLE_LIMIT: f64 = 0.2;
const STATE_LIMIT: f64 = 100.0;
const HEALTHY_REWARD: f64 = 1.0;
const CONTROL_WEIGHT: f32 = 1e-3;

/// A leg with a torso, a thigh, a shin and a foot that has to hop forwards: Gymnasium's Hopper.
///
/// The reward of a step is the forward velocity of the torso in m/s, plus 1, minus 10⁻³ times the squared norm of the
/// action (T Eq 3.5.4-6). The episode ends when the torso is not above 0.7 m, leans by 0.2 rad or more, or when any
/// element of the state but the first two reaches ±100. Version 5 leaves out the 1 in that last step.
#[derive(Debug)]
pub struct Hopper {
    spec: Spec,
    sim: Sim,
    /// Seconds of one control step.
    period: f64,
    version: Version,
}

impl Hopper {
    /// Makes the task, upright and at rest.
    #[must_use]
    pub fn new(version: Version) -> Self {
        let name = match version {
            Version::V4 => "hopper-v4",
            Version::V5 => "hopper-v5",
        };
        let spec = Spec {
            name: name.into(),
            inputs: channels(&[
                ("torso_height", "m", false),
                ("torso_angle", "rad", false),
                ("thigh_angle", "rad", false),
                ("leg_angle", "rad", false),
                ("foot_angle", "rad", false),
                ("torso_forward_velocity", "m/s", true),
                ("torso_upward_velocity", "m/s", true),
                ("torso_angular_velocity", "rad/s", true),
                ("thigh_angular_velocity", "rad/s", true),
                ("leg_angular_velocity", "rad/s", true),
                ("foot_angular_velocity", "rad/s", true),
            ]),
            outputs: channels(&[
                ("thigh_torque", "200 N m", false),
                ("leg_torque", "200 N m", false),
                ("foot_torque", "200 N m", false),
            ]),
            actions: ActionSpace::Continuous {
                len: 3,
                low: -1.0,
                high: 1.0,
            },
            max_steps: 1000,
            period_us: 8_000,
        };
        let mut sim = Sim::new(&MODEL, FRAME_SKIP);
        sim.reset(|_| {});
        let period = sim.period();
        Self {
            spec,
            sim,
            period,
            version,
        }
    }

    /// Starts an episode from these positions and velocities of the six joints, in the order of the model (m, rad,
    /// m/s, rad/s).
    pub fn set_state(&mut self, positions: [f64; 6], velocities: [f64; 6]) {
        self.sim.reset(|data| {
            data.qpos_mut().copy_from_slice(&positions);
            data.qvel_mut().copy_from_slice(&velocities);
        });
    }

    fn healthy(&self) -> bool {
        let (q, v) = (self.sim.data.qpos(), self.sim.data.qvel());
        let within = |limit: f64| move |x: &f64| -limit < *x && *x < limit;
        q[2..].iter().chain(v).all(within(STATE_LIMIT))
            && q[1] > LEAST_HEIGHT
            && within(ANGLE_LIMIT)(&q[2])
    }
}

impl Task for Hopper {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn reset(&mut self, rng: &mut Rng) {
        self.sim.reset(|data| {
            for position in data.qpos_mut() {
                *position += rng.uniform(-RESET_NOISE, RESET_NOISE);
            }
            for velocity in data.qvel_mut() {
                *velocity += rng.uniform(-RESET_NOISE, RESET_NOISE);
            }
        });
    }

    fn observe(&self, observation: &mut [f32]) {
        let (q, v) = (self.sim.data.qpos(), self.sim.data.qvel());
        let mut values = [0.0; 11];
        values[..5].copy_from_slice(&q[1..]);
        for (value, v) in values[5..].iter_mut().zip(v) {
            *value = v.clamp(-CLIP, CLIP);
        }
        write(observation, &values);
    }

    fn step(&mut self, action: Action<'_>) -> Step {
        let control = control::<3>(action);
        let before = self.sim.data.qpos()[0];
        if !self.sim.advance(&control) {
            return UNSTABLE;
        }
        let forward = (self.sim.data.qpos()[0] - before) / self.period;
        let healthy = self.healthy();
        let alive = if healthy || self.version == Version::V4 {
            HEALTHY_REWARD
        } else {
            0.0
        };
        // In f32, the type of the actions of Gymnasium's action space.
        let cost = CONTROL_WEIGHT * control.iter().fold(0.0, |sum, x| sum + x * x);
        Step {
            reward: forward + alive - f64::from(cost),
            terms: Terms {
                alive,
                control: f64::from(cost),
            },
            terminated: !healthy,
            unstable: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn standing_earns_the_bonus_less_the_cost_of_control() {
        let reward = |action: &[f32]| {
            Hopper::new(Version::V4)
                .step(Action::Continuous(action))
                .reward
        };
        assert!((reward(&[0.0; 3]) - 1.0).abs() < 0.05);
        // The motors of thigh, leg and foot at full power cost 3 · 10⁻³, on top of what they do to the velocity.
        let mut task = Hopper::new(Version::V4);
        let before = task.sim.data.qpos()[0];
        let step = task.step(Action::Continuous(&[1.0, -1.0, 1.0]));
        let forward = (task.sim.data.qpos()[0] - before) / 0.008;
        assert!((step.reward - (forward + 1.0 - 3e-3)).abs() < 1e-9);
    }

    #[test]
    fn an_unhealthy_state_ends_the_episode_and_version_5_withholds_the_bonus() {
        let step = |version, height, angle| {
            let mut task = Hopper::new(version);
            task.set_state([0.0, height, angle, 0.0, 0.0, 0.0], [0.0; 6]);
            task.step(Action::Continuous(&[0.0; 3]))
        };
        assert!(!step(Version::V4, 1.25, 0.15).terminated);
        assert!(step(Version::V4, 1.25, 0.25).terminated);
        assert!(step(Version::V4, 1.25, -0.25).terminated);
        assert!(step(Version::V4, 0.6, 0.0).terminated);
        let difference =
            step(Version::V4, 1.25, 0.25).reward - step(Version::V5, 1.25, 0.25).reward;
        assert!((difference - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_lost_state_fails_the_episode_until_the_next_reset() {
        let mut task = Hopper::new(Version::V4);
        task.set_state(
            [0.0, 1.25, 0.0, 0.0, 0.0, 0.0],
            [0.0, 1e12, 0.0, 0.0, 0.0, 0.0],
        );
        assert_eq!(task.step(Action::Continuous(&[0.0; 3])), UNSTABLE);
        let next = |task: &mut Hopper| {
            task.reset(&mut Rng::new(1));
            task.step(Action::Continuous(&[0.5; 3]))
        };
        let (ours, fresh) = (next(&mut task), next(&mut Hopper::new(Version::V4)));
        assert_eq!(ours.reward.to_bits(), fresh.reward.to_bits());
        assert!(!ours.unstable);
    }
}
