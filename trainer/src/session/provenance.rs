//! The hash that names the run behind a policy.

use sha2::{Digest as _, Sha256};

use tpg_runtime::blob::VERSION;

use crate::config::Config;

/// What a run's hashes have in common, found once for a run.
#[derive(Debug, Clone)]
pub(super) struct Provenance {
    run: Sha256,
}

impl Provenance {
    /// Threads, budget and paths are no part of it: they do not change a policy. `task` is what fixes the task.
    pub(super) fn new(config: &Config, task: &str, seed: u64) -> Self {
        let mut hasher = Sha256::new();
        let config = Config {
            task: task.to_owned(),
            ..config.clone()
        };
        // Writing a configuration as TOML cannot fail: it holds tables, numbers and text alone.
        hasher.update(toml::to_string(&config).unwrap_or_default());
        hasher.update(seed.to_le_bytes());
        Provenance { run: hasher }
    }

    /// First half of SHA-256 over configuration, seed, generation and format version.
    pub(super) fn of(&self, generation: u64) -> [u8; 16] {
        let mut hasher = self.run.clone();
        hasher.update(generation.to_le_bytes());
        hasher.update(VERSION.to_le_bytes());
        let digest: [u8; 32] = hasher.finalize().into();
        digest.first_chunk::<16>().copied().unwrap_or_default()
    }
}
