//! Measures decisions for `tpg footprint`: stack, size of the agent, policy instructions and processor instructions.
#![no_std]
#![no_main]

use riscv_rt::entry;
use semihosting::{println, process::exit};
use static_cell::ConstStaticCell;
use tpg_board::{measure, virt::InstructionCounter};
use tpg_runtime::{Agent, Policy, policy};

policy!(mod champion = include_bytes!(env!("TPG_CHAMPION")));
type Champion = Agent<'static, champion::Width, &'static mut champion::State>;
static STATE: ConstStaticCell<champion::State> = ConstStaticCell::new(champion::State::new());

#[entry]
fn main() -> ! {
    let policy = Policy::load(champion::BYTES).ok().zip(STATE.try_take());
    let made = policy.and_then(|(policy, state)| Champion::new_in(policy, state).ok());
    let Some(mut agent) = made else { exit(1) };
    let counter = InstructionCounter::start();
    let seen = measure::run(&mut agent, || counter.now());
    let agent_bytes = size_of::<Champion>() + size_of::<champion::State>();
    println!("agent_bytes {agent_bytes}");
    println!("stack_bytes {}", seen.stack_bytes);
    println!("decisions {}", measure::DECISIONS);
    println!("instructions_sum {}", seen.instructions_sum);
    println!("machine_instructions_sum {}", seen.machine_sum);
    println!("machine_instructions_worst_seen {}", seen.machine_worst);
    println!("instructions_in_worst_seen {}", seen.instructions_worst);
    exit(0)
}
