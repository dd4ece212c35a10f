//! A controller at the other end of a serial line: a board, or an emulated one behind a socket.
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
pub use port::SerialPath;
pub use update::{Listed, Updated, Updater};
