//! Counts policy instructions and processor instructions for a pack of policies in spare memory. Their width is that of
//! the champion. Each line has the sums of drawn decisions, and the most processor instructions of a decision.
#![no_std]
#![no_main]

use riscv_rt::entry;
use semihosting::{println, process::exit};
use static_cell::ConstStaticCell;
use tpg_board::{measure, pack, virt};
use tpg_runtime::{Agent, Capacities, Fixed, State};

const NEED: Capacities = Capacities::of(include_bytes!(env!("TPG_CHAMPION")));
// A policy that runs all programs of the champion has one program more for each of its teams, and two parts more.
type Room =
    State<16384, { NEED.programs + NEED.teams + 2 }, { NEED.teams + 2 }, { NEED.streams + 8 }>;

static ROOM: ConstStaticCell<Room> = ConstStaticCell::new(Room::new());
static OBSERVATION: ConstStaticCell<[f32; measure::MAX_EXTREMES]> =
    ConstStaticCell::new([0.0; measure::MAX_EXTREMES]);

#[entry]
fn main() -> ! {
    let (Some(room), Some(observation)) = (ROOM.try_take(), OBSERVATION.try_take()) else {
        exit(1)
    };
    // SAFETY: The board has this memory. The program does not use it otherwise, and nothing writes to it.
    let memory = unsafe { core::slice::from_raw_parts(virt::SPARE, virt::SPARE_BYTES) };
    let counter = virt::InstructionCounter::start();
    let Ok(policies) = pack::policies(memory) else {
        println!("error: {}", pack::PackError::NoPack);
        exit(1)
    };
    for policy in policies {
        let made = policy.ok().and_then(|(_, policy)| {
            let agent: Option<Agent<'_, Fixed<{ NEED.width }>, _>> =
                Agent::new_in(policy, &mut *room).ok();
            agent
        });
        let Some(mut agent) = made else {
            println!("error: a policy of another width, or one too large");
            exit(1)
        };
        let seen = measure::run(&mut agent, || counter.now());
        let worst = measure::extremes(&mut agent, observation, || counter.now());
        let most = seen.machine_worst.max(worst);
        println!("{} {} {most}", seen.instructions_sum, seen.machine_sum);
    }
    exit(0)
}
