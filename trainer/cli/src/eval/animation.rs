//! `tpg eval --animate`: what draws, in builds with the feature `render`, and how to get one in the others.

#[cfg(feature = "render")]
mod drawn;
#[cfg(not(feature = "render"))]
mod none;
mod size;

#[cfg(feature = "render")]
pub(super) use drawn::Animation;
#[cfg(not(feature = "render"))]
pub(super) use none::Animation;
pub(super) use size::Size;
