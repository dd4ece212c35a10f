//! Runs every policy of a pack in spare memory and prints the hashes. The host prints the same lines.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use semihosting::{println, process::exit};
use tpg_board::{microbit, pack};

#[entry]
fn main() -> ! {
    // SAFETY: The board has this memory. The program does not use it otherwise, and nothing writes to it.
    let memory = unsafe { core::slice::from_raw_parts(microbit::SPARE, microbit::SPARE_BYTES) };
    let tried = pack::try_all(memory, |number, decisions, hash| match decisions {
        Some(decisions) => println!("{number} {decisions} {:016x}", hash.0),
        None => println!("{number} end {:016x}", hash.0),
    });
    if let Err(error) = tried {
        println!("error: {error}");
        exit(1)
    }
    exit(0)
}
