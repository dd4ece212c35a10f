//! Counts the instructions of decisions over recorded observations, by policy and over the worst path. Says PASS or FAIL.
//!
//! The emulator has no cycles to count: what instructions take is assumed. On a real board, count cycles as the Nucleo does.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use semihosting::{println, process::exit};
use tpg_board::cycles::{Report, replay};
use tpg_board::microbit::InstructionCounter;
use tpg_runtime::{Agent, Policy, policy};

policy!(mod champion = include_bytes!(env!("TPG_CHAMPION")));
// `tpg footprint --worst-path` makes it of the champion.
policy!(mod worst = include_bytes!(env!("TPG_WORST_PATH")));
static OBSERVATIONS: &str = include_str!(env!("TPG_OBSERVATIONS"));
type Champion = Agent<'static, champion::Width, &'static mut champion::State>;
type Worst = Agent<'static, worst::Width, &'static mut worst::State>;
// edit 2: the clock in megahertz, and cycles of an instruction, that the verdict assumes.
const MHZ: u64 = 16;
const CYCLES_PER_INSTRUCTION: u64 = 2;

#[entry]
fn main() -> ! {
    static mut STATE: champion::State = champion::State::new();
    static mut WORST_STATE: worst::State = worst::State::new();

    let policy = Policy::load(champion::BYTES).ok();
    let made = policy.and_then(|policy| Champion::new_in(policy, STATE).ok());
    let policy = Policy::load(worst::BYTES).ok();
    let made = made.zip(policy.and_then(|policy| Worst::new_in(policy, WORST_STATE).ok()));
    let Some((mut agent, mut worst)) = made else {
        println!("cycles: a policy is damaged");
        exit(1)
    };
    let counter = InstructionCounter::start();
    let measured = replay(&mut agent, OBSERVATIONS, || counter.now())
        .and_then(|policy| Ok((policy, replay(&mut worst, OBSERVATIONS, || counter.now())?)));
    match measured {
        Ok((policy, worst_path)) => {
            let report = Report {
                unit: "instructions",
                policy,
                worst_path,
                allowed: u64::from(champion::PERIOD_US) * MHZ / CYCLES_PER_INSTRUCTION,
            };
            println!("{report}");
            exit(if report.passed() { 0 } else { 5 })
        }
        Err(error) => {
            println!("cycles: {error}");
            exit(1)
        }
    }
}
