//! Decides once per control period.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use tpg_board as _; // The panic handler.
use tpg_runtime::{Action, Reset, policy};

policy!(mod champion = include_bytes!(env!("TPG_CHAMPION")));
// If the policy needs more RAM than you allow here, the build fails. Otherwise the robot would fail.
const _: () = assert!(champion::CAPACITIES.state_bytes() <= 64 * 1024);

#[entry]
fn main() -> ! {
    // The agent's state. It is zero at the start, so it takes no flash and never lies on the stack.
    static mut STATE: champion::State = champion::State::new();

    let Ok(mut agent) = champion::load(STATE) else {
        semihosting::process::exit(1) // The policy is damaged. On a robot, take the safe action here.
    };
    agent.reset(Reset::Agent, 1);
    for _ in 0..1000 {
        step(&mut agent);
    }
    semihosting::process::exit(0)
}

/// A separate function, so that `tpg footprint` can find the most stack that a decision can use.
#[inline(never)]
fn step(agent: &mut champion::Agent<'_>) {
    let mut observation = [0.0; champion::INPUTS];
    sense(&mut observation);
    act(agent.decide(&observation).action);
}

/// edit 2: read your sensors.
fn sense(observation: &mut [f32; champion::INPUTS]) {
    core::hint::black_box(observation);
}

/// edit 3: drive your actuators.
fn act(action: Action<'_>) {
    core::hint::black_box(action);
}
