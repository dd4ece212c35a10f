//! Decides once in each control period; the watchdog restarts a board that stops doing so.
#![no_std]
#![no_main]

#[path = "../plant.rs"]
mod plant;

use cortex_m_rt::entry;
use stm32f4xx_hal::{
    pac, prelude::*, rcc::Config, timer::CounterUs, watchdog::IndependentWatchdog,
};
use tpg_runtime::{Capacities, Header, Policy, Reset, agent_type};

static CHAMPION: &[u8] = include_bytes!(env!("TPG_CHAMPION"));
type Champion = agent_type!(CHAMPION);
// Fails the build, not the robot, if the policy outgrows the RAM that you grant it.
const _: () = assert!(Capacities::of(CHAMPION).state_bytes() <= 64 * 1024);
const PERIOD_US: u32 = match Header::peek(CHAMPION) {
    Some(header) => header.control_period_us,
    None => 0,
};
// The watchdog counts in milliseconds, up to 32 s.
const _: () = assert!(PERIOD_US > 0 && PERIOD_US <= 10_000_000);
const INPUTS: usize = tpg_board::inputs(CHAMPION);

#[entry]
fn main() -> ! {
    plant::make_safe();
    // Reset has just made the peripherals available, once.
    let (Some(device), Ok(policy)) = (pac::Peripherals::take(), Policy::load(CHAMPION)) else {
        stay_safe()
    };
    let (true, Ok(mut agent)) = (plant::fits(&policy), Champion::new(policy)) else {
        stay_safe()
    };
    let Some(mut timer) = control_timer(device.RCC, device.TIM5) else {
        stay_safe()
    };
    let mut watchdog = IndependentWatchdog::new(device.IWDG);
    watchdog.start((3 * PERIOD_US.div_ceil(1000)).millis());
    agent.reset(Reset::Agent, 1);
    loop {
        step(&mut agent);
        // The timer counts on while the policy decides, so that nothing drifts.
        while timer.wait().is_err() {}
        watchdog.feed();
    }
}

/// A function of its own, so that `tpg footprint` can say how much stack a decision takes at most.
#[inline(never)]
fn step(agent: &mut Champion) {
    let mut observation = [0.0; INPUTS];
    plant::sense(&mut observation);
    match agent.decide(&observation) {
        Ok(decision) => plant::act(decision.action),
        Err(_) => plant::make_safe(),
    }
}

/// A timer of the control period. Apart from all else, so that the compiler sees constants alone, and drops the library's
/// panics for clocks that cannot be.
#[inline(never)]
fn control_timer(rcc: pac::RCC, timer: pac::TIM5) -> Option<CounterUs<pac::TIM5>> {
    let mut rcc = rcc.freeze(
        Config::hse(8.MHz())
            .bypass_hse_oscillator()
            .sysclk(168.MHz()),
    );
    let mut timer = timer.counter_us(&mut rcc);
    timer.start(PERIOD_US.micros()).ok().map(|()| timer)
}

fn stay_safe() -> ! {
    loop {
        plant::make_safe();
    }
}
