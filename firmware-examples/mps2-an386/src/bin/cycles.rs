//! Counts the instructions of decisions over recorded observations, by policy and over the worst path. Says PASS or FAIL.
//!
//! The emulator has no cycles to count: what instructions take is assumed. On a real board, count cycles as the Nucleo does.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use semihosting::{println, process::exit};
use tpg_board::cycles::{judge, load};
use tpg_board::mps2::InstructionCounter;
use tpg_runtime::policy;

policy!(mod champion = include_bytes!(env!("TPG_CHAMPION")));
// `tpg footprint --worst-path` makes it of the champion.
policy!(mod worst = include_bytes!(env!("TPG_WORST_PATH")));
static OBSERVATIONS: &str = include_str!(env!("TPG_OBSERVATIONS"));
// edit 2: the clock in megahertz, and cycles of an instruction, that the verdict assumes.
const MHZ: u64 = 25;
const CYCLES_PER_INSTRUCTION: u64 = 2;

#[entry]
fn main() -> ! {
    static mut STATE: champion::State = champion::State::new();
    static mut WORST_STATE: worst::State = worst::State::new();

    let counter = InstructionCounter::start();
    let allowed = u64::from(champion::PERIOD_US) * MHZ / CYCLES_PER_INSTRUCTION;
    let verdict = judge(
        load::<champion::Width, _>(champion::BYTES, STATE),
        load::<worst::Width, _>(worst::BYTES, WORST_STATE),
        OBSERVATIONS,
        || counter.now(),
        (allowed, "instructions"),
    );
    println!("{verdict}");
    exit(verdict.status())
}
