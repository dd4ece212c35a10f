//! Where the randomness of an episode comes from.
//!
//! Seeds derive from run, generation and episode alone, never from a worker or from time.

use tpg_runtime::rng::mix64;

use crate::task::Rng;

/// What an episode is for; seeds of different domains never coincide by construction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u64)]
pub enum Domain {
    /// Scores that steer evolution.
    Train = 1,
    /// Choosing a champion.
    Select = 2,
    /// Reported results.
    Test = 3,
}

/// The seed of an episode, the same for all individuals of a generation.
#[must_use]
pub fn episode_seed(domain: Domain, run_seed: u64, generation: u64, episode: u64) -> u64 {
    mix64(&[domain as u64, run_seed, generation, episode])
}

/// The independent streams of one episode.
#[derive(Debug, Clone)]
pub struct EpisodeSeeds {
    /// Draws the initial state.
    pub initial_state: Rng,
    /// Decides when the observation is masked.
    pub mask: Rng,
    /// Seeds the wrappers other than masks, such as noise.
    pub wrappers: u64,
    /// Seeds the agent's own random streams.
    pub agent: u64,
}

impl EpisodeSeeds {
    /// The streams that an episode's seed stands for.
    #[must_use]
    pub fn new(episode_seed: u64) -> Self {
        EpisodeSeeds {
            initial_state: Rng::new(mix64(&[episode_seed, 0])),
            mask: Rng::new(mix64(&[episode_seed, 1])),
            wrappers: mix64(&[episode_seed, 2]),
            agent: mix64(&[episode_seed, 3]),
        }
    }
}
