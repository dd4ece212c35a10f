//! Tunes all evolved constants of an agent together: makes constants from scores and a random stream. Scores nothing itself.
//!
//! The method is augmented random search (H. Mania, A. Guy, B. Recht, arXiv 1803.07055).

mod ars;
mod mean;
mod params;

pub use ars::{Search, Trial};
pub use mean::RecentMean;
pub use params::TuningParams;
