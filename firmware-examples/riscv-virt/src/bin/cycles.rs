//! Counts the instructions of decisions over recorded observations, by policy and over the worst path. Says PASS or FAIL.
//!
//! The emulator has no cycles to count: what instructions take is assumed. On a real board, count cycles as the Nucleo does.
#![no_std]
#![no_main]

use riscv_rt::entry;
use semihosting::{println, process::exit};
use static_cell::ConstStaticCell;
use tpg_board::cycles::{judge, load};
use tpg_board::virt::InstructionCounter;
use tpg_runtime::policy;

policy!(mod champion = include_bytes!(env!("TPG_CHAMPION")));
// `tpg footprint --worst-path` makes it of the champion.
policy!(mod worst = include_bytes!(env!("TPG_WORST_PATH")));
static OBSERVATIONS: &str = include_str!(env!("TPG_OBSERVATIONS"));
// edit 2: the clock in megahertz, and cycles of an instruction, that the verdict assumes.
const MHZ: u64 = 160;
const CYCLES_PER_INSTRUCTION: u64 = 2;
static STATE: ConstStaticCell<champion::State> = ConstStaticCell::new(champion::State::new());
static WORST_STATE: ConstStaticCell<worst::State> = ConstStaticCell::new(worst::State::new());

#[entry]
fn main() -> ! {
    let policy = STATE.try_take();
    let worst = WORST_STATE.try_take();
    let counter = InstructionCounter::start();
    let allowed = u64::from(champion::PERIOD_US) * MHZ / CYCLES_PER_INSTRUCTION;
    let verdict = judge(
        policy.and_then(|state| load::<champion::Width, _>(champion::BYTES, state)),
        worst.and_then(|state| load::<worst::Width, _>(worst::BYTES, state)),
        OBSERVATIONS,
        || counter.now(),
        (allowed, "instructions"),
    );
    println!("{verdict}");
    exit(verdict.status())
}
