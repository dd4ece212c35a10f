//! CartPole and Pendulum without velocities.

use super::Level;
use crate::task::{CartPole, Pendulum, Rng, Spec, Step, Task, Terms};
use tpg_runtime::Action;

/// Range of the pendulum's rewards, by which POPGym scales them.
const PENDULUM_RANGE: f64 = 16.2736044;
/// Twice the limits of cart and pole, as POPGym bounds its observations: metres and radians.
const CART_POLE_BOUNDS: [f32; 2] = [4.8, 24.0 * 2.0 * std::f32::consts::PI / 360.0];

#[derive(Debug, Clone)]
enum Plant {
    CartPole(CartPole),
    Pendulum(Pendulum),
}

/// POPGym's position-only CartPole and Pendulum, with and without noise in what is observed.
///
/// The plants are Gymnasium's. CartPole shows position and angle, and each step earns 1 / limit. Pendulum shows the angle's cosine
/// and sine, and its rewards are scaled so that an episode earns −1 to 1. The limit is 200, 400 or 600 steps for CartPole and 200,
/// 150 or 100 for Pendulum.
///
/// Noise is normal with a standard deviation of 0.1, 0.2 or 0.3. Its sum with the observation is clipped to ±1 for Pendulum, and to
/// ±4.8 m and ±24° for CartPole. The limit is then 200.
#[derive(Debug, Clone)]
pub struct PositionOnly {
    spec: Spec,
    plant: Plant,
    /// Standard deviation of the noise. `None` without noise.
    sigma: Option<f64>,
    noise: [f32; 2],
    stream: Rng,
}

impl PositionOnly {
    /// Makes CartPole without velocities.
    #[must_use]
    pub fn cartpole(level: Level) -> Self {
        let limit = level.pick([200, 400, 600]);
        Self::of(Plant::CartPole(CartPole::new()), level, limit, None)
    }

    /// Makes Pendulum without velocities.
    #[must_use]
    pub fn pendulum(level: Level) -> Self {
        let limit = level.pick([200, 150, 100]);
        Self::of(Plant::Pendulum(Pendulum::new()), level, limit, None)
    }

    /// Makes CartPole without velocities and with noise.
    #[must_use]
    pub fn noisy_cartpole(level: Level) -> Self {
        let sigma = Some(level.pick([0.1, 0.2, 0.3]));
        Self::of(Plant::CartPole(CartPole::new()), level, 200, sigma)
    }

    /// Makes Pendulum without velocities and with noise.
    #[must_use]
    pub fn noisy_pendulum(level: Level) -> Self {
        let sigma = Some(level.pick([0.1, 0.2, 0.3]));
        Self::of(Plant::Pendulum(Pendulum::new()), level, 200, sigma)
    }

    fn of(plant: Plant, level: Level, limit: u32, sigma: Option<f64>) -> Self {
        let (what, inner) = match &plant {
            Plant::CartPole(plant) => ("cartpole", plant.spec()),
            Plant::Pendulum(plant) => ("pendulum", plant.spec()),
        };
        let noisy = if sigma.is_some() { "noisy-" } else { "" };
        let mut spec = inner.clone();
        spec.name = format!("{noisy}position-only-{what}:{}-v1", level.name());
        spec.inputs.retain(|channel| !channel.velocity);
        spec.max_steps = limit;
        PositionOnly {
            spec,
            plant,
            sigma,
            noise: [0.0; 2],
            stream: Rng::new(0),
        }
    }

    /// Starts from a state of the plant: position, velocity, angle and angular velocity of CartPole, angle and angular velocity of
    /// Pendulum, in SI units. What a plant does not have is not used.
    pub fn set_state(&mut self, state: [f64; 4]) {
        let [first, second, ..] = state;
        match &mut self.plant {
            Plant::CartPole(plant) => plant.set_state(state),
            Plant::Pendulum(plant) => plant.set_state([first, second]),
        }
    }

    /// Sets what is added to the present observation.
    pub fn set_noise(&mut self, noise: [f32; 2]) {
        self.noise = noise;
    }

    fn draw_noise(&mut self) {
        if let Some(sigma) = self.sigma {
            self.noise = [(); 2].map(|()| (sigma * self.stream.normal()) as f32);
        }
    }
}

impl Task for PositionOnly {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn twin(&self) -> Option<Box<dyn Task>> {
        Some(Box::new(self.clone()))
    }

    fn reset(&mut self, rng: &mut Rng) {
        match &mut self.plant {
            Plant::CartPole(plant) => plant.reset(rng),
            Plant::Pendulum(plant) => plant.reset(rng),
        }
        if self.sigma.is_some() {
            self.stream = Rng::new(rng.word());
            self.draw_noise();
        }
    }

    fn observe(&self, observation: &mut [f32]) {
        let mut full = [0.0; 4];
        let (positions, bounds) = match &self.plant {
            Plant::CartPole(plant) => {
                plant.observe(&mut full);
                ([full[0], full[2]], CART_POLE_BOUNDS)
            }
            Plant::Pendulum(plant) => {
                plant.observe(&mut full);
                ([full[0], full[1]], [1.0; 2])
            }
        };
        let noisy = positions.iter().zip(self.noise).zip(bounds);
        for (out, ((position, noise), bound)) in observation.iter_mut().zip(noisy) {
            *out = match self.sigma {
                Some(_) => (position + noise).clamp(-bound, bound),
                None => *position,
            };
        }
    }

    fn step(&mut self, action: Action<'_>) -> Step {
        let limit = f64::from(self.spec.max_steps);
        let step = match &mut self.plant {
            Plant::CartPole(plant) => {
                let reward = 1.0 / limit;
                let alive = Terms {
                    alive: reward,
                    control: 0.0,
                };
                Step {
                    reward,
                    terms: alive,
                    ..plant.step(action)
                }
            }
            Plant::Pendulum(plant) => {
                let half = PENDULUM_RANGE / 2.0;
                let step = plant.step(action);
                let terms = Terms {
                    alive: 0.0,
                    control: step.terms.control / half / limit,
                };
                Step {
                    reward: (step.reward + half) / half / limit,
                    terms,
                    ..step
                }
            }
        };
        self.draw_noise();
        step
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::{mean, standard_deviation};

    #[test]
    fn noise_has_the_deviation_of_its_level() {
        for (level, sigma) in Level::ALL.into_iter().zip([0.1, 0.2, 0.3]) {
            let mut noisy = PositionOnly::noisy_cartpole(level);
            noisy.reset(&mut Rng::new(5));
            let mut draws = Vec::new();
            for _ in 0..5000 {
                noisy.set_state([0.0; 4]);
                noisy.draw_noise();
                let mut seen = [0.0; 2];
                noisy.observe(&mut seen);
                draws.push(f64::from(seen[0]));
            }
            let (mean, deviation) = (mean(&draws), standard_deviation(&draws));
            assert!(
                mean.abs() < 0.02 && (deviation / sigma - 1.0).abs() < 0.05,
                "{mean} {deviation}"
            );
        }
    }

    #[test]
    fn returns_are_scaled_to_1() {
        let mut task = PositionOnly::cartpole(Level::Hard);
        task.reset(&mut Rng::new(1));
        assert!((task.step(Action::Discrete(0)).reward * 600.0 - 1.0).abs() < 1e-12);
        // Upright, at rest and without torque, nothing is paid.
        let mut task = PositionOnly::pendulum(Level::Easy);
        task.set_state([0.0; 4]);
        assert!((task.step(Action::Continuous(&[0.0])).reward * 200.0 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn without_noise_there_is_none_and_with_noise_it_differs_from_step_to_step() {
        let (mut clean, mut noisy) = (
            PositionOnly::pendulum(Level::Easy),
            PositionOnly::noisy_pendulum(Level::Easy),
        );
        clean.reset(&mut Rng::new(3));
        noisy.reset(&mut Rng::new(3));
        let mut differences = Vec::new();
        for _ in 0..3 {
            let mut seen = [[0.0f32; 2]; 2];
            clean.observe(&mut seen[0]);
            noisy.observe(&mut seen[1]);
            differences.push((seen[0][0] - seen[1][0]).to_bits());
            clean.step(Action::Continuous(&[1.0]));
            noisy.step(Action::Continuous(&[1.0]));
        }
        differences.sort_unstable();
        differences.dedup();
        assert_eq!(differences.len(), 3);
    }
}
