//! Runs decisions and hashes their results, to compare machines bit by bit.
//!
//! This code does no floating-point arithmetic. It builds the observations from integers, so they do not depend on the
//! compiler or the floating-point unit.

use tpg_runtime::hash::{START_64, fnv1a_64};
use tpg_runtime::{Action, Agent, Decision, Reset, Storage, Width};

/// The number of decisions between two reports.
pub const REPORT_EVERY: u32 = 100;
/// The number of decisions in an episode. The agent is reset after each episode.
pub const EPISODE: u32 = 500;
/// The longest observation that a trial makes, in values.
pub const MAX_OBSERVATION: usize = 64;

/// The random generator SplitMix64. It uses only integers, so it gives the same numbers on every machine.
#[derive(Debug, Clone)]
pub struct Generator(u64);

impl Generator {
    /// Creates a generator. Equal seeds give equal numbers.
    #[must_use]
    pub const fn new(seed: u64) -> Self {
        Generator(seed)
    }

    /// The next 64 random bits.
    pub const fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A float with this exponent field and with a random sign and mantissa.
    const fn float(&mut self, exponent: u32) -> f32 {
        f32::from_bits((self.bits() as u32 & 0x807f_ffff) | exponent << 23)
    }

    /// A value such as a sensor gives. Its magnitude is at least 2^-7 and below 8.
    const fn ordinary(&mut self) -> f32 {
        let exponent = 120 + (self.bits() % 10) as u32;
        self.float(exponent)
    }

    /// A value of any kind: zeros of both signs, subnormals, tiny and huge numbers, NaN and infinities.
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

    /// Fills an observation. In 16 of 32 cases its values are ordinary, in 8 all zero, in 8 of any kind.
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

/// A 64-bit FNV-1a hash over 32-bit words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hash(pub u64);

impl Hash {
    /// The hash of no words.
    pub const START: Hash = Hash(START_64);

    /// Adds a word to the hash.
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

/// The result of a trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Outcome {
    /// The hash of every decision and of the final state.
    pub hash: Hash,
    /// The most teams that a decision visited.
    pub deepest: u16,
}

/// Runs `decisions` decisions. Resets the agent at the start and after every [`EPISODE`] decisions. Calls `report` with
/// the number of decisions and the hash so far after every [`REPORT_EVERY`] decisions.
pub fn run<W: Width, S: Storage>(
    agent: &mut Agent<'_, W, S>,
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
        // If the observation's length is wrong, the hash does not change, so it differs from a correct run's.
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
