//! Scoring: what a policy returns on a task for given seeds.

mod baseline;
mod pool;
mod rollout;
mod seeds;

pub use baseline::{ConstantController, RandomController};
pub use pool::{Pool, Split};
pub use rollout::{Arena, Controller, Episode, EvaluationError, Reply, evaluate};
pub use seeds::{Domain, EpisodeSeeds, episode_seed};
