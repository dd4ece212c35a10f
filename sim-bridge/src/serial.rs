//! A controller at the other end of a line: a board, an emulated one behind a socket, or any program behind one or UDP.
//!
//! [`Line`] asks and waits, sends again what was lost; `SerialLink` makes it a controller's transport; [`Updater`]
//! gives a board a new policy, or takes one back. What travels is `tpg_runtime::wire`.

mod contract;
mod line;
mod link;
mod port;
mod update;

pub use line::Line;
pub(crate) use link::SerialLink;
pub use port::{Medium, SerialPath};
pub use update::{Listed, Updated, Updater};
