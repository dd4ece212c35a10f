//! Counts policy instructions and processor instructions for a pack of policies in spare memory. Their width is 11.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use semihosting::{println, process::exit};
use tpg_board::{measure, mps2, pack};
use tpg_runtime::{Agent, Fixed, State};

type Room = State<2048, 8, 4, 4>;

#[entry]
fn main() -> ! {
    static mut ROOM: Room = Room::new();

    // SAFETY: The board has this memory. The program does not use it otherwise, and nothing writes to it.
    let memory = unsafe { core::slice::from_raw_parts(mps2::SPARE, mps2::SPARE_BYTES) };
    let counter = mps2::InstructionCounter::start();
    let Ok(policies) = pack::policies(memory) else {
        println!("error: {}", pack::PackError::NoPack);
        exit(1)
    };
    for policy in policies {
        let made = policy.ok().and_then(|(_, policy)| {
            let agent: Option<Agent<'_, Fixed<11>, _>> = Agent::new_in(policy, &mut *ROOM).ok();
            agent
        });
        let Some(mut agent) = made else {
            println!("error: no policy of width 11, or one too large");
            exit(1)
        };
        let seen = measure::run(&mut agent, || counter.now());
        println!("{} {}", seen.instructions_sum, seen.machine_sum);
    }
    exit(0)
}
