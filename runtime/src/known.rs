//! Agents of policies that are known when a program is compiled.

use core::fmt;

use crate::agent::Agent;
use crate::blob::{Header, labels_of, next_line, split_at_byte};
use crate::decision::{Decision, ObservationError, Reset, Restore, masked};
use crate::sizing::{Capacities, CapacityError};
use crate::storage::Storage;
use crate::verify::{Policy, VerifyError};
use crate::width::Width;

/// An agent whose policy has `INPUTS` elements in its observation. Observations of another length do not compile.
///
/// [`policy!`](crate::policy!) gives its type. `W` and `S` are those of the [`Agent`] inside.
#[derive(Debug, Clone)]
pub struct KnownAgent<W: Width, S: Storage, const INPUTS: usize> {
    agent: Agent<'static, W, S>,
}

impl<W: Width, S: Storage, const INPUTS: usize> KnownAgent<W, S, INPUTS> {
    /// Loads the policy in these bytes and makes its agent, whose state is in `storage`, reset with seed 0.
    ///
    /// # Errors
    /// [`LoadError`] if the policy is refused, does not fit, or has another number of inputs.
    pub fn load_in(bytes: &'static [u8], storage: S) -> Result<Self, LoadError> {
        let policy = Policy::load(bytes)?;
        let got = usize::from(policy.header().observation_len);
        if got != INPUTS {
            let needed = INPUTS;
            return Err(LoadError::Inputs(ObservationError { needed, got }));
        }
        let agent = Agent::new_in(policy, storage)?;
        Ok(KnownAgent { agent })
    }

    /// As [`Agent::reset`].
    pub fn reset(&mut self, what: Reset, agent_seed: u64) {
        self.agent.reset(what, agent_seed);
    }

    /// As [`Agent::restore`].
    pub fn restore(&mut self, what: Restore) {
        self.agent.restore(what);
    }

    /// As [`Agent::decide`]. The compiler has checked the length, so there is no error.
    pub fn decide(&mut self, observation: &[f32; INPUTS]) -> Decision<'_> {
        self.agent.decide_exact(observation.iter().copied(), ())
    }

    /// As [`Agent::decide_masked`]. The compiler has checked the lengths, so there is no error.
    pub fn decide_masked(
        &mut self,
        observation: &[f32; INPUTS],
        missing: &[bool; INPUTS],
    ) -> Decision<'_> {
        match masked(observation, missing) {
            Ok(observation) => self.agent.decide_exact(observation, ()),
            // The lengths are equal.
            Err(_) => self.agent.decide_blind(),
        }
    }

    /// As [`Agent::decide_blind`].
    pub fn decide_blind(&mut self) -> Decision<'_> {
        self.agent.decide_blind()
    }

    /// As [`Agent::decide_traced`]. The compiler has checked the length, so there is no error.
    #[cfg(feature = "trace")]
    pub fn decide_traced(
        &mut self,
        observation: &[f32; INPUTS],
        observer: &mut dyn crate::trace::Observer,
    ) -> Decision<'_> {
        self.agent
            .decide_exact(observation.iter().copied(), observer)
    }

    /// The agent, to look at its policy and state.
    #[must_use]
    pub const fn agent(&self) -> &Agent<'static, W, S> {
        &self.agent
    }
}

/// Why a policy cannot be loaded into an agent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum LoadError {
    /// The bytes are no policy that this build executes.
    Policy(VerifyError),
    /// The policy needs more than there is room for.
    Capacity(CapacityError),
    /// The policy has another number of inputs than the agent's type.
    Inputs(ObservationError),
}

impl fmt::Display for LoadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Policy(error) => error.fmt(f),
            Self::Capacity(error) => error.fmt(f),
            Self::Inputs(ObservationError { needed, got }) => {
                write!(
                    f,
                    "policy has {got} inputs, the agent was compiled for {needed}"
                )
            }
        }
    }
}

impl core::error::Error for LoadError {}

impl From<VerifyError> for LoadError {
    fn from(error: VerifyError) -> Self {
        Self::Policy(error)
    }
}

impl From<CapacityError> for LoadError {
    fn from(error: CapacityError) -> Self {
        Self::Capacity(error)
    }
}

/// Name and unit of an input or output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Channel<'a> {
    /// Its name.
    pub name: &'a str,
    /// Its unit. Empty if it has none.
    pub unit: &'a str,
}

/// `N` inputs and outputs of the policy in these bytes, after the first `skip` of them. Inputs come before outputs.
///
/// Use it in constant expressions; [`policy!`](crate::policy!) does.
///
/// # Panics
/// If there are no labels, or fewer than `skip + N`; in a constant expression this ends the compilation.
#[must_use]
#[expect(
    clippy::panic,
    reason = "for constant expressions, where it ends the compilation"
)]
pub const fn channels<const N: usize>(bytes: &[u8], skip: usize) -> [Channel<'_>; N] {
    let Some(labels) = labels_of(bytes) else {
        panic!("the policy is damaged: it has no labels")
    };
    let mut text = labels.as_bytes();
    let mut skipped = 0;
    while skipped < skip {
        (_, text) = next_line(text);
        skipped += 1;
    }
    let mut channels = [Channel { name: "", unit: "" }; N];
    let mut places: &mut [Channel<'_>] = &mut channels;
    while let Some((place, others)) = places.split_first_mut() {
        if text.is_empty() {
            panic!("the policy is damaged: it has too few labels")
        }
        let (line, rest) = next_line(text);
        let (name, unit) = split_at_byte(line, b'\t');
        *place = Channel {
            name: utf8(name),
            unit: utf8(unit),
        };
        (places, text) = (others, rest);
    }
    channels
}

/// A part of a text that was cut at characters of one byte.
const fn utf8(bytes: &[u8]) -> &str {
    match core::str::from_utf8(bytes) {
        Ok(text) => text,
        Err(_) => "",
    }
}

/// The header of the policy in these bytes, checked as [`Capacities::of`] does.
///
/// # Panics
/// As [`Capacities::of`].
#[must_use]
pub const fn header(bytes: &[u8]) -> Header {
    let _ = Capacities::of(bytes);
    match Header::peek(bytes) {
        Some(header) => header,
        None => Header::EMPTY,
    }
}

/// Makes a module for a policy that is known when the program is compiled: its agent's types, its numbers and its names.
///
/// The argument is the policy's file, mostly by `include_bytes!`. A path in it is relative to the file that calls the
/// macro. What [`Capacities::of`](crate::Capacities::of) refuses does not compile. The module has
///
/// - `BYTES`, `HEADER` and `CAPACITIES`: the file, what its header says, and what its agent needs;
/// - `INPUTS`, `OUTPUTS`, `ACTIONS`: elements of an observation; continuous outputs, 0 for a discrete policy; actions of a
///   discrete policy, 0 for a continuous one;
/// - `INPUT_CHANNELS` and `OUTPUT_CHANNELS`: their names and units, as [`Channel`](crate::known::Channel)s;
/// - `PERIOD`: the time between two decisions, and `PERIOD_US`, the same in microseconds;
/// - `CONTRACT`: the hash of what plant and policy must agree on;
/// - `State`: memory for the agent's state, which `State::new()` makes in constant expressions;
/// - `load(&mut State)`: checks every table and gives an `Agent`, a [`KnownAgent`](crate::KnownAgent);
/// - `Width`: for an [`Agent`](crate::Agent) of other policies of the same width.
///
/// # Examples
/// ```
/// use tpg_runtime::{Reset, policy};
///
/// policy!(mod champion = include_bytes!("../examples/team-memory.tpg"));
/// const _: () = assert!(champion::CAPACITIES.state_bytes() <= 16 * 1024);
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut state = champion::State::new();
/// let mut agent = champion::load(&mut state)?;
/// agent.reset(Reset::Agent, 42);
/// let observation = [0.0; champion::INPUTS];
/// let decision = agent.decide(&observation);
/// # Ok(())
/// # }
/// ```
///
/// An observation of another length does not compile:
/// ```compile_fail,E0308
/// tpg_runtime::policy!(mod champion = include_bytes!("../examples/team-memory.tpg"));
///
/// let mut state = champion::State::new();
/// let mut agent = champion::load(&mut state).unwrap();
/// agent.decide(&[0.0; champion::INPUTS + 1]);
/// ```
#[macro_export]
macro_rules! policy {
    ($(#[$meta:meta])* $vis:vis mod $name:ident = $bytes:expr $(;)?) => {
        $(#[$meta])*
        #[allow(dead_code, reason = "a program uses what it needs")]
        $vis mod $name {
            /// The policy's file.
            pub static BYTES: &[u8] = $bytes;
            /// What the file's header says.
            pub const HEADER: $crate::Header = $crate::known::header(BYTES);
            /// What the agent needs.
            pub const CAPACITIES: $crate::Capacities = $crate::Capacities::needed_by(&HEADER);
            /// Elements of an observation.
            pub const INPUTS: usize = HEADER.observation_len as usize;
            /// Continuous outputs, 0 for a discrete policy.
            pub const OUTPUTS: usize = HEADER.outputs();
            /// Actions of a discrete policy, 0 for a continuous one.
            pub const ACTIONS: usize = if OUTPUTS == 0 { HEADER.actions as usize } else { 0 };
            /// Name and unit of each element of an observation.
            pub const INPUT_CHANNELS: [$crate::known::Channel<'static>; INPUTS] =
                $crate::known::channels(BYTES, 0);
            /// Name and unit of each continuous output.
            pub const OUTPUT_CHANNELS: [$crate::known::Channel<'static>; OUTPUTS] =
                $crate::known::channels(BYTES, INPUTS);
            /// Time between two decisions, in microseconds.
            pub const PERIOD_US: u32 = HEADER.control_period_us;
            /// Time between two decisions.
            pub const PERIOD: ::core::time::Duration =
                ::core::time::Duration::from_micros(PERIOD_US as u64);
            /// The hash of what plant and policy must agree on.
            pub const CONTRACT: u64 = match $crate::blob::contract_of(BYTES) {
                Some(contract) => contract,
                None => panic!("the policy is damaged: it has no labels"),
            };
            /// The width that the interpreter is compiled for.
            pub type Width = $crate::Fixed<{ CAPACITIES.width }>;
            /// Memory for the agent's state.
            pub type State = $crate::State<
                { CAPACITIES.words },
                { CAPACITIES.programs },
                { CAPACITIES.teams },
                { CAPACITIES.streams },
            >;
            /// The policy's agent, whose state is elsewhere.
            pub type Agent<'s> = $crate::KnownAgent<Width, &'s mut State, INPUTS>;

            /// Checks every table of the policy and makes its agent, reset with seed 0.
            ///
            /// # Errors
            /// What is wrong with the file.
            pub fn load(state: &mut State) -> ::core::result::Result<Agent<'_>, $crate::LoadError> {
                $crate::KnownAgent::load_in(BYTES, state)
            }
        }
    };
}
