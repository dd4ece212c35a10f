//! Pendulum, computed here: the same bits on every machine.

use super::scene::{DRIVEN, Form, Pose, STILL, Scene, solid};
use super::spec::{channels, write};
use super::{ActionSpace, Rng, Spec, Step, Task, Terms};
use std::f64::consts::PI;
use tpg_runtime::Action;

// Gymnasium 1.4.0, classic_control/pendulum.py: a rod of 1 m and 1 kg.
const GRAVITY: f64 = 10.0;
/// Seconds.
const PERIOD: f64 = 0.05;
/// Newton metres.
const TORQUE_LIMIT: f32 = 2.0;
/// Radians per second; T Tab 2.2 misprints 0.8.
const VELOCITY_LIMIT: f64 = 8.0;
/// Radians and radians per second.
const RESET_NOISE: [f64; 2] = [PI, 1.0];

/// A rod that a motor too weak to lift it has to swing up and hold: Gymnasium's Pendulum-v1.
///
/// Semi-implicit Euler in f64; sine and cosine come from the crate `libm`. The reward of a step is
/// -(φ² + 0.1 ω² + 0.001 u²) with the angle φ from upright, within ±π, the angular velocity ω and the torque u, both of
/// the state before the step. The episode never ends by itself.
#[derive(Debug, Clone)]
pub struct Pendulum {
    spec: Spec,
    state: [f64; 2],
}

impl Pendulum {
    /// Makes the task, upright and at rest.
    #[must_use]
    pub fn new() -> Self {
        let spec = Spec {
            name: "pendulum-v1".into(),
            inputs: channels(&[
                ("cosine", "1", false),
                ("sine", "1", false),
                ("angular_velocity", "rad/s", true),
            ]),
            outputs: channels(&[("torque", "N m", false)]),
            actions: ActionSpace::Continuous {
                len: 1,
                low: -TORQUE_LIMIT,
                high: TORQUE_LIMIT,
            },
            max_steps: 200,
            period_us: 50_000,
        };
        Self {
            spec,
            state: [0.0; 2],
        }
    }

    /// The angle from upright, which grows past whole turns, and the angular velocity, in SI units.
    #[must_use]
    pub fn state(&self) -> [f64; 2] {
        self.state
    }

    /// Starts from a state, given as [`state`](Self::state) returns it.
    pub fn set_state(&mut self, state: [f64; 2]) {
        self.state = state;
    }
}

/// The angle within -π inclusive and π, by the operations of NumPy's `%`.
fn normalised(angle: f64) -> f64 {
    const TURN: f64 = 2.0 * PI;
    let rest = libm::fmod(angle + PI, TURN);
    let rest = if rest < 0.0 { rest + TURN } else { rest };
    rest - PI
}

impl Default for Pendulum {
    fn default() -> Self {
        Self::new()
    }
}

impl Task for Pendulum {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn twin(&self) -> Option<Box<dyn Task>> {
        Some(Box::new(self.clone()))
    }

    fn reset(&mut self, rng: &mut Rng) {
        self.state = RESET_NOISE.map(|noise| rng.uniform(-noise, noise));
    }

    fn observe(&self, observation: &mut [f32]) {
        let [angle, omega] = self.state;
        let (sin, cos) = libm::sincos(angle);
        write(observation, &[cos, sin, omega]);
    }

    fn step(&mut self, action: Action<'_>) -> Step {
        let torque = match action {
            Action::Continuous(&[torque, ..]) => torque.clamp(-TORQUE_LIMIT, TORQUE_LIMIT),
            Action::Continuous(_) | Action::Discrete(_) => 0.0,
        };
        let [angle, omega] = self.state;
        let phi = normalised(angle);
        // What depends on the torque alone in f32, the type of the actions of Gymnasium's action space.
        let (drive, cost) = (3.0 * torque, 0.001 * (torque * torque));
        let costs = phi * phi + 0.1 * (omega * omega) + f64::from(cost);
        let acceleration = 3.0 * GRAVITY / 2.0 * libm::sin(angle) + f64::from(drive);
        let omega = (omega + acceleration * PERIOD).clamp(-VELOCITY_LIMIT, VELOCITY_LIMIT);
        self.state = [angle + omega * PERIOD, omega];
        Step {
            reward: -costs,
            terms: Terms {
                alive: 0.0,
                control: f64::from(cost),
            },
            terminated: false,
            unstable: false,
        }
    }

    fn scene(&self) -> Scene {
        Scene {
            solids: vec![
                solid("floor", Form::Plane, [0.0; 3], STILL),
                solid("axle", Form::Sphere, [0.06, 0.0, 0.0], STILL),
                solid("rod", Form::Capsule, [0.04, 0.5, 0.0], DRIVEN),
            ],
            meshes: Vec::new(),
        }
    }

    fn poses(&self, poses: &mut Vec<Pose>) {
        /// Metres of the axle above the floor.
        const AXLE: f64 = 1.2;
        let [angle, _] = self.state;
        // A growing angle turns the rod counter-clockwise, as Gymnasium draws it.
        let (sin, cos) = libm::sincos(-angle);
        poses.extend([
            Pose::at([0.0; 3]),
            Pose::at([0.0, 0.0, AXLE as f32]),
            Pose::leaning([0.5 * sin, 0.0, AXLE + 0.5 * cos], -angle),
        ]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(state: [f64; 2], torque: f32) -> (f64, [f64; 2]) {
        let mut task = Pendulum::new();
        task.set_state(state);
        let reward = task.step(Action::Continuous(&[torque])).reward;
        (reward, task.state())
    }

    /// Level and at rest: ω = (15 sin(π/2) + 3 · 1) · 0.05 = 0.9, φ moves by 0.9 · 0.05; the costs are those of before.
    #[test]
    fn a_torque_gives_the_numbers_of_paper_and_pencil() {
        let (reward, [angle, omega]) = step([PI / 2.0, 0.0], 1.0);
        assert!((omega - 0.9).abs() < 1e-15);
        assert!((angle - (PI / 2.0 + 0.045)).abs() < 1e-15);
        assert!((reward + PI * PI / 4.0 + 0.001).abs() < 1e-9);
    }

    #[test]
    fn velocity_and_torque_are_limited() {
        assert_eq!(step([PI / 2.0, 7.9], 2.0).1[1].to_bits(), 8f64.to_bits());
        assert_eq!(
            step([-PI / 2.0, -7.9], 0.0).1[1].to_bits(),
            (-8f64).to_bits()
        );
        assert_eq!(step([0.5, 0.5], 9.0), step([0.5, 0.5], 2.0));
    }

    #[test]
    fn the_angle_counts_from_the_nearest_upright() {
        for turns in -3..=3 {
            let angle = 0.3 + f64::from(turns) * 2.0 * PI;
            assert!((normalised(angle) - 0.3).abs() < 1e-14);
        }
        assert_eq!(normalised(-PI).to_bits(), (-PI).to_bits());
        assert_eq!(normalised(PI).to_bits(), (-PI).to_bits());
    }

    #[test]
    fn initial_states_are_within_the_noise() {
        let mut rng = Rng::new(5);
        let mut task = Pendulum::new();
        for _ in 0..1000 {
            task.reset(&mut rng);
            let [angle, omega] = task.state();
            assert!((-PI..PI).contains(&angle) && (-1.0..1.0).contains(&omega));
        }
    }

    #[test]
    fn an_action_of_the_wrong_kind_is_no_torque() {
        let (mut a, mut b, mut c) = (Pendulum::new(), Pendulum::new(), Pendulum::new());
        a.step(Action::Discrete(1));
        b.step(Action::Continuous(&[]));
        c.step(Action::Continuous(&[0.0]));
        assert_eq!(a.state().map(f64::to_bits), c.state().map(f64::to_bits));
        assert_eq!(b.state().map(f64::to_bits), c.state().map(f64::to_bits));
    }
}
