//! The header of a blob. It has a fixed size, and constant expressions can read it.

use super::{CRC_BYTES, MAGIC, MAX_FILE_BYTES, MAX_SECTIONS, OLDEST_VERSION, VERSION};
use crate::isa::{EDITIONS, Edition};
use crate::parts::Field;

macro_rules! coded {
    ($(#[$doc:meta])* $name:ident { $($(#[$variant_doc:meta])* $variant:ident = $code:literal $text:literal,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[repr(u8)]
        #[non_exhaustive]
        pub enum $name { $($(#[$variant_doc])* $variant = $code,)* }

        impl $name {
            /// Every value, in the order of the codes.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];

            const fn from_code(code: u8) -> Option<Self> {
                match code { $($code => Some(Self::$variant),)* _ => None }
            }

            /// The name that configurations and reports use.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $text,)* }
            }
        }
    };
}

coded! {
    /// What kind of action a decision returns.
    ActionKind {
        /// The index of one action.
        Discrete = 0 "discrete",
        /// One value for each output. The winning program gives all of them.
        Continuous = 1 "continuous",
        /// One value for each output. Each output has its own programs.
        /// The highest bidder among them gives the value.
        Each = 2 "each",
    }
}

impl ActionKind {
    /// Whether this build executes policies of this kind.
    ///
    /// [`ActionKind::Each`] needs the feature `action-programs`.
    #[must_use]
    pub const fn is_built(self) -> bool {
        cfg!(feature = "action-programs") || !matches!(self, Self::Each)
    }

    /// Weighted operations that a member costs a decision besides its program's instructions.
    pub(crate) const fn weight_of_member(self) -> u64 {
        match self {
            Self::Discrete | Self::Continuous => 4,
            // Two more passes over the members choose for each output.
            Self::Each => 8,
        }
    }
}

coded! {
    /// Whether registers keep their values from one decision to the next (thesis §3.6).
    RegisterMode {
        /// Registers are set to their initial values before each run of the program (SL, SL-NC).
        Stateless = 0 "stateless",
        /// Registers are set to their initial values when the [`ResetScope`] requires it. Otherwise they keep their
        /// values (SR).
        Stateful = 1 "stateful",
    }
}

coded! {
    /// Where the initial values of registers and memory come from (thesis §3.4.3).
    InitialValues {
        /// All initial values are zero. The blob holds no constants.
        Zero = 0 "zero",
        /// Evolved constants, which the blob holds.
        Evolved = 1 "evolved",
    }
}

coded! {
    /// When registers and memory are reset (thesis Algorithm 1).
    ResetScope {
        /// Registers are reset when an agent starts. Memory is never reset.
        Original = 0 "original",
        /// Registers are reset when an agent starts. Memory is reset when a generation starts.
        PerGeneration = 1 "per-generation",
        /// Registers and memory are reset when an agent starts.
        PerAgent = 2 "per-agent",
        /// Registers and memory are reset when an episode starts.
        PerEpisode = 3 "per-episode",
        /// Registers are reset before every run. A policy has this scope if and only if its registers are
        /// stateless and it has no memory.
        EveryDecision = 4 "every-decision",
        /// Registers are reset when an episode starts, memory when an agent starts. Evolution may choose this scope
        /// (thesis §2.7).
        MemoryPerAgent = 5 "memory-per-agent",
        /// Registers are reset when an agent starts, memory when an episode starts. Evolution may choose this scope
        /// (thesis §2.7).
        MemoryPerEpisode = 6 "memory-per-episode",
    }
}

impl ResetScope {
    /// What is reset at the start of an agent's evaluation.
    ///
    /// The first value says whether registers and random streams are reset, the second whether memory is reset.
    #[must_use]
    pub const fn at_agent(self) -> (bool, bool) {
        match self {
            Self::Original | Self::PerGeneration => (true, false),
            _ => (true, true),
        }
    }

    /// What is reset at the start of an episode.
    ///
    /// The first value says whether registers and random streams are reset, the second whether memory is reset.
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
    /// What kind of memory the programs share.
    MemoryModel {
        /// There is no shared memory.
        None = 0 "none",
        /// Each team has its own memory of scalars, vectors and matrices (thesis §3.4.2).
        Team = 1 "team",
        /// All programs share an indexed memory of 100 × 8 scalars (thesis §2.4.3).
        Indexed = 2 "indexed",
    }
}

coded! {
    /// The probability with which a write reaches each slot or cell of memory.
    WriteDistribution {
        /// The thesis's distributions: normal for team memory (Equation 3.4.1), Cauchy-shaped for indexed memory
        /// (Equation 2.4.2).
        Thesis = 0 "thesis",
        /// The same probability for all slots or cells (thesis §2.7).
        Uniform = 1 "uniform",
        /// Each kind of memory uses the thesis's distribution of the other kind (thesis §2.7).
        Exchanged = 2 "exchanged",
    }
}

coded! {
    /// What a policy sees in place of a missing element of the observation.
    Missing {
        /// Zero. The policy has no front end.
        Zero = 0 "zero",
        /// The mean of what was observed in training.
        Mean = 1 "mean",
        /// What was perceived last.
        Hold = 2 "hold",
        /// What a learned model predicts.
        Model = 3 "model",
    }
}

impl Missing {
    /// What the first byte of a front-end section says, `None` if it has no meaning.
    pub(crate) const fn of_section(kind: u8) -> Option<Self> {
        Self::from_code(kind.saturating_add(1))
    }
}

/// The fields of a blob's header.
///
/// The magic, the header's length and the fingerprint are left out, because only the decoder needs them.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Header {
    /// Format version of the file. It decides what the policy sees of a missing element.
    pub version: u16,
    /// Length of the body in bytes.
    pub body_bytes: u32,
    /// Number of state words (f32) that the policy needs. The verifier accepts at most 65 535.
    pub words: u32,
    /// Number of programs.
    pub programs: u16,
    /// Number of teams.
    pub teams: u16,
    /// Number of random streams of team memory.
    pub streams: u16,
    /// Vector width W. Vector registers have W elements, matrix registers W rows and W columns.
    pub width: u16,
    /// Number of elements of the observation.
    pub observation_len: u16,
    /// Number of state words that hold the last observations, the newest first. They repeat until they fill them.
    pub window: u16,
    /// Number of actions of a discrete policy, or number of outputs of any other policy.
    pub actions: u16,
    /// What kind of action a decision returns.
    pub action_kind: ActionKind,
    /// Whether registers keep their values from one decision to the next.
    pub register_mode: RegisterMode,
    /// Where the initial values of registers and memory come from.
    pub initial_values: InitialValues,
    /// When registers and memory are reset.
    pub reset_scope: ResetScope,
    /// What kind of memory the programs share.
    pub memory_model: MemoryModel,
    /// The probability with which a write reaches each slot or cell of memory.
    pub write_distribution: WriteDistribution,
    /// Number of state words that the policy's [front end](crate::front_end) needs for itself. `None` if the policy has
    /// no front end.
    pub front_end: Option<u16>,
    /// The [instruction groups](crate::isa::Group) that the code uses, one bit each.
    pub groups: u16,
    /// Lower limit of continuous actions, in the task's unit. 0 for discrete policies.
    pub action_low: f32,
    /// Upper limit of continuous actions, in the task's unit. 0 for discrete policies.
    pub action_high: f32,
    /// Time between two decisions, in microseconds.
    pub control_period_us: u32,
    /// Hash of configuration, seed, generation and format. It identifies the run that made the policy.
    pub provenance: [u8; 16],
    /// Hash of the contract as stored, 0 before version 3. [`contract`](super::contract()) computes it for any version.
    pub contract: u64,
    /// Number against downgrades, which the maker raises. 0 for none, and before version 3.
    pub release: u32,
    /// Observations in the window, this one included; at least 1.
    pub history: u16,
    /// Entries of the directory. 0 before version 3.
    pub sections: u16,
    /// What stands for a missing element. [`Missing::Zero`] in the headers of versions 1 and 2, which do not say it.
    pub missing: Missing,
}

/// Why a header was refused. The decoder converts it to a [`super::DecodeError`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum HeaderFault {
    /// Fewer bytes than this header has, with its length.
    Short(usize),
    Magic,
    Version(u16),
    Fingerprint(u32),
    Field(Field),
}

/// Reads `N` bytes at `at`.
///
/// Returns zeros if they lie past the end. Callers check the length first, so this does not happen.
pub(super) const fn bytes_at<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
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

const fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(bytes_at(bytes, at))
}

const fn u8_at(bytes: &[u8], at: usize) -> u8 {
    let [byte] = bytes_at(bytes, at);
    byte
}

impl Default for Header {
    /// [`Header::EMPTY`].
    fn default() -> Self {
        Self::EMPTY
    }
}

impl Header {
    /// Length of a header in bytes. Headers of versions 1 and 2 have 24 bytes fewer, but every file has this many.
    pub const BYTES: usize = 96;
    /// The header of an empty discrete policy. Every number is 0, and every kind is the one with code 0.
    ///
    /// Code that encodes a policy starts from this header and sets the fields.
    pub const EMPTY: Self = Header {
        version: VERSION,
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
        contract: 0,
        release: 0,
        history: 1,
        sections: 0,
        missing: Missing::Zero,
    };
    /// Length of a header of version 1 or 2.
    pub(super) const OLD_BYTES: usize = 72;

    /// Reads the header of a blob. It works in constant expressions, so the size of an [`Agent`](crate::Agent) can be
    /// computed at compile time.
    ///
    /// Checks the magic, the version, the instruction set and the codes of the kinds. Does not check the length of the
    /// file or the checksum. [`Blob::decode`](super::Blob::decode) checks these at run time. Returns `None` if a check
    /// fails.
    #[must_use]
    pub const fn peek(bytes: &[u8]) -> Option<Self> {
        match Self::read(bytes) {
            Ok(header) => Some(header),
            Err(_) => None,
        }
    }

    pub(crate) const fn read(bytes: &[u8]) -> Result<Self, HeaderFault> {
        if bytes.len() < Self::OLD_BYTES {
            return Err(HeaderFault::Short(Self::OLD_BYTES));
        }
        let ([m0, m1, m2, m3], [e0, e1, e2, e3]) = (bytes_at::<4>(bytes, 0), MAGIC);
        if m0 != e0 || m1 != e1 || m2 != e2 || m3 != e3 {
            return Err(HeaderFault::Magic);
        }
        let version = u16_at(bytes, 4);
        if version < OLDEST_VERSION || version > VERSION {
            return Err(HeaderFault::Version(version));
        }
        let old = version < VERSION;
        let length = if old { Self::OLD_BYTES } else { Self::BYTES };
        if bytes.len() < length {
            return Err(HeaderFault::Short(length));
        }
        if u16_at(bytes, 6) as usize != length {
            return Err(HeaderFault::Field(Field::HeaderLength));
        }
        let fingerprint = u32_at(bytes, 8);
        let edition = match Edition::find(fingerprint) {
            Some(edition) if !old || fingerprint == EDITIONS[0].fingerprint => edition,
            _ => return Err(HeaderFault::Fingerprint(fingerprint)),
        };
        let groups = u16_at(bytes, 52);
        // The groups are those of the code, which verification checks. So no code lies beyond the edition.
        if groups & !edition.groups() != 0 {
            return Err(HeaderFault::Field(Field::Groups));
        }
        let Some(action_kind) = ActionKind::from_code(u8_at(bytes, 34)) else {
            return Err(HeaderFault::Field(Field::ActionKind));
        };
        let Some(register_mode) = RegisterMode::from_code(u8_at(bytes, 35)) else {
            return Err(HeaderFault::Field(Field::RegisterMode));
        };
        let Some(initial_values) = InitialValues::from_code(u8_at(bytes, 36)) else {
            return Err(HeaderFault::Field(Field::InitialValues));
        };
        let Some(reset_scope) = ResetScope::from_code(u8_at(bytes, 37)) else {
            return Err(HeaderFault::Field(Field::ResetScope));
        };
        let Some(memory_model) = MemoryModel::from_code(u8_at(bytes, 38)) else {
            return Err(HeaderFault::Field(Field::MemoryModel));
        };
        let Some(write_distribution) = WriteDistribution::from_code(u8_at(bytes, 39)) else {
            return Err(HeaderFault::Field(Field::WriteDistribution));
        };
        let front_end_words = u16_at(bytes, 54);
        let (missing, has_front_end) = if old {
            (Missing::Zero, version > 1)
        } else {
            match Missing::from_code(u8_at(bytes, 88)) {
                Some(Missing::Zero) => (Missing::Zero, false),
                Some(missing) => (missing, true),
                None => return Err(HeaderFault::Field(Field::Missing)),
            }
        };
        if !has_front_end && front_end_words != 0 {
            return Err(HeaderFault::Field(Field::FrontEndWords));
        }
        let front_end = if has_front_end {
            Some(front_end_words)
        } else {
            None
        };
        let (history, sections) = if old {
            (1, 0)
        } else {
            (u16_at(bytes, 84), u16_at(bytes, 86))
        };
        if !old && let Some(field) = Self::refused_extension(bytes) {
            return Err(HeaderFault::Field(field));
        }
        Ok(Header {
            version,
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
            groups,
            action_low: f32::from_bits(u32_at(bytes, 40)),
            action_high: f32::from_bits(u32_at(bytes, 44)),
            control_period_us: u32_at(bytes, 48),
            provenance: bytes_at(bytes, 56),
            contract: if old { 0 } else { u64_at(bytes, 72) },
            release: if old { 0 } else { u32_at(bytes, 80) },
            history,
            sections,
            missing,
        })
    }

    /// The field of version 3 that holds what this build does not read, or what no file may hold, if there is one.
    const fn refused_extension(bytes: &[u8]) -> Option<Field> {
        if u16_at(bytes, 84) == 0 {
            Some(Field::History)
        } else if u16_at(bytes, 86) > MAX_SECTIONS {
            Some(Field::Sections)
        } else if u8_at(bytes, 89) != 0 {
            Some(Field::Tasks)
        } else if u16_at(bytes, 90) != 0 || u32_at(bytes, 92) != 0 {
            Some(Field::Reserved)
        } else if u32_at(bytes, 12) > MAX_FILE_BYTES - (Self::BYTES + CRC_BYTES) as u32 {
            Some(Field::BodyBytes)
        } else {
            None
        }
    }

    /// The header as a blob of version 3 stores it.
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
        put(&VERSION.to_le_bytes());
        put(&(Self::BYTES as u16).to_le_bytes());
        put(&Edition::of_groups(self.groups).fingerprint.to_le_bytes());
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
        put(&self.front_end.unwrap_or(0).to_le_bytes());
        put(&self.provenance);
        put(&self.contract.to_le_bytes());
        put(&self.release.to_le_bytes());
        put(&self.history.to_le_bytes());
        put(&self.sections.to_le_bytes());
        put(&[self.missing as u8]);
        out
    }

    /// Number of floats that a decision returns: 0 for a discrete policy, the number of outputs for any other.
    #[must_use]
    pub const fn outputs(&self) -> usize {
        match self.action_kind {
            ActionKind::Discrete => 0,
            ActionKind::Continuous | ActionKind::Each => self.actions as usize,
        }
    }

    /// Number of elements of all observations in the window, N = history · observation length. Element i·n + k is element k of
    /// the observation i decisions ago, where n is the observation's length.
    #[must_use]
    pub const fn observed(&self) -> usize {
        self.history as usize * self.observation_len as usize
    }

    /// Whether each element of an observation can be missing by itself. Before version 3, missing elements count as zero,
    /// and a front end takes an observation of zeros for one of which all is missing.
    #[inline]
    #[must_use]
    pub const fn has_missing_values(&self) -> bool {
        OLDEST_VERSION == VERSION || self.version >= VERSION
    }

    /// Length of the header in its file, in bytes.
    pub(crate) const fn stored_bytes(&self) -> usize {
        if OLDEST_VERSION < VERSION && self.version < VERSION {
            Self::OLD_BYTES
        } else {
            Self::BYTES
        }
    }

    /// Length of the whole file in bytes: header, body and checksum.
    pub(crate) const fn file_bytes(&self) -> u64 {
        self.stored_bytes() as u64 + self.body_bytes as u64 + CRC_BYTES as u64
    }

    /// Index of the first state word of the programs' registers. They follow the observation window, the outputs
    /// and the front end's words.
    #[must_use]
    pub const fn registers_start(&self) -> usize {
        let front_end = match self.front_end {
            Some(words) => words as usize,
            None => 0,
        };
        self.window as usize + self.outputs() + front_end
    }
}
