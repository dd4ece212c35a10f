//! Scoring: what a policy returns on a task for given seeds.

mod ablation;
mod baseline;
mod controller;
mod disturb;
mod disturbance;
mod health;
mod lanes;
mod rollout;
mod seeds;
mod shaping;

pub use ablation::{CountingWinners, Forgetful, MostUsed};
pub use baseline::{ConstantController, RandomController};
pub use controller::{Controller, Reply};
pub use disturb::{Disturbed, Line, Link};
pub use disturbance::{
    Direction, DisturbError, Disturbance, Effect, Fault, MAX_DELAY, Probability, Which, Window,
};
pub use health::{ChannelHealth, Watched};
pub use lanes::{LANES, LaneMemory, Lanes};
pub use rollout::{Arena, Conditions, Episode, EvaluationError, evaluate};
pub use seeds::{Domain, EpisodeSeeds, episode_seed};
pub use shaping::Shaping;
