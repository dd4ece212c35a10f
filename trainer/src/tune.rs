//! Tuning of evolved constants, all of an agent's together, pure: scores and a random stream in, constants out.
//!
//! The method is augmented random search (H. Mania, A. Guy, B. Recht, arXiv 1803.07055).

mod ars;
mod mean;
mod params;

pub use ars::{Search, Trial};
pub use mean::RecentMean;
pub use params::TuningParams;
