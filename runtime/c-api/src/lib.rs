//! The runtime for C.
//!
//! `tpg_memory_size`, `tpg_init`, `tpg_reset` and `tpg_decide` execute a policy's file in the caller's memory.
//!
//! This crate needs `unsafe` because pointers come from C. Each function documents what its pointers must be. It answers
//! other misuse with a status.
//!
//! | feature | effect | default |
//! |---|---|---|
//! | `bare-metal` | builds without `std` and adds the panic handler that Rust then demands | off |
#![cfg_attr(feature = "bare-metal", no_std)]

mod agent;
mod layout;
mod status;
mod width;

pub use agent::*;
pub use status::{TpgStatus, tpg_status_message};

/// Rust demands a panic handler in a library without `std`. Nothing here panics, so the linker drops it.
#[cfg(feature = "bare-metal")]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
