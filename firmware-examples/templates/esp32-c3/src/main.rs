//! Decides once per control period on an ESP32-C3. If the program stops doing so, the watchdog restarts the chip.
//!
//! Nobody here has run it on hardware. What happens in a period is in `tpg_board::control`, which is tested on a host.
#![no_std]
#![no_main]

mod plant;

use static_cell::ConstStaticCell;
use tpg_board::control::{Control, Outcome, fits};
use tpg_runtime::{Agent, Policy, Reset, policy};

use plant::{ACTUATORS, Board, SENSORS};

policy!(mod champion = include_bytes!(env!("TPG_CHAMPION")));
type Champion = Agent<'static, champion::Width, &'static mut champion::State>;
// If the policy needs more RAM than you allow here, the build fails. Otherwise the robot would fail.
const _: () = assert!(champion::CAPACITIES.state_bytes() <= 64 * 1024);
const _: () = assert!(champion::PERIOD_US > 0 && champion::PERIOD_US <= 10_000_000);
/// edit 2: how long after the beginning of its period an action may still be used, in microseconds.
const DEADLINE_US: u32 = champion::PERIOD_US;
/// edit 3: so many decisions in a row must be in time before the plant is driven.
const RECOVERY: u32 = 10;

// What ESP-IDF's boot loader wants to know of a program.
esp_bootloader_esp_idf::esp_app_desc!();
/// The agent's state. It is zero at the start, so it takes no flash and never lies on the stack.
static STATE: ConstStaticCell<champion::State> = ConstStaticCell::new(champion::State::new());

#[esp_hal::main]
fn main() -> ! {
    let policy = Policy::load(champion::BYTES).ok().zip(STATE.try_take());
    let made = policy.and_then(|(policy, state)| Champion::new_in(policy, state).ok());
    // Until the first driven period the enable pin is an input or low, so the driver is off.
    let (Some(mut agent), Some(mut board)) = (made, Board::start()) else {
        stop()
    };
    if !fits(agent.policy(), &SENSORS, &ACTUATORS) {
        stop()
    }
    board.start_watchdog(3 * champion::PERIOD_US);
    agent.reset(Reset::Agent, 1);
    let mut control = Control::new(champion::PERIOD_US, DEADLINE_US, RECOVERY);
    loop {
        // edit 4: count or report what is not `Outcome::Driven`.
        let _ = step(&mut control, &mut agent, &mut board);
    }
}

/// A separate function, so that a disassembler shows what a period can call.
#[inline(never)]
fn step(control: &mut Control, agent: &mut Champion, board: &mut Board) -> Outcome {
    control.period::<{ champion::INPUTS }, _, _>(agent, board)
}

fn stop() -> ! {
    loop {
        core::hint::spin_loop();
    }
}
