//! Acrobot, computed here: the same bits on every machine.

use super::scene::{DRIVEN, FOLLOWING, Form, Pose, STILL, Scene, solid};
use super::spec::{channels, write};
use super::{ActionSpace, Rng, Spec, Step, Task, Terms};
use std::f64::consts::{FRAC_PI_2, PI};
use tpg_runtime::Action;

// Gymnasium 1.4.0, classic_control/acrobot.py, with the equations of Sutton and Barto's book. Both links are 1 m long,
// weigh 1 kg, have their centre of mass in the middle and a moment of inertia of 1 kg m².
const GRAVITY: f64 = 9.8;
const LENGTH: f64 = 1.0;
const MASS: f64 = 1.0;
/// Metres from a link's upper end to its centre of mass.
const CENTRE: f64 = 0.5;
const INERTIA: f64 = 1.0;
/// Seconds.
const PERIOD: f64 = 0.2;
/// Newton metres, by the action's index.
const TORQUES: [f64; 3] = [-1.0, 0.0, 1.0];
/// Radians per second, of the first and of the second joint.
const VELOCITY_LIMITS: [f64; 2] = [4.0 * PI, 9.0 * PI];
/// Radians and radians per second.
const RESET_NOISE: f64 = 0.1;

/// Two hanging links, of which a motor between them has to swing the free end up: Gymnasium's Acrobot-v1.
///
/// One step of Runge-Kutta (fourth order) in f64; sine and cosine come from the crate `libm`. The reward is -1 in each
/// step and 0 in the one that reaches the goal, one link's length above the fixed end.
#[derive(Debug, Clone)]
pub struct Acrobot {
    spec: Spec,
    state: [f64; 4],
}

impl Acrobot {
    /// Makes the task, hanging and at rest.
    #[must_use]
    pub fn new() -> Self {
        let spec = Spec {
            name: "acrobot-v1".into(),
            inputs: channels(&[
                ("link_1_cosine", "1", false),
                ("link_1_sine", "1", false),
                ("link_2_cosine", "1", false),
                ("link_2_sine", "1", false),
                ("link_1_angular_velocity", "rad/s", true),
                ("link_2_angular_velocity", "rad/s", true),
            ]),
            outputs: channels(&[("torque", "index", false)]),
            actions: ActionSpace::Discrete(3),
            max_steps: 500,
            period_us: 200_000,
        };
        Self {
            spec,
            state: [0.0; 4],
        }
    }

    /// Angle of the first link from hanging and of the second from the first, then their angular velocities, in SI units.
    #[must_use]
    pub fn state(&self) -> [f64; 4] {
        self.state
    }

    /// Starts from a state, given as [`state`](Self::state) returns it.
    pub fn set_state(&mut self, state: [f64; 4]) {
        self.state = state;
    }
}

/// Time derivative of a state, operation by operation as Gymnasium writes it.
fn derivative([angle_1, angle_2, v1, v2]: [f64; 4], torque: f64) -> [f64; 4] {
    const COUPLING: f64 = MASS * LENGTH * CENTRE;
    const OWN: f64 = MASS * (CENTRE * CENTRE);
    let (sin_2, cos_2) = libm::sincos(angle_2);
    let d1 = OWN
        + MASS * (LENGTH * LENGTH + CENTRE * CENTRE + 2.0 * LENGTH * CENTRE * cos_2)
        + INERTIA
        + INERTIA;
    let d2 = MASS * (CENTRE * CENTRE + LENGTH * CENTRE * cos_2) + INERTIA;
    let phi_2 = MASS * CENTRE * GRAVITY * libm::cos(angle_1 + angle_2 - FRAC_PI_2);
    let phi_1 = -COUPLING * (v2 * v2) * sin_2 - 2.0 * COUPLING * v2 * v1 * sin_2
        + (MASS * CENTRE + MASS * LENGTH) * GRAVITY * libm::cos(angle_1 - FRAC_PI_2)
        + phi_2;
    let a2 = (torque + d2 / d1 * phi_1 - COUPLING * (v1 * v1) * sin_2 - phi_2)
        / (OWN + INERTIA - d2 * d2 / d1);
    let a1 = -(d2 * a2 + phi_1) / d1;
    [v1, v2, a1, a2]
}

/// The state one control period later, before angles are wrapped and velocities limited.
fn runge_kutta(state: [f64; 4], torque: f64) -> [f64; 4] {
    let ahead = |dt: f64, k: [f64; 4]| std::array::from_fn(|i| state[i] + dt * k[i]);
    let k1 = derivative(state, torque);
    let k2 = derivative(ahead(PERIOD / 2.0, k1), torque);
    let k3 = derivative(ahead(PERIOD / 2.0, k2), torque);
    let k4 = derivative(ahead(PERIOD, k3), torque);
    std::array::from_fn(|i| state[i] + PERIOD / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
}

/// Turns an angle back by whole turns until it lies within ±π.
fn wrap(mut angle: f64) -> f64 {
    /// No step from a state within the limits makes more turns; the bound is for states that were set from outside.
    const TURNS: u32 = 100;
    for _ in 0..TURNS {
        if angle > PI {
            angle -= 2.0 * PI;
        } else if angle < -PI {
            angle += 2.0 * PI;
        } else {
            break;
        }
    }
    angle
}

impl Default for Acrobot {
    fn default() -> Self {
        Self::new()
    }
}

impl Task for Acrobot {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn twin(&self) -> Option<Box<dyn Task>> {
        Some(Box::new(self.clone()))
    }

    /// Initial states are rounded to f32, as Gymnasium's are.
    fn reset(&mut self, rng: &mut Rng) {
        self.state =
            std::array::from_fn(|_| f64::from(rng.uniform(-RESET_NOISE, RESET_NOISE) as f32));
    }

    fn observe(&self, observation: &mut [f32]) {
        let [angle_1, angle_2, v1, v2] = self.state;
        let ((sin_1, cos_1), (sin_2, cos_2)) = (libm::sincos(angle_1), libm::sincos(angle_2));
        write(observation, &[cos_1, sin_1, cos_2, sin_2, v1, v2]);
    }

    fn step(&mut self, action: Action<'_>) -> Step {
        let index = match action {
            Action::Discrete(index) => usize::from(index),
            Action::Continuous(_) => 0,
        };
        let torque = TORQUES.get(index).copied().unwrap_or(TORQUES[0]);
        let [angle_1, angle_2, v1, v2] = runge_kutta(self.state, torque);
        let limit = |v: f64, limit: f64| v.clamp(-limit, limit);
        let (angle_1, angle_2) = (wrap(angle_1), wrap(angle_2));
        self.state = [
            angle_1,
            angle_2,
            limit(v1, VELOCITY_LIMITS[0]),
            limit(v2, VELOCITY_LIMITS[1]),
        ];
        let terminated = -libm::cos(angle_1) - libm::cos(angle_2 + angle_1) > 1.0;
        Step {
            reward: if terminated { 0.0 } else { -1.0 },
            terms: Terms::default(),
            terminated,
            unstable: false,
        }
    }

    fn scene(&self) -> Scene {
        let link = [0.06, CENTRE as f32, 0.0];
        Scene {
            solids: vec![
                solid("floor", Form::Plane, [0.0; 3], STILL),
                solid("goal", Form::Box, [1.5, 0.01, 0.01], STILL),
                solid("axle", Form::Sphere, [0.09, 0.0, 0.0], STILL),
                solid("link 1", Form::Capsule, link, DRIVEN),
                solid("link 2", Form::Capsule, link, FOLLOWING),
            ],
            meshes: Vec::new(),
        }
    }

    fn poses(&self, poses: &mut Vec<Pose>) {
        /// Metres of the fixed end above the floor.
        const AXLE: f64 = 2.3;
        let [angle_1, angle_2, ..] = self.state;
        let (sin_1, cos_1) = libm::sincos(angle_1);
        let (sin_2, cos_2) = libm::sincos(angle_1 + angle_2);
        let elbow = [LENGTH * sin_1, AXLE - LENGTH * cos_1];
        // An angle counts from hanging, so a link's axis, which points to its free end, leans by π more.
        poses.extend([
            Pose::at([0.0; 3]),
            Pose::at([0.0, 0.0, (AXLE + LENGTH) as f32]),
            Pose::at([0.0, 0.0, AXLE as f32]),
            Pose::leaning([CENTRE * sin_1, 0.0, AXLE - CENTRE * cos_1], PI - angle_1),
            Pose::leaning(
                [elbow[0] + CENTRE * sin_2, 0.0, elbow[1] - CENTRE * cos_2],
                PI - angle_1 - angle_2,
            ),
        ]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn energy([angle_1, angle_2, v1, v2]: [f64; 4]) -> f64 {
        // Kinetic energy by the mass matrix, potential energy by the heights of the two centres of mass.
        let d1 = 0.25 + (1.25 + angle_2.cos()) + 2.0;
        let d2 = 0.25 + 0.5 * angle_2.cos() + 1.0;
        let kinetic = 0.5 * d1 * v1 * v1 + d2 * v1 * v2 + 0.5 * 1.25 * v2 * v2;
        let potential = -9.8 * (1.5 * angle_1.cos() + 0.5 * (angle_1 + angle_2).cos());
        kinetic + potential
    }

    /// Hanging at rest, d1 = 4.5, d2 = 1.75 and gravity pulls at nothing, so that a2 = 1/(1.25 - 1.75²/4.5) = 36/20.5 and
    /// a1 = -1.75/4.5 · a2 = -14/20.5.
    #[test]
    fn a_torque_at_rest_gives_the_accelerations_of_paper_and_pencil() {
        let [v1, v2, a1, a2] = derivative([0.0; 4], 1.0);
        assert!(v1 == 0.0 && v2 == 0.0);
        assert!((a1 + 14.0 / 20.5).abs() < 1e-14, "{a1}");
        assert!((a2 - 36.0 / 20.5).abs() < 1e-14, "{a2}");
    }

    #[test]
    fn without_torque_energy_stays_nearly_what_it_was() {
        let mut task = Acrobot::new();
        task.set_state([0.5, -0.3, 0.0, 0.0]);
        let before = energy(task.state());
        for _ in 0..100 {
            task.step(Action::Discrete(1));
        }
        let after = energy(task.state());
        assert!((after - before).abs() < 0.1, "{before} J became {after} J");
    }

    #[test]
    fn the_goal_ends_the_episode_without_a_penalty() {
        let step = |state| {
            let mut task = Acrobot::new();
            task.set_state(state);
            task.step(Action::Discrete(1))
        };
        let hanging = step([0.0; 4]);
        assert_eq!((hanging.terminated, hanging.reward), (false, -1.0));
        let upright = step([PI, 0.0, 0.0, 0.0]);
        assert_eq!((upright.terminated, upright.reward), (true, 0.0));
    }

    #[test]
    fn angles_wrap_and_velocities_are_limited() {
        let mut task = Acrobot::new();
        task.set_state([3.0, -3.0, 12.0, -28.0]);
        for _ in 0..200 {
            task.step(Action::Discrete(2));
            let [angle_1, angle_2, v1, v2] = task.state();
            assert!(angle_1.abs() <= PI && angle_2.abs() <= PI);
            assert!(v1.abs() <= 4.0 * PI && v2.abs() <= 9.0 * PI);
        }
    }

    #[test]
    fn no_state_from_outside_makes_a_step_hang() {
        for value in [f64::NAN, f64::INFINITY, 1e300, -1e300] {
            let mut task = Acrobot::new();
            task.set_state([value; 4]);
            task.step(Action::Discrete(2));
            let mut observation = [1.0; 6];
            task.observe(&mut observation);
            assert!(observation.iter().all(|x| x.is_finite()));
        }
    }

    #[test]
    fn an_action_of_the_wrong_kind_is_index_0() {
        let (mut a, mut b) = (Acrobot::new(), Acrobot::new());
        a.step(Action::Continuous(&[1.0]));
        b.step(Action::Discrete(0));
        assert_eq!(a.state().map(f64::to_bits), b.state().map(f64::to_bits));
    }
}
