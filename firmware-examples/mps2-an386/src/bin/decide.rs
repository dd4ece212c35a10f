//! Decides once per control period.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use tpg_runtime::{Action, Capacities, Policy, Reset, agent_type};

static CHAMPION: &[u8] = include_bytes!(env!("TPG_CHAMPION"));
type Champion = agent_type!(CHAMPION);
// If the policy needs more RAM than you allow here, the build fails. Otherwise the robot would fail.
const _: () = assert!(Capacities::of(CHAMPION).state_bytes() <= 64 * 1024);
const INPUTS: usize = tpg_board::inputs(CHAMPION);

#[entry]
fn main() -> ! {
    let policy = Policy::load(CHAMPION).ok();
    let Some(mut agent) = policy.and_then(|policy| Champion::new(policy).ok()) else {
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
fn step(agent: &mut Champion) {
    let mut observation = [0.0; INPUTS];
    sense(&mut observation);
    if let Ok(decision) = agent.decide(&observation) {
        act(decision.action);
    }
}

/// edit 2: read your sensors.
fn sense(observation: &mut [f32]) {
    core::hint::black_box(observation);
}

/// edit 3: drive your actuators.
fn act(action: Action<'_>) {
    core::hint::black_box(action);
}
