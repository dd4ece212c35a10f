//! A run of decisions and a hash of all that they did, for comparing machines bit by bit.
//!
//! Nothing here computes with floats: the numbers that a policy sees are put together from integers, so that no
//! compiler and no floating-point unit has a say in them.

use tpg_runtime::hash::{START_64, fnv1a_64};
use tpg_runtime::{Action, Agent, Decision, Reset, Width};

/// Decisions between two reports.
pub const REPORT_EVERY: u32 = 100;
/// Decisions in an episode; the agent is reset between two of them.
pub const EPISODE: u32 = 500;
/// Longest observation that a trial makes.
pub const MAX_OBSERVATION: usize = 64;

/// SplitMix64: integers only, the same on every machine.
#[derive(Debug, Clone)]
pub struct Generator(u64);

impl Generator {
    /// A generator; equal seeds give equal numbers.
    #[must_use]
    pub const fn new(seed: u64) -> Self {
        Generator(seed)
    }

    /// The next 64 bits.
    pub const fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A float with this exponent field, any sign and any mantissa.
    const fn float(&mut self, exponent: u32) -> f32 {
        f32::from_bits((self.bits() as u32 & 0x807f_ffff) | exponent << 23)
    }

    /// A value as sensors give it: magnitude from 2^-7 to 8.
    const fn ordinary(&mut self) -> f32 {
        let exponent = 120 + (self.bits() % 10) as u32;
        self.float(exponent)
    }

    /// Any kind of value: zeros of both signs, subnormals, tiny and huge numbers, NaN, infinities.
    const fn any(&mut self) -> f32 {
        match self.bits() % 12 {
            0 => 0.0,
            1 => -0.0,
            2 => self.float(0),
            3 => {
                let exponent = 250 + (self.bits() % 5) as u32;
                self.float(exponent)
            }
            4 => f32::from_bits(0x7fc0_0001 | (self.bits() as u32 & 0x803f_ffff)),
            5 => f32::INFINITY,
            6 => f32::NEG_INFINITY,
            7 => {
                let exponent = 1 + (self.bits() % 254) as u32;
                self.float(exponent)
            }
            _ => self.ordinary(),
        }
    }

    /// An observation: in 16 of 32 cases ordinary, in 8 blank, in 8 with values of every kind.
    pub const fn observe(&mut self, observation: &mut [f32]) {
        let kind = self.bits() % 32;
        let mut rest = observation;
        while let [first, tail @ ..] = rest {
            *first = match kind {
                0..16 => self.ordinary(),
                16..24 => 0.0,
                _ => self.any(),
            };
            rest = tail;
        }
    }
}

/// FNV-1a, 64 bits, over 32-bit words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hash(pub u64);

impl Hash {
    /// The hash of nothing.
    pub const START: Hash = Hash(START_64);

    /// Takes in a word.
    pub const fn add(&mut self, word: u32) {
        self.0 = fnv1a_64(self.0, &word.to_le_bytes());
    }

    fn decision(&mut self, decision: &Decision<'_>) {
        match decision.action {
            Action::Discrete(index) => self.add(u32::from(index)),
            Action::Continuous(values) => values.iter().for_each(|x| self.add(x.to_bits())),
        }
        self.add(decision.instructions);
        self.add(u32::from(decision.winner.0));
        self.add(u32::from(decision.teams));
    }
}

/// What a trial came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Outcome {
    /// Hash of every decision and of the state at the end.
    pub hash: Hash,
    /// Most teams that a decision visited.
    pub deepest: u16,
}

/// Lets an agent decide so many times, resetting it now and then, and reports the running hash every
/// [`REPORT_EVERY`] decisions.
pub fn run<
    W: Width,
    const WORDS: usize,
    const PROGRAMS: usize,
    const TEAMS: usize,
    const STREAMS: usize,
>(
    agent: &mut Agent<'_, W, WORDS, PROGRAMS, TEAMS, STREAMS>,
    seed: u64,
    decisions: u32,
    mut report: impl FnMut(u32, Hash),
) -> Outcome {
    let mut generator = Generator::new(seed);
    let mut buffer = [0.0; MAX_OBSERVATION];
    let len = usize::from(agent.policy().header().observation_len);
    let observation = buffer.get_mut(..len).unwrap_or_default();
    let mut outcome = Outcome {
        hash: Hash::START,
        deepest: 0,
    };
    agent.reset(Reset::Agent, seed);
    for number in 1..=decisions {
        generator.observe(observation);
        // A length that does not fit leaves the hash as it was, which no other machine's run equals.
        if let Ok(decision) = agent.decide(observation) {
            outcome.hash.decision(&decision);
            outcome.deepest = outcome.deepest.max(decision.teams);
        }
        if number % REPORT_EVERY == 0 {
            report(number, outcome.hash);
        }
        if number % EPISODE == 0 {
            agent.reset(Reset::Episode, generator.bits());
        }
    }
    agent
        .words()
        .iter()
        .for_each(|x| outcome.hash.add(x.to_bits()));
    outcome
}
