//! One control period after another: sense, decide, and act in time. Otherwise the plant is kept safe.
//!
//! It runs on boards and on hosts. The test of package `tpg-tests` drives it with a plant whose clock it sets.

use tpg_runtime::{Action, Agent, Policy, Reset, Storage, Width};

use crate::pack::SEED;

/// A sensor or actuator behind a converter: an input or output of the policy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Channel {
    /// Its name and unit, as in the policy.
    pub label: (&'static str, &'static str),
    /// The step of the converter that stands for 0.
    pub zero_step: f32,
    /// What one step of the converter is, in the unit. It may be negative, but not 0.
    pub unit_per_step: f32,
}

impl Channel {
    /// The value of this step of the converter, in the unit.
    #[must_use]
    pub fn value(&self, step: u16) -> f32 {
        (f32::from(step) - self.zero_step) * self.unit_per_step
    }

    /// The step of the converter for this value, at most `most`, rounded towards 0.
    #[must_use]
    pub fn step(&self, value: f32, most: u16) -> u16 {
        // The conversion stays within the integer's range.
        ((value / self.unit_per_step + self.zero_step) as u16).min(most)
    }
}

/// Whether the policy was evolved for these channels, in this order.
#[must_use]
pub fn fits(policy: &Policy<'_>, sensors: &[Channel], actuators: &[Channel]) -> bool {
    policy.inputs().eq(sensors.iter().map(|c| c.label))
        && policy.outputs().eq(actuators.iter().map(|c| c.label))
}

/// A machine that a policy drives, with its clock and its watchdog.
pub trait Plant {
    /// Microseconds since some moment. It never goes back.
    fn now_us(&mut self) -> u64;

    /// Keeps the watchdog from restarting the machine. It is called once in each control period.
    fn feed_watchdog(&mut self);

    /// Writes what the sensors show, in the policy's order and units. An element that it leaves out is NaN: missing.
    /// Returns whether the policy may drive now.
    fn sense(&mut self, observation: &mut [f32]) -> bool;

    /// Drives the actuators. Returns `false` if this is no action for them.
    fn act(&mut self, action: Action<'_>) -> bool;

    /// Drives every actuator to where it does no harm.
    fn make_safe(&mut self);
}

/// What happened in a control period. The plant is safe after all but [`Outcome::Driven`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The policy decided in time, and the plant was driven.
    Driven,
    /// The policy decided in time, but too few periods have passed since the last fault.
    Recovering,
    /// [`Plant::sense`] did not allow driving.
    Stopped,
    /// The decision came after the deadline. Its action was not used.
    Late,
    /// The policy did not decide, or its action is none for this plant.
    Failed,
}

/// When the next control period begins, and how many were in time since the last fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Control {
    period_us: u32,
    deadline_us: u32,
    recovery: u32,
    in_time: u32,
    due_us: Option<u64>,
}

impl Control {
    /// The first period begins with the first call of [`Control::period`].
    ///
    /// An action is used if it is known `deadline_us` after its period was to begin, in microseconds; mostly this is
    /// `period_us`. After a fault, and at the start, so many periods as `recovery` must be in time before the plant is driven.
    #[must_use]
    pub const fn new(period_us: u32, deadline_us: u32, recovery: u32) -> Self {
        Control {
            period_us,
            deadline_us,
            recovery,
            in_time: 0,
            due_us: None,
        }
    }

    /// Waits for the next period, feeds the watchdog, senses, decides and acts. `INPUTS` is the length of an observation.
    ///
    /// If the plant is not driven, the agent's episode ends. So driving begins as an episode of the training does.
    pub fn period<const INPUTS: usize, W: Width, S: Storage>(
        &mut self,
        agent: &mut Agent<'_, W, S>,
        plant: &mut impl Plant,
    ) -> Outcome {
        let due = *self.due_us.get_or_insert_with(|| plant.now_us());
        while plant.now_us() < due {}
        plant.feed_watchdog();
        let outcome = self.decide::<INPUTS, _, _>(agent, plant, due);
        self.in_time = match outcome {
            Outcome::Driven | Outcome::Recovering => self.in_time.saturating_add(1),
            _ => 0,
        };
        if outcome != Outcome::Driven {
            plant.make_safe();
            agent.reset(Reset::Episode, SEED);
        }
        // From instant to instant, so the period does not drift. A period that took too long is not made up for.
        let next = due.saturating_add(u64::from(self.period_us));
        self.due_us = Some(next.max(plant.now_us()));
        outcome
    }

    fn decide<const INPUTS: usize, W: Width, S: Storage>(
        &self,
        agent: &mut Agent<'_, W, S>,
        plant: &mut impl Plant,
        due: u64,
    ) -> Outcome {
        let mut observation = [f32::NAN; INPUTS];
        if !plant.sense(&mut observation) {
            return Outcome::Stopped;
        }
        let Ok(decision) = agent.decide(&observation) else {
            return Outcome::Failed;
        };
        if plant.now_us().saturating_sub(due) > u64::from(self.deadline_us) {
            Outcome::Late
        } else if self.in_time < self.recovery {
            Outcome::Recovering
        } else if plant.act(decision.action) {
            Outcome::Driven
        } else {
            Outcome::Failed
        }
    }
}
