//! Counts the cycles of decisions over recorded observations, by policy and over the worst path. Says PASS or FAIL.
//!
//! The counter is the processor's own (DWT CYCCNT), so wait states of the flash and its cache are in the numbers.
#![no_std]
#![no_main]

use cortex_m::peripheral::DWT;
use cortex_m_rt::entry;
use semihosting::{println, process::exit};
use stm32f4xx_hal::{pac, prelude::*, rcc::Config};
use tpg_board::cycles::{Report, replay};
use tpg_runtime::{Agent, Policy, policy};

policy!(mod champion = include_bytes!(env!("TPG_CHAMPION")));
// `tpg footprint --worst-path` makes it of the champion.
policy!(mod worst = include_bytes!(env!("TPG_WORST_PATH")));
static OBSERVATIONS: &str = include_str!(env!("TPG_OBSERVATIONS"));
type Champion = Agent<'static, champion::Width, &'static mut champion::State>;
type Worst = Agent<'static, worst::Width, &'static mut worst::State>;
// The clock in megahertz, as `decide` runs.
const MHZ: u32 = 168;

#[entry]
fn main() -> ! {
    static mut STATE: champion::State = champion::State::new();
    static mut WORST_STATE: worst::State = worst::State::new();

    // `take` succeeds because this is its first call after reset.
    let devices = pac::Peripherals::take().zip(cortex_m::Peripherals::take());
    let Some((device, mut core)) = devices else {
        exit(1)
    };
    device.RCC.freeze(
        Config::hse(8.MHz())
            .bypass_hse_oscillator()
            .sysclk(MHZ.MHz()),
    );
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
    let policy = Policy::load(champion::BYTES).ok();
    let made = policy.and_then(|policy| Champion::new_in(policy, STATE).ok());
    let policy = Policy::load(worst::BYTES).ok();
    let made = made.zip(policy.and_then(|policy| Worst::new_in(policy, WORST_STATE).ok()));
    let Some((mut agent, mut worst)) = made else {
        println!("cycles: a policy is damaged");
        exit(1)
    };
    let measured = replay(&mut agent, OBSERVATIONS, DWT::cycle_count)
        .and_then(|policy| Ok((policy, replay(&mut worst, OBSERVATIONS, DWT::cycle_count)?)));
    match measured {
        Ok((policy, worst_path)) => {
            let report = Report {
                unit: "cycles",
                policy,
                worst_path,
                allowed: u64::from(champion::PERIOD_US) * u64::from(MHZ),
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
