//! The fixed-size header, readable in constant expressions.

use super::{CRC_BYTES, MAGIC, OLDEST_VERSION, VERSION};
use crate::isa::FINGERPRINT;

macro_rules! coded {
    ($(#[$doc:meta])* $name:ident { $($(#[$variant_doc:meta])* $variant:ident = $code:literal $text:literal,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[repr(u8)]
        #[non_exhaustive]
        pub enum $name { $($(#[$variant_doc])* $variant = $code,)* }

        impl $name {
            /// Every value, in the order of their codes.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];

            const fn from_code(code: u8) -> Option<Self> {
                match code { $($code => Some(Self::$variant),)* _ => None }
            }

            /// The name used in configurations and reports.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $text,)* }
            }
        }
    };
}

coded! {
    /// What a decision yields.
    ActionKind {
        /// The index of one of several actions.
        Discrete = 0 "discrete",
        /// One value for each output.
        Continuous = 1 "continuous",
        /// One value for each output, from programs of its own: the highest bidder among those gives it.
        Each = 2 "each",
    }
}

impl ActionKind {
    /// Whether this build of the runtime executes such policies; feature `action-programs` for [`ActionKind::Each`].
    #[must_use]
    pub const fn is_built(self) -> bool {
        cfg!(feature = "action-programs") || !matches!(self, Self::Each)
    }
}

coded! {
    /// Whether registers outlive a decision (thesis §3.6).
    RegisterMode {
        /// Set to their initial values before each run of the program (SL, SL-NC).
        Stateless = 0 "stateless",
        /// Set to their initial values at the start of the reset scope, then left to accumulate (SR).
        Stateful = 1 "stateful",
    }
}

coded! {
    /// Where the initial values of registers and memory come from (thesis §3.4.3).
    InitialValues {
        /// All zero; the blob holds no constants.
        Zero = 0 "zero",
        /// Evolved constants.
        Evolved = 1 "evolved",
    }
}

coded! {
    /// When registers and memory are reset (thesis Algorithm 1).
    ResetScope {
        /// Registers when an agent starts; memory never.
        Original = 0 "original",
        /// Registers when an agent starts; memory when a generation does.
        PerGeneration = 1 "per-generation",
        /// Both when an agent starts.
        PerAgent = 2 "per-agent",
        /// Both when an episode starts.
        PerEpisode = 3 "per-episode",
        /// Registers before every run; for policies without memory and with stateless registers.
        EveryDecision = 4 "every-decision",
        /// Registers when an episode starts, memory when an agent does (a rule that may evolve, thesis §2.7).
        MemoryPerAgent = 5 "memory-per-agent",
        /// Registers when an agent starts, memory when an episode does (a rule that may evolve, thesis §2.7).
        MemoryPerEpisode = 6 "memory-per-episode",
    }
}

impl ResetScope {
    /// Whether registers and random streams, and whether memory, are reset at the start of an agent's evaluation.
    #[must_use]
    pub const fn at_agent(self) -> (bool, bool) {
        match self {
            Self::Original | Self::PerGeneration => (true, false),
            _ => (true, true),
        }
    }

    /// Whether registers and random streams, and whether memory, are reset at the start of an episode.
    #[must_use]
    pub const fn at_episode(self) -> (bool, bool) {
        match self {
            Self::Original | Self::PerGeneration | Self::PerAgent => (false, false),
            Self::PerEpisode | Self::EveryDecision => (true, true),
            Self::MemoryPerAgent => (true, false),
            Self::MemoryPerEpisode => (false, true),
        }
    }
}

coded! {
    /// What memory the programs share.
    MemoryModel {
        /// None.
        None = 0 "none",
        /// Team-specific memory of scalars, vectors and matrices (thesis §3.4.2).
        Team = 1 "team",
        /// Indexed memory of 100 × 8 scalars (thesis §2.4.3).
        Indexed = 2 "indexed",
    }
}

coded! {
    /// With what probabilities writes reach the slots or cells of memory.
    WriteDistribution {
        /// The thesis's own: normal for team memory (Equation 3.4.1), of Cauchy's shape for indexed memory
        /// (Equation 2.4.2).
        Thesis = 0 "thesis",
        /// All slots or cells alike (thesis §2.7).
        Uniform = 1 "uniform",
        /// Each memory with the other one's shape (thesis §2.7).
        Exchanged = 2 "exchanged",
    }
}

/// What the header of a blob says, except sizes that only the decoder needs.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Header {
    /// Bytes of the body.
    pub body_bytes: u32,
    /// State words (f32) that the policy needs, at most 65 535.
    pub words: u32,
    /// Number of programs.
    pub programs: u16,
    /// Number of teams.
    pub teams: u16,
    /// Number of random streams of team memory.
    pub streams: u16,
    /// Vector width W: length of vector registers, rows and columns of matrix registers.
    pub width: u16,
    /// Length of the observation.
    pub observation_len: u16,
    /// State words that hold the observation, repeated cyclically.
    pub window: u16,
    /// Number of outputs of a continuous policy, of actions of a discrete one.
    pub actions: u16,
    /// What a decision yields.
    pub action_kind: ActionKind,
    /// Whether registers outlive a decision.
    pub register_mode: RegisterMode,
    /// Where initial values come from.
    pub initial_values: InitialValues,
    /// When registers and memory are reset.
    pub reset_scope: ResetScope,
    /// What memory programs share.
    pub memory_model: MemoryModel,
    /// With what probabilities writes reach the slots or cells of memory.
    pub write_distribution: WriteDistribution,
    /// State words of its own that the policy's [front end](crate::front_end) has; `None` without a front end.
    ///
    /// A header with one is of format version 2, the others of version 1.
    pub front_end: Option<u16>,
    /// Bits of the [instruction groups](crate::isa::Group) that the code uses.
    pub groups: u16,
    /// Lower limit of continuous actions, in the task's unit.
    pub action_low: f32,
    /// Upper limit of continuous actions, in the task's unit.
    pub action_high: f32,
    /// Time between two decisions, in microseconds.
    pub control_period_us: u32,
    /// Hash of configuration, seed, generation and format: names the run that made the policy.
    pub provenance: [u8; 16],
}

/// Why a header was refused; [`super::DecodeError`] carries it on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum HeaderFault {
    Short,
    Magic,
    Version(u16),
    Fingerprint(u32),
    Field(&'static str),
}

/// Reads `N` bytes at `at`; zeros past the end, which callers exclude by a check of the length.
const fn bytes_at<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    if let Some((_, rest)) = bytes.split_at_checked(at)
        && let Some(chunk) = rest.first_chunk::<N>()
    {
        return *chunk;
    }
    [0; N]
}

const fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes(bytes_at(bytes, at))
}

const fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes_at(bytes, at))
}

const fn u8_at(bytes: &[u8], at: usize) -> u8 {
    let [byte] = bytes_at(bytes, at);
    byte
}

impl Default for Header {
    /// A header of an empty discrete policy: every number is 0, and every kind is the one whose code is 0.
    ///
    /// Whoever encodes a policy starts from it and sets the fields.
    fn default() -> Self {
        Header {
            body_bytes: 0,
            words: 0,
            programs: 0,
            teams: 0,
            streams: 0,
            width: 0,
            observation_len: 0,
            window: 0,
            actions: 0,
            action_kind: ActionKind::Discrete,
            register_mode: RegisterMode::Stateless,
            initial_values: InitialValues::Zero,
            reset_scope: ResetScope::Original,
            memory_model: MemoryModel::None,
            write_distribution: WriteDistribution::Thesis,
            front_end: None,
            groups: 0,
            action_low: 0.0,
            action_high: 0.0,
            control_period_us: 0,
            provenance: [0; 16],
        }
    }
}

impl Header {
    /// Bytes of a header.
    pub const BYTES: usize = 72;

    /// Reads the header of a blob in a constant expression, to size an [`Agent`](crate::Agent) at compile time.
    ///
    /// Checks magic, version, instruction set and field values, but neither lengths nor the checksum:
    /// [`Blob::decode`](super::Blob::decode) does, when the program runs. `None` where it is refused.
    #[must_use]
    pub const fn peek(bytes: &[u8]) -> Option<Self> {
        match Self::read(bytes) {
            Ok(header) => Some(header),
            Err(_) => None,
        }
    }

    pub(crate) const fn read(bytes: &[u8]) -> Result<Self, HeaderFault> {
        if bytes.len() < Self::BYTES {
            return Err(HeaderFault::Short);
        }
        let ([m0, m1, m2, m3], [e0, e1, e2, e3]) = (bytes_at::<4>(bytes, 0), MAGIC);
        if m0 != e0 || m1 != e1 || m2 != e2 || m3 != e3 {
            return Err(HeaderFault::Magic);
        }
        let version = u16_at(bytes, 4);
        if version < OLDEST_VERSION || version > VERSION {
            return Err(HeaderFault::Version(version));
        }
        if u16_at(bytes, 6) as usize != Self::BYTES {
            return Err(HeaderFault::Field("header length"));
        }
        if u32_at(bytes, 8) != FINGERPRINT {
            return Err(HeaderFault::Fingerprint(u32_at(bytes, 8)));
        }
        let Some(action_kind) = ActionKind::from_code(u8_at(bytes, 34)) else {
            return Err(HeaderFault::Field("action kind"));
        };
        let Some(register_mode) = RegisterMode::from_code(u8_at(bytes, 35)) else {
            return Err(HeaderFault::Field("register mode"));
        };
        let Some(initial_values) = InitialValues::from_code(u8_at(bytes, 36)) else {
            return Err(HeaderFault::Field("initial values"));
        };
        let Some(reset_scope) = ResetScope::from_code(u8_at(bytes, 37)) else {
            return Err(HeaderFault::Field("reset scope"));
        };
        let Some(memory_model) = MemoryModel::from_code(u8_at(bytes, 38)) else {
            return Err(HeaderFault::Field("memory model"));
        };
        let Some(write_distribution) = WriteDistribution::from_code(u8_at(bytes, 39)) else {
            return Err(HeaderFault::Field("write distribution"));
        };
        let front_end = match (version, u16_at(bytes, 54)) {
            (OLDEST_VERSION, 0) => None,
            (OLDEST_VERSION, _) => return Err(HeaderFault::Field("reserved bytes")),
            (_, words) => Some(words),
        };
        Ok(Header {
            body_bytes: u32_at(bytes, 12),
            words: u32_at(bytes, 16),
            programs: u16_at(bytes, 20),
            teams: u16_at(bytes, 22),
            streams: u16_at(bytes, 24),
            width: u16_at(bytes, 26),
            observation_len: u16_at(bytes, 28),
            window: u16_at(bytes, 30),
            actions: u16_at(bytes, 32),
            action_kind,
            register_mode,
            initial_values,
            reset_scope,
            memory_model,
            write_distribution,
            front_end,
            groups: u16_at(bytes, 52),
            action_low: f32::from_bits(u32_at(bytes, 40)),
            action_high: f32::from_bits(u32_at(bytes, 44)),
            control_period_us: u32_at(bytes, 48),
            provenance: bytes_at(bytes, 56),
        })
    }

    /// The header as stored.
    #[must_use]
    pub(super) fn to_bytes(self) -> [u8; Self::BYTES] {
        let mut out = [0; Self::BYTES];
        let mut at = 0;
        let mut put = |bytes: &[u8]| {
            if let Some(place) = out.get_mut(at..at + bytes.len()) {
                place.copy_from_slice(bytes);
            }
            at += bytes.len();
        };
        put(&MAGIC);
        let (version, front_end_words) = match self.front_end {
            Some(words) => (VERSION, words),
            None => (OLDEST_VERSION, 0),
        };
        put(&version.to_le_bytes());
        put(&(Self::BYTES as u16).to_le_bytes());
        put(&FINGERPRINT.to_le_bytes());
        put(&self.body_bytes.to_le_bytes());
        put(&self.words.to_le_bytes());
        for field in [
            self.programs,
            self.teams,
            self.streams,
            self.width,
            self.observation_len,
            self.window,
            self.actions,
        ] {
            put(&field.to_le_bytes());
        }
        put(&[
            self.action_kind as u8,
            self.register_mode as u8,
            self.initial_values as u8,
            self.reset_scope as u8,
            self.memory_model as u8,
            self.write_distribution as u8,
        ]);
        put(&self.action_low.to_le_bytes());
        put(&self.action_high.to_le_bytes());
        put(&self.control_period_us.to_le_bytes());
        put(&self.groups.to_le_bytes());
        put(&front_end_words.to_le_bytes());
        put(&self.provenance);
        out
    }

    /// Number of floats that a decision yields: the outputs of a continuous policy, none of a discrete one.
    #[must_use]
    pub const fn outputs(&self) -> usize {
        match self.action_kind {
            ActionKind::Discrete => 0,
            ActionKind::Continuous | ActionKind::Each => self.actions as usize,
        }
    }

    /// Bytes of the whole file: header, body and checksum.
    pub(crate) const fn file_bytes(&self) -> u64 {
        Self::BYTES as u64 + self.body_bytes as u64 + CRC_BYTES as u64
    }

    /// First state word of the programs' registers: behind observation, outputs and what the front end has.
    #[must_use]
    pub const fn registers_start(&self) -> usize {
        let front_end = match self.front_end {
            Some(words) => words as usize,
            None => 0,
        };
        self.window as usize + self.outputs() + front_end
    }
}
