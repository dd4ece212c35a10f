//! Tasks to control, and the episodes that score a policy on them.
//!
//! ```text
//! task --observation--> wrappers --> controller --action--> task        one step of an episode
//! ```
//!
//! | module | what it holds |
//! |---|---|
//! | [`task`] | the plants, their physics, and which part of the state a policy sees |
//! | [`eval`] | episodes under a controller, disturbances of the link between both, baselines, seeds |
//! | [`stats`] | means, intervals and tests over returns |
//! | [`trace`] | every decision of an evaluation, recorded and decided again |
//! | [`explain`] | which inputs a score owes something to, which programs act when, which memory they use |
//! | [`view`] | episodes as one HTML page that draws them |
//! | `animation` | an episode as an animated GIF (feature `render`) |
//! | [`page`] | what pages of HTML share |
//! | [`score`] | arguments, set-up and report of the commands that score a policy |
//! | [`exit_status`] | how a command ends: the statuses, and errors that carry one |
//! | [`console`] | what commands print, and to where |

// These macros panic where the output is closed; `console` does not.
#![warn(clippy::print_stdout, clippy::print_stderr)]

#[cfg(feature = "render")]
pub mod animation;
pub mod console;
pub mod eval;
pub mod exit_status;
pub mod explain;
#[cfg(any(test, feature = "render"))]
mod gif_writer;
pub mod page;
pub mod score;
pub mod stats;
pub mod task;
pub mod trace;
pub mod view;
