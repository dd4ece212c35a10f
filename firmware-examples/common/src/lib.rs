//! Code that the firmware examples share. It runs on boards and on hosts. Only `sim` needs `std` and a heap.
//!
//! - [`trial`]: the body of the bit-exactness test. Every machine runs the same code.
//! - [`pack`]: several policies in one block of memory, for the test that runs them all.
//! - [`selftest`]: compares one policy with a run recorded on the host.
//! - [`serial`]: the board's side of the serial line of `tpg hil --controller` and `tpg update`.
//! - [`slots`]: two slots for policies. One of them always works, even after a power cut.
//! - [`control`]: a policy in its control periods; what is late or wrong leaves the plant safe. The templates drive by it.
//! - [`cycles`]: how long decisions take over recorded observations, against the control period.
//! - `measure`: measures decisions on this machine, for `tpg footprint`. Only on targets without an operating system.
//! - [`ram`]: RAM used in place of flash on emulated boards.
//! - `sim`: simulated flash with power cuts, for tests on a host.
//! - `mps2`, `microbit`, `virt`: the registers of QEMU's boards that the examples use. Each needs the feature of the same name.
//! - `panic`: the panic handler for targets without an operating system.
//!
//! `measure`, `mps2`, `microbit`, `virt` and [`ram`] contain `unsafe` code, because they access memory by address.
#![no_std]

pub mod control;
pub mod cycles;
#[cfg(target_os = "none")]
pub mod measure;
#[cfg(feature = "microbit")]
pub mod microbit;
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

/// Reads a public key that `tpg keygen` wrote, in a constant expression.
///
/// # Panics
/// If the text is no public key. Then the firmware does not compile.
#[cfg(feature = "signature")]
#[must_use]
pub const fn public_key(text: &[u8]) -> tpg_runtime::signature::PublicKey {
    use tpg_runtime::signature::{PUBLIC_PREFIX, parse_key};
    match parse_key(text, PUBLIC_PREFIX) {
        Some(key) => key,
        None => {
            panic!("TPG_PUBLIC_KEY names no public key: `tpg keygen KEY` writes one to KEY.pub")
        }
    }
}
