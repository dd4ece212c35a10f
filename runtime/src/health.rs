//! A health signal: what sensors show against what the policy's own model expects.
//!
//! A stuck sensor sends plausible numbers, so no single observation shows it. The model of a [front end](crate::front_end)
//! predicts how each of its elements changes in a step. A channel that does not do so for a while is suspect:
//!
//! - the model's residuals are squared and summed, with a memory of some 32 steps;
//! - so are the changes that it predicted and those that were seen, each at least 0.02 standard deviations;
//! - the first sum as a share of the second is what the model does not explain. It is near 0 for a healthy channel. It is
//!   near 1 for a stuck one, of which all of the predicted change is missing, and for one that shows noise;
//! - above [`THRESHOLD`] the channel is suspect.
//!
//! A step counts if the one before showed everything that the model predicts. A fault must last for some [`LEAST_STEPS`]
//! such steps. A bias that does not change is not seen. Elements that the model does not predict have no signal. A robot
//! at rest changes by nothing, so its stuck sensors are not seen either.

use core::fmt;

use crate::front_end::action_variables;
use crate::math::health::{add_step, larger, unexplained};
use crate::trace::Observer;
use crate::verify::Policy;

/// A channel is suspect if the model leaves more than this share of its changes unexplained.
pub const THRESHOLD: f32 = 0.8;
/// Steps that count before a channel has a share.
pub const LEAST_STEPS: u32 = 32;

/// Words for each element that the model predicts: sums of squared residuals and changes, the worst share.
const EACH: usize = 3;

/// Watches the channels of a policy that has a model. Give it to
/// [`Agent::decide_traced`](crate::Agent::decide_traced) with each observation.
///
/// `M` is the memory, [`Health::words`] of it: an array, a slice, or a vector.
///
/// # Examples
/// ```no_run
/// use tpg_runtime::health::Health;
/// # use tpg_runtime::{AnyWidth, HostAgent, Policy, Reset};
/// # static CHAMPION: &[u8] = &[];
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let policy = Policy::load(CHAMPION)?;
/// # let mut agent = Box::new(HostAgent::new(policy)?);
/// let mut memory = [0.0; 128];
/// let mut health = Health::new(&policy, &mut memory[..]).ok_or("no model")?;
/// agent.reset(Reset::Agent, 1);
/// health.begin();
/// # let observations = [[0.0; 11]];
/// for observation in observations {
///     let decision = agent.decide_traced(&observation, &mut health)?;
///     for channel in health.suspects() {
///         println!("input {channel} does not move as the model expects");
///     }
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Clone)]
pub struct Health<'p, M> {
    memory: M,
    columns: &'p [[u8; 2]],
    /// Words of the memory in which the model computes.
    room: usize,
    /// Whether the decision before showed everything that is watched, and the current one so far.
    before: bool,
    current: bool,
    steps: u32,
}

impl<'p, M: AsRef<[f32]> + AsMut<[f32]>> Health<'p, M> {
    /// Memory that a policy needs, in words; 0 if it has no model.
    #[must_use]
    pub fn words(policy: &Policy<'_>) -> usize {
        policy.front_end().map_or(0, |front_end| {
            front_end.words(policy.header()) + EACH * front_end.columns.len()
        })
    }

    /// Watches the channels of this policy. `None` if it has no model, or if there is too little memory.
    #[must_use]
    pub fn new(policy: &Policy<'p>, memory: M) -> Option<Self> {
        let words = Self::words(policy);
        let columns = policy.front_end()?.columns;
        if words == 0 || memory.as_ref().len() < words {
            return None;
        }
        let mut health = Health {
            memory,
            columns,
            room: 2 * columns.len() + action_variables(policy.header()),
            before: false,
            current: false,
            steps: 0,
        };
        health.begin();
        Some(health)
    }

    /// Forgets everything, as at the start of an episode.
    pub fn begin(&mut self) {
        self.memory.as_mut().fill(0.0);
        (self.before, self.current) = (false, false);
        self.steps = 0;
    }

    /// The elements of the observation that are watched.
    pub fn inputs(&self) -> impl Iterator<Item = u16> + use<'p, M> {
        self.columns.iter().map(|bytes| u16::from_le_bytes(*bytes))
    }

    /// The share of an input's changes that the model does not explain, now. `None` if the input is not watched, or if too
    /// few steps have counted.
    #[must_use]
    pub fn share(&self, input: u16) -> Option<f32> {
        let [residuals, changes, _] = self.sums(input)?;
        Some(unexplained(residuals, changes))
    }

    /// The largest share of an input since the start. `None` as for [`Self::share`].
    #[must_use]
    pub fn worst(&self, input: u16) -> Option<f32> {
        let [.., worst] = self.sums(input)?;
        Some(worst)
    }

    /// The inputs whose share is above [`THRESHOLD`] now.
    pub fn suspects(&self) -> impl Iterator<Item = u16> {
        self.inputs()
            .filter(|input| self.share(*input).is_some_and(|share| share > THRESHOLD))
    }

    fn sums(&self, input: u16) -> Option<[f32; EACH]> {
        let start = self.place(input)?;
        let sums = self.memory.as_ref().get(start..)?.first_chunk()?;
        (self.steps >= LEAST_STEPS).then_some(*sums)
    }

    /// Where the words of an input begin.
    fn place(&self, input: u16) -> Option<usize> {
        let k = self
            .columns
            .iter()
            .position(|c| *c == input.to_le_bytes())?;
        Some(self.room + EACH * k)
    }
}

impl<M: AsRef<[f32]> + AsMut<[f32]>> Observer for Health<'_, M> {
    fn room(&mut self) -> &mut [f32] {
        let room = self.memory.as_mut().get_mut(..self.room);
        room.unwrap_or_default()
    }

    fn predict(&mut self, input: u16, change: f32, residual: Option<f32>) {
        if self.columns.first() == Some(&input.to_le_bytes()) {
            // A new decision.
            (self.before, self.current) = (self.current, true);
            let counts = self.before && residual.is_some();
            self.steps = self.steps.saturating_add(u32::from(counts));
        }
        let Some(residual) = residual else {
            self.current = false;
            return;
        };
        let (true, Some(start)) = (self.before, self.place(input)) else {
            return;
        };
        let enough = self.steps >= LEAST_STEPS;
        let sums = self.memory.as_mut().get_mut(start..);
        if let Some([residuals, changes, worst, ..]) = sums {
            add_step(residuals, changes, change, residual);
            if enough {
                *worst = larger(*worst, unexplained(*residuals, *changes));
            }
        }
    }
}

impl<M> fmt::Debug for Health<'_, M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Health")
            .field("inputs", &self.columns.len())
            .field("steps", &self.steps)
            .finish()
    }
}
