//! Counts the cycles of decisions over recorded observations, by policy and over the worst path. Says PASS or FAIL.
//!
//! The counter is the processor's own (DWT CYCCNT), so wait states of the flash and its cache are in the numbers.
#![no_std]
#![no_main]

use cortex_m::peripheral::DWT;
use cortex_m_rt::entry;
use semihosting::{println, process::exit};
use stm32f4xx_hal::{pac, prelude::*, rcc::Config};
use tpg_board::cycles::{judge, load};
use tpg_runtime::policy;

policy!(mod champion = include_bytes!(env!("TPG_CHAMPION")));
// `tpg footprint --worst-path` makes it of the champion.
policy!(mod worst = include_bytes!(env!("TPG_WORST_PATH")));
static OBSERVATIONS: &str = include_str!(env!("TPG_OBSERVATIONS"));
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
    let verdict = judge(
        load::<champion::Width, _>(champion::BYTES, STATE),
        load::<worst::Width, _>(worst::BYTES, WORST_STATE),
        OBSERVATIONS,
        DWT::cycle_count,
        (u64::from(champion::PERIOD_US) * u64::from(MHZ), "cycles"),
    );
    println!("{verdict}");
    exit(verdict.status())
}
