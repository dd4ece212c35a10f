//! Measures decisions for `tpg footprint`: stack, size of the agent, policy instructions and processor instructions.
#![no_std]
#![no_main]

use riscv_rt::entry;
use semihosting::{println, process::exit};
use tpg_board::{measure, virt::InstructionCounter};
use tpg_runtime::{Policy, agent_type};

static CHAMPION: &[u8] = include_bytes!(env!("TPG_CHAMPION"));
type Champion = agent_type!(CHAMPION);

#[entry]
fn main() -> ! {
    let policy = Policy::load(CHAMPION).ok();
    let Some(mut agent) = policy.and_then(|policy| Champion::new(policy).ok()) else {
        exit(1)
    };
    let counter = InstructionCounter::start();
    let seen = measure::run(&mut agent, || counter.now());
    println!("agent_bytes {}", core::mem::size_of::<Champion>());
    println!("stack_bytes {}", seen.stack_bytes);
    println!("decisions {}", measure::DECISIONS);
    println!("instructions_sum {}", seen.instructions_sum);
    println!("machine_instructions_sum {}", seen.machine_sum);
    println!("machine_instructions_worst_seen {}", seen.machine_worst);
    exit(0)
}
