//! CartPole, computed here: the same bits on every machine.

use super::scene::{DRIVEN, FOLLOWING, Form, Pose, STILL, Scene, solid};
use super::spec::{channels, write};
use super::{ActionSpace, Rng, Spec, Step, Task, Terms};
use std::f64::consts::PI;
use tpg_runtime::Action;

// Gymnasium 1.4.0, classic_control/cartpole.py; the derived ones by the same operations in the same order.
const GRAVITY: f64 = 9.8;
const CART_MASS: f64 = 1.0;
const POLE_MASS: f64 = 0.1;
const TOTAL_MASS: f64 = POLE_MASS + CART_MASS;
/// Half of the pole's length, in metres.
const LENGTH: f64 = 0.5;
const POLE_MASS_LENGTH: f64 = POLE_MASS * LENGTH;
/// Newtons.
const FORCE: f64 = 10.0;
/// All of the reward is for not having failed.
const ALIVE: Terms = Terms {
    alive: 1.0,
    control: 0.0,
};
/// Seconds.
const PERIOD: f64 = 0.02;
/// Twelve degrees, in radians.
const ANGLE_LIMIT: f64 = 12.0 * 2.0 * PI / 360.0;
/// Metres.
const POSITION_LIMIT: f64 = 2.4;
const RESET_NOISE: f64 = 0.05;

/// A pole on a cart that a push to the left or to the right has to keep upright: Gymnasium's CartPole-v1 (T §2.4.1).
///
/// Explicit Euler in f64; sine and cosine come from the crate `libm`, so that the results do not depend on the
/// machine's C library. The reward is 1 in every step, the one of the fall included.
#[derive(Debug, Clone)]
pub struct CartPole {
    spec: Spec,
    state: [f64; 4],
}

impl CartPole {
    /// Makes the task, upright and at rest.
    #[must_use]
    pub fn new() -> Self {
        let spec = Spec {
            name: "cartpole-v1".into(),
            inputs: channels(&[
                ("cart_position", "m", false),
                ("cart_velocity", "m/s", true),
                ("pole_angle", "rad", false),
                ("pole_angular_velocity", "rad/s", true),
            ]),
            outputs: channels(&[("push", "index", false)]),
            actions: ActionSpace::Discrete(2),
            max_steps: 500,
            period_us: 20_000,
        };
        Self {
            spec,
            state: [0.0; 4],
        }
    }

    /// The cart's position and velocity, the pole's angle and angular velocity, in SI units.
    #[must_use]
    pub fn state(&self) -> [f64; 4] {
        self.state
    }

    /// Starts from a state, given as [`state`](Self::state) returns it.
    pub fn set_state(&mut self, state: [f64; 4]) {
        self.state = state;
    }
}

impl Default for CartPole {
    fn default() -> Self {
        Self::new()
    }
}

impl Task for CartPole {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn twin(&self) -> Option<Box<dyn Task>> {
        Some(Box::new(self.clone()))
    }

    fn reset(&mut self, rng: &mut Rng) {
        self.state = std::array::from_fn(|_| rng.uniform(-RESET_NOISE, RESET_NOISE));
    }

    fn observe(&self, observation: &mut [f32]) {
        write(observation, &self.state);
    }

    fn step(&mut self, action: Action<'_>) -> Step {
        let force = if action == Action::Discrete(1) {
            FORCE
        } else {
            -FORCE
        };
        let [x, v, angle, omega] = self.state;
        let (sin, cos) = (libm::sin(angle), libm::cos(angle));
        let temp = (force + POLE_MASS_LENGTH * (omega * omega) * sin) / TOTAL_MASS;
        let angular_acceleration = (GRAVITY * sin - cos * temp)
            / (LENGTH * (4.0 / 3.0 - POLE_MASS * (cos * cos) / TOTAL_MASS));
        let acceleration = temp - POLE_MASS_LENGTH * angular_acceleration * cos / TOTAL_MASS;
        self.state = [
            x + PERIOD * v,
            v + PERIOD * acceleration,
            angle + PERIOD * omega,
            omega + PERIOD * angular_acceleration,
        ];
        let [x, _, angle, _] = self.state;
        let terminated = x.abs() > POSITION_LIMIT || angle.abs() > ANGLE_LIMIT;
        Step {
            reward: 1.0,
            terms: ALIVE,
            terminated,
            unstable: false,
        }
    }

    fn scene(&self) -> Scene {
        Scene {
            solids: vec![
                solid("floor", Form::Plane, [0.0; 3], STILL),
                solid(
                    "track",
                    Form::Box,
                    [POSITION_LIMIT as f32, 0.02, 0.01],
                    STILL,
                ),
                solid("cart", Form::Box, [0.2, 0.12, 0.07], DRIVEN),
                solid("pole", Form::Capsule, [0.03, LENGTH as f32, 0.0], FOLLOWING),
            ],
            meshes: Vec::new(),
        }
    }

    fn poses(&self, poses: &mut Vec<Pose>) {
        /// Metres of the hinge above the floor.
        const HINGE: f64 = 0.2;
        let [x, _, angle, _] = self.state;
        let (sin, cos) = libm::sincos(angle);
        poses.extend([
            Pose::at([0.0; 3]),
            Pose::at([0.0, 0.0, 0.06]),
            Pose::at([x as f32, 0.0, 0.14]),
            Pose::leaning([x + LENGTH * sin, 0.0, HINGE + LENGTH * cos], angle),
        ]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(found: [f64; 4], expected: [f64; 4]) {
        for (a, b) in found.iter().zip(expected) {
            assert!((a - b).abs() < 1e-15, "{found:?} is not {expected:?}");
        }
    }

    /// Upright and at rest, so that sin = 0 and cos = 1: temp = 10/1.1, angular acceleration = -temp/(0.5·(4/3 - 1/11))
    /// = -600/41, acceleration = temp + 0.05·(600/41)/1.1 = 400/41.
    #[test]
    fn a_push_at_rest_gives_the_numbers_of_paper_and_pencil() {
        let mut task = CartPole::new();
        let step = task.step(Action::Discrete(1));
        near(
            task.state(),
            [0.0, 0.02 * 400.0 / 41.0, 0.0, -0.02 * 600.0 / 41.0],
        );
        assert_eq!(
            step,
            Step {
                reward: 1.0,
                terms: ALIVE,
                terminated: false,
                unstable: false
            }
        );
        task.set_state([0.0; 4]);
        task.step(Action::Discrete(0));
        near(
            task.state(),
            [0.0, -0.02 * 400.0 / 41.0, 0.0, 0.02 * 600.0 / 41.0],
        );
    }

    /// Explicit Euler moves the positions by the velocities before the step.
    #[test]
    fn positions_move_by_the_old_velocities() {
        let mut task = CartPole::new();
        task.set_state([1.0, 0.5, 0.1, -0.2]);
        task.step(Action::Discrete(1));
        let [x, _, angle, _] = task.state();
        near([x, angle, 0.0, 0.0], [1.01, 0.096, 0.0, 0.0]);
    }

    #[test]
    fn an_episode_ends_past_the_limits() {
        let end = |state| {
            let mut task = CartPole::new();
            task.set_state(state);
            task.step(Action::Discrete(0)).terminated
        };
        assert!(!end([2.39, 0.0, 0.0, 0.0]));
        assert!(end([2.39, 0.6, 0.0, 0.0]));
        assert!(end([-2.39, -0.6, 0.0, 0.0]));
        assert!(!end([0.0, 0.0, 0.209, 0.0]));
        assert!(end([0.0, 0.0, 0.209, 0.1]));
        assert!(end([0.0, 0.0, -0.209, -0.1]));
    }

    #[test]
    fn an_action_of_the_wrong_kind_is_index_0() {
        let (mut a, mut b) = (CartPole::new(), CartPole::new());
        a.step(Action::Continuous(&[1.0]));
        b.step(Action::Discrete(0));
        assert_eq!(a.state().map(f64::to_bits), b.state().map(f64::to_bits));
    }

    #[test]
    fn initial_states_are_within_the_noise() {
        let mut rng = Rng::new(5);
        let mut task = CartPole::new();
        for _ in 0..1000 {
            task.reset(&mut rng);
            assert!(
                task.state()
                    .iter()
                    .all(|x| (-RESET_NOISE..RESET_NOISE).contains(x))
            );
        }
    }
}
