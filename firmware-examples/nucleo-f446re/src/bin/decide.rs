//! Decides once per control period. If the program stops doing so, the watchdog restarts the board.
#![no_std]
#![no_main]

#[path = "../plant.rs"]
mod plant;

use cortex_m_rt::entry;
use stm32f4xx_hal::{
    pac, prelude::*, rcc::Config, timer::CounterUs, watchdog::IndependentWatchdog,
};
use tpg_board as _; // The panic handler.
use tpg_runtime::{Reset, policy};

policy!(mod champion = include_bytes!(env!("TPG_CHAMPION")));
// If the policy needs more RAM than you allow here, the build fails. Otherwise the robot would fail.
const _: () = assert!(champion::CAPACITIES.state_bytes() <= 64 * 1024);
// The watchdog counts milliseconds, at most 32 s.
const _: () = assert!(champion::PERIOD_US > 0 && champion::PERIOD_US <= 10_000_000);

#[entry]
fn main() -> ! {
    // The agent's state. It is zero at the start, so it takes no flash and never lies on the stack.
    static mut STATE: champion::State = champion::State::new();

    plant::make_safe();
    // `take` succeeds because this is its first call after reset.
    let (Some(device), Ok(mut agent)) = (pac::Peripherals::take(), champion::load(STATE)) else {
        stay_safe()
    };
    if !plant::fits(agent.agent().policy()) {
        stay_safe()
    }
    let Some(mut timer) = control_timer(device.RCC, device.TIM5) else {
        stay_safe()
    };
    let mut watchdog = IndependentWatchdog::new(device.IWDG);
    watchdog.start((3 * champion::PERIOD_US.div_ceil(1000)).millis());
    agent.reset(Reset::Agent, 1);
    loop {
        step(&mut agent);
        // The timer keeps counting while the policy decides, so the period does not drift.
        while timer.wait().is_err() {}
        watchdog.feed();
    }
}

/// A separate function, so that `tpg footprint` can find the most stack that a decision can use.
#[inline(never)]
fn step(agent: &mut champion::Agent<'_>) {
    let mut observation = [0.0; champion::INPUTS];
    plant::sense(&mut observation);
    plant::act(agent.decide(&observation).action);
}

/// A timer with the control period. This is a separate function so that the compiler sees only constants. It can
/// then remove the library's panics for impossible clocks.
#[inline(never)]
fn control_timer(rcc: pac::RCC, timer: pac::TIM5) -> Option<CounterUs<pac::TIM5>> {
    let mut rcc = rcc.freeze(
        Config::hse(8.MHz())
            .bypass_hse_oscillator()
            .sysclk(168.MHz()),
    );
    let mut timer = timer.counter_us(&mut rcc);
    timer
        .start(champion::PERIOD_US.micros())
        .ok()
        .map(|()| timer)
}

fn stay_safe() -> ! {
    loop {
        plant::make_safe();
    }
}
