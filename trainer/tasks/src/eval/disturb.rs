//! A disturbed link between a plant and any controller, in this process or in another.
//!
//! `tpg eval` and `tpg hil` put the same wrapper around their controllers, so that the same seed gives the same bits.

use std::ops::Range;

use tpg_runtime::rng::mix64;
use tpg_runtime::{Action, Reset};

use super::disturbance::{
    Direction, DisturbError, Disturbance, Effect, Fault, Probability, Which, Window,
};
use super::{Controller, Reply};
use crate::task::{ActionSpace, Channel, MISSING, Rng, round, words_of};

/// What a link carries, which its disturbances have to fit.
#[derive(Debug, Clone, Copy)]
pub struct Link<'a> {
    /// The elements of the observation that the policy sees.
    pub inputs: &'a [Channel],
    /// The outputs of the policy.
    pub outputs: &'a [Channel],
    /// The actions that the task accepts.
    pub actions: ActionSpace,
    /// Time between two frames, in microseconds.
    pub period_us: u32,
}

/// A link with disturbances, each applied to what the one before it delivered.
///
/// Observations are disturbed after masks. Each disturbance draws from the stream of `mix64(wrapper seed, position)`,
/// where positions count from 0 over both directions in the order given; adding one at the end leaves the others'
/// numbers alone. An action that noise or quantisation moves out of the policy's range is moved to its bound.
#[derive(Debug, Clone)]
pub struct Line {
    actions: ActionSpace,
    observation_stages: Vec<Stage>,
    action_stages: Vec<Stage>,
    observation: Vec<f32>,
    action: Vec<f32>,
}

impl Line {
    /// A link with disturbances; an empty list changes nothing.
    ///
    /// # Errors
    /// [`DisturbError::Discrete`] for more than a delay or a loss of the index of an action, [`DisturbError::NoSuchChannel`]
    /// for a channel that the link does not have.
    pub fn new(disturbances: &[Disturbance], link: &Link<'_>) -> Result<Self, DisturbError> {
        let (actions, observation_len) = (link.actions, link.inputs.len());
        // The index of a discrete action fits a float exactly.
        let (action_len, idle) = match actions {
            ActionSpace::Discrete(_) => (1, 0.0),
            ActionSpace::Continuous { len, low, high } => (len.into(), 0.0f32.clamp(low, high)),
        };
        let (mut observation_stages, mut action_stages) = (Vec::new(), Vec::new());
        for (position, disturbance) in disturbances.iter().enumerate() {
            let Disturbance {
                direction, effect, ..
            } = disturbance;
            let whole = matches!(effect, Effect::Delay(_) | Effect::Loss(_));
            if *direction == Direction::Action
                && matches!(actions, ActionSpace::Discrete(_))
                && !whole
            {
                return Err(DisturbError::Discrete(disturbance.to_string()));
            }
            let (channels, len, lost, stages) = match direction {
                Direction::Observation => {
                    let lost = Lost::Missing;
                    (link.inputs, observation_len, lost, &mut observation_stages)
                }
                Direction::Action => {
                    let lost = Lost::Last { idle };
                    (link.outputs, action_len, lost, &mut action_stages)
                }
            };
            let happening = Happening::new(disturbance, channels)?;
            let steps = steps(disturbance.window, link.period_us);
            stages.push(Stage::new(happening, steps, position, len, lost));
        }
        Ok(Line {
            actions,
            observation_stages,
            action_stages,
            observation: vec![0.0; observation_len],
            action: vec![0.0; action_len],
        })
    }

    /// Whether nothing disturbs it.
    #[must_use]
    pub fn is_undisturbed(&self) -> bool {
        self.observation_stages.is_empty() && self.action_stages.is_empty()
    }

    /// Begins an episode.
    pub fn seed(&mut self, wrapper_seed: u64) {
        let actions = &mut self.action_stages;
        for stage in self.observation_stages.iter_mut().chain(actions) {
            stage.reset(wrapper_seed);
        }
    }

    /// What arrives of an observation. Allocates nothing.
    pub fn observe<'s>(&'s mut self, observation: &'s [f32]) -> &'s [f32] {
        if self.observation_stages.is_empty() {
            return observation;
        }
        copy(observation, &mut self.observation);
        for stage in &mut self.observation_stages {
            stage.apply(&mut self.observation);
        }
        &self.observation
    }

    /// What arrives of an action. Allocates nothing.
    pub fn act<'s>(&'s mut self, action: Action<'s>) -> Action<'s> {
        if self.action_stages.is_empty() {
            return action;
        }
        match action {
            Action::Discrete(index) => self.action.fill(f32::from(index)),
            Action::Continuous(values) => copy(values, &mut self.action),
        }
        for stage in &mut self.action_stages {
            stage.apply(&mut self.action);
        }
        match self.actions {
            ActionSpace::Discrete(_) => {
                Action::Discrete(self.action.first().map_or(0, |v| *v as u16))
            }
            ActionSpace::Continuous { low, high, .. } => {
                for value in &mut self.action {
                    *value = value.clamp(low, high);
                }
                Action::Continuous(&self.action)
            }
        }
    }
}

/// A controller behind a [`Line`].
#[derive(Debug, Clone)]
pub struct Disturbed<C> {
    inner: C,
    line: Line,
}

impl<C> Disturbed<C> {
    /// Puts a controller behind disturbances; an empty list changes nothing.
    ///
    /// # Errors
    /// As for [`Line::new`].
    pub fn new(
        inner: C,
        disturbances: &[Disturbance],
        link: &Link<'_>,
    ) -> Result<Self, DisturbError> {
        let line = Line::new(disturbances, link)?;
        Ok(Disturbed { inner, line })
    }

    /// The controller without its disturbances.
    #[must_use]
    pub fn into_inner(self) -> C {
        self.inner
    }
}

impl<C: Controller> Controller for Disturbed<C> {
    type Error = C::Error;

    fn seed_wrappers(&mut self, wrapper_seed: u64) {
        self.line.seed(wrapper_seed);
        self.inner.seed_wrappers(wrapper_seed);
    }

    fn reset(&mut self, what: Reset, agent_seed: u64) -> Result<(), C::Error> {
        self.inner.reset(what, agent_seed)
    }

    /// Allocates nothing beyond what the controller does.
    fn decide(&mut self, observation: &[f32]) -> Result<Reply<'_>, C::Error> {
        let reply = self.inner.decide(self.line.observe(observation))?;
        let action = self.line.act(reply.action);
        Ok(Reply { action, ..reply })
    }
}

fn copy(from: &[f32], to: &mut [f32]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = *from;
    }
}

/// The number as a value of a frame. What is missing stays missing.
fn rounded(x: f64) -> f32 {
    if x.is_nan() { MISSING } else { round(x) }
}

/// What stands for a frame that did not arrive.
#[derive(Debug, Clone, Copy)]
enum Lost {
    Missing,
    /// The last one that did, at first an idle one.
    Last {
        idle: f32,
    },
}

/// What a disturbance does, with everything looked up.
#[derive(Debug, Clone, Copy)]
enum Happening {
    /// Steps.
    Delay(usize),
    /// The words that stand for a loss: those below.
    Loss(u128),
    Noise(f64),
    Quantise(f64),
    /// The number of the value.
    Channel(usize, Fault),
}

impl Happening {
    fn new(disturbance: &Disturbance, channels: &[Channel]) -> Result<Self, DisturbError> {
        Ok(match &disturbance.effect {
            Effect::Delay(steps) => Self::Delay(*steps as usize),
            Effect::Loss(probability) => Self::Loss(threshold(*probability)),
            Effect::Noise(sd) => Self::Noise(*sd),
            Effect::Quantise(step) => Self::Quantise(*step),
            Effect::Channel(which, fault) => {
                let index = match which {
                    Which::Index(index) => Some(*index).filter(|index| *index < channels.len()),
                    Which::Name(name) => channels.iter().position(|c| c.name == *name),
                };
                let Some(index) = index else {
                    let known = channels.iter().enumerate();
                    let known: Vec<_> = known.map(|(k, c)| format!("{k} {}", c.name)).collect();
                    return Err(DisturbError::NoSuchChannel {
                        text: disturbance.to_string(),
                        known: known.join(", "),
                    });
                };
                Self::Channel(index, *fault)
            }
        })
    }
}

/// The words that stand for an event: those below.
fn threshold(probability: Probability) -> u128 {
    words_of(probability.numerator, probability.denominator)
}

/// The steps of an episode in which a disturbance acts. Seconds are rounded to the nearest step.
fn steps(window: Option<Window>, period_us: u32) -> Range<usize> {
    let Some(Window { start, length }) = window else {
        return 0..usize::MAX;
    };
    let step = |seconds: f64| (seconds * 1e6 / f64::from(period_us.max(1))).round() as usize;
    step(start)..step(start + length)
}

/// The state of one disturbance during an episode.
#[derive(Debug, Clone)]
struct Stage {
    happening: Happening,
    /// The steps in which it acts.
    active: Range<usize>,
    position: u64,
    lost: Lost,
    rng: Rng,
    /// The frame that stands for a lost one.
    last: Vec<f32>,
    /// Whether the value that is stuck is known.
    held: bool,
    /// Frames under way, as a ring.
    under_way: Vec<f32>,
    /// Steps since the episode began.
    steps: usize,
}

impl Stage {
    fn new(
        happening: Happening,
        active: Range<usize>,
        position: usize,
        len: usize,
        lost: Lost,
    ) -> Self {
        let delay = match happening {
            Happening::Delay(steps) => steps,
            _ => 0,
        };
        let mut stage = Stage {
            happening,
            active,
            position: position as u64,
            lost,
            rng: Rng::new(0),
            last: vec![0.0; len],
            held: false,
            under_way: vec![0.0; len * delay],
            steps: 0,
        };
        stage.reset(0);
        stage
    }

    fn reset(&mut self, wrapper_seed: u64) {
        self.rng = Rng::new(mix64(&[wrapper_seed, self.position]));
        self.steps = 0;
        self.held = false;
        self.last.fill(match self.lost {
            Lost::Missing => MISSING,
            Lost::Last { idle } => idle,
        });
    }

    /// Random numbers are drawn in every step, so that they do not depend on when the disturbance acts.
    fn apply(&mut self, frame: &mut [f32]) {
        let active = self.active.contains(&self.steps);
        match self.happening {
            Happening::Delay(delay) => self.delay(delay, frame),
            Happening::Loss(threshold) => {
                if u128::from(self.rng.word()) < threshold && active {
                    copy(&self.last, frame);
                } else if matches!(self.lost, Lost::Last { .. }) {
                    copy(frame, &mut self.last);
                }
            }
            Happening::Noise(sd) => {
                for value in frame {
                    // The number is drawn for a missing element too, which stays missing.
                    let noise = sd * self.rng.normal();
                    if active {
                        *value = rounded(f64::from(*value) + noise);
                    }
                }
            }
            Happening::Quantise(step) => {
                for value in frame.iter_mut().filter(|_| active) {
                    *value = rounded((f64::from(*value) / step).round() * step);
                }
            }
            Happening::Channel(index, fault) => {
                if let Some(value) = frame.get_mut(index) {
                    self.fault(index, fault, active, value);
                }
            }
        }
        self.steps += 1;
    }

    /// Disturbs one value.
    fn fault(&mut self, index: usize, fault: Fault, active: bool, value: &mut f32) {
        let arrived = *value;
        match fault {
            Fault::Drop(probability) => {
                let dropped = u128::from(self.rng.word()) < threshold(probability) && active;
                if dropped && !arrived.is_nan() {
                    *value = self.last.get(index).copied().unwrap_or(MISSING);
                    return;
                }
            }
            Fault::Nan(probability) => {
                if u128::from(self.rng.word()) < threshold(probability) && active {
                    *value = MISSING;
                }
            }
            Fault::Stuck => {
                if active && self.held && !arrived.is_nan() {
                    *value = self.last.get(index).copied().unwrap_or(MISSING);
                    return;
                }
                self.held = active && (self.held || !arrived.is_nan());
            }
            Fault::Bias(x) if active => *value = rounded(f64::from(arrived) + x),
            Fault::Bias(_) => {}
            Fault::Noise(sd) => {
                let noise = sd * self.rng.normal();
                if active {
                    *value = rounded(f64::from(arrived) + noise);
                }
            }
        }
        if let Some(last) = self.last.get_mut(index).filter(|_| !arrived.is_nan()) {
            *last = arrived;
        }
    }

    fn delay(&mut self, delay: usize, frame: &mut [f32]) {
        let start = self.steps % delay * frame.len();
        let place = self.under_way.get_mut(start..start + frame.len());
        let Some(place) = place else { return };
        place.swap_with_slice(frame);
        if self.steps < delay {
            copy(&self.last, frame);
        }
    }
}

#[cfg(test)]
#[path = "disturb_tests.rs"]
mod tests;
