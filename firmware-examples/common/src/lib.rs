//! What the firmware examples share, for hosts and boards alike: no `std`, no heap.
//!
//! - [`trial`]: the body of the bit-exactness test, the same code on every machine.
//! - [`pack`]: several policies in one piece of memory, for the test that runs them all.
//! - [`selftest`]: one policy against the run that the host wrote down.
//! - [`serial`]: a board's side of the serial line of `tpg hil --controller` and `tpg update`.
//! - [`slots`]: two places for policies, one of which works wherever the power is cut.
//! - `measure`: what decisions take on this machine, for `tpg footprint`.
//! - [`ram`]: memory that stands in for flash on emulated boards.
//! - `sim`: the same for tests on a host, with power cuts.
//! - `mps2`, `virt`: the few registers of QEMU's boards that the examples touch, each behind a feature of its name.
//! - `panic`: the panic handler, where there is no operating system.
//!
//! `measure`, `mps2`, `virt` and [`ram`] hold `unsafe` code: they read and write memory at fixed addresses.
#![no_std]

#[cfg(target_os = "none")]
pub mod measure;
#[cfg(feature = "mps2")]
pub mod mps2;
pub mod pack;
#[cfg(target_os = "none")]
pub mod panic;
pub mod ram;
pub mod selftest;
pub mod serial;
#[cfg(not(target_os = "none"))]
pub mod sim;
pub mod slots;
pub mod trial;
#[cfg(feature = "virt")]
pub mod virt;

use tpg_runtime::Header;

/// Length of a policy's observation, for constant expressions; 0 if the bytes are no policy.
#[must_use]
pub const fn inputs(policy: &[u8]) -> usize {
    match Header::peek(policy) {
        Some(header) => header.observation_len as usize,
        None => 0,
    }
}
