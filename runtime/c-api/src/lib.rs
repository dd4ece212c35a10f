//! The runtime for C.
//!
//! - `tpg_memory_size`, `tpg_init`, `tpg_reset`, `tpg_decide`: execute a policy's file in memory that the caller gives.
//! - `tpg_math_*`: the functions that policies compiled to C call, so that their bits are the runtime's.
//!
//! This crate needs `unsafe` because pointers come from C. Each call documents what its pointers must be. Within that,
//! every misuse is answered with a status.
//!
//! | feature | effect | default |
//! |---|---|---|
//! | `bare-metal` | no `std`; brings the panic handler that a library without an operating system must have | off |
#![cfg_attr(feature = "bare-metal", no_std)]

mod agent;
mod layout;
mod math;
mod status;
mod width;

pub use agent::*;
pub use math::*;
pub use status::{TpgStatus, tpg_status_message};

/// Rust demands one in a library without `std`; nothing in this library panics, so linkers drop it.
#[cfg(feature = "bare-metal")]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
