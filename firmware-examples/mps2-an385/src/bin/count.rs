//! Counts policy instructions and processor instructions for a pack of policies in spare memory. Their width is that of
//! the champion. Each line has the sums of drawn decisions, and the most processor instructions of a decision.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use semihosting::{println, process::exit};
use tpg_board::{measure, mps2, pack};
use tpg_runtime::{Agent, Capacities, Fixed, State};

const NEED: Capacities = Capacities::of(include_bytes!(env!("TPG_CHAMPION")));
// A policy that runs all programs of the champion has one program more for each of its teams, and two parts more.
type Room =
    State<16384, { NEED.programs + NEED.teams + 2 }, { NEED.teams + 2 }, { NEED.streams + 8 }>;

#[entry]
fn main() -> ! {
    static mut ROOM: Room = Room::new();
    static mut OBSERVATION: [f32; measure::MAX_EXTREMES] = [0.0; measure::MAX_EXTREMES];

    // SAFETY: The board has this memory. The program does not use it otherwise, and nothing writes to it.
    let memory = unsafe { core::slice::from_raw_parts(mps2::SPARE, mps2::SPARE_BYTES) };
    let counter = mps2::InstructionCounter::start();
    let Ok(policies) = pack::policies(memory) else {
        println!("error: {}", pack::PackError::NoPack);
        exit(1)
    };
    for policy in policies {
        let made = policy.ok().and_then(|(_, policy)| {
            let agent: Option<Agent<'_, Fixed<{ NEED.width }>, _>> =
                Agent::new_in(policy, &mut *ROOM).ok();
            agent
        });
        let Some(mut agent) = made else {
            println!("error: a policy of another width, or one too large");
            exit(1)
        };
        let seen = measure::run(&mut agent, || counter.now());
        let worst = measure::extremes(&mut agent, OBSERVATION, || counter.now());
        let most = seen.machine_worst.max(worst);
        println!("{} {} {most}", seen.instructions_sum, seen.machine_sum);
    }
    exit(0)
}
