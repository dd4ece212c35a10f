//! A policy as a task of embassy: a timer's interrupt wakes it, it reads, decides and acts, and sleeps.
//!
//! In place of sensors it reads recorded observations; in place of actuators it prints the bits of its actions.
#![no_std]
#![no_main]

use cortex_m::peripheral::{SYST, syst::SystClkSource};
use cortex_m_rt::{entry, exception};
use embassy_executor::{Executor, Spawner};
use embassy_sync::{blocking_mutex::raw::CriticalSectionRawMutex, signal::Signal};
use semihosting::{print, println, process::exit};
use static_cell::{ConstStaticCell, StaticCell};
use tpg_board::cycles::observation_of;
use tpg_runtime::{Action, Reset, policy};

policy!(mod champion = include_bytes!(env!("TPG_CHAMPION")));
static OBSERVATIONS: &str = include_str!(env!("TPG_OBSERVATIONS"));

static EXECUTOR: StaticCell<Executor> = StaticCell::new();
/// The agent's state. It is zero at the start, so it takes no flash and never lies on the stack.
static STATE: ConstStaticCell<champion::State> = ConstStaticCell::new(champion::State::new());
/// Given once in each control period.
static PERIOD: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// The board's clock, in megahertz.
const MHZ: u32 = 25;
// The timer has 24 bits: a longer period needs another timer, or `embassy-time` with a driver of your chip's HAL.
const _: () = assert!(champion::PERIOD_US > 0 && champion::PERIOD_US * MHZ < 1 << 24);

#[entry]
fn main() -> ! {
    let Some(core) = cortex_m::Peripherals::take() else {
        exit(1) // Not reached: this is the first call after reset.
    };
    start(core.SYST);
    EXECUTOR.init(Executor::new()).run(|spawner: Spawner| {
        if let Ok(task) = control() {
            spawner.spawn(task);
        }
    })
}

/// Lets the timer interrupt once in each control period.
fn start(mut timer: SYST) {
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(champion::PERIOD_US * MHZ - 1);
    timer.clear_current();
    timer.enable_counter();
    timer.enable_interrupt();
}

#[exception]
fn SysTick() {
    PERIOD.signal(());
}

#[embassy_executor::task]
async fn control() {
    let Some(Ok(mut agent)) = STATE.try_take().map(champion::load) else {
        exit(1) // The policy is damaged. On a robot, take the safe action here.
    };
    agent.reset(Reset::Agent, 1);
    for line in OBSERVATIONS.lines() {
        PERIOD.wait().await;
        let mut observation = [0.0; champion::INPUTS];
        // edit 2: read your sensors.
        if observation_of(line, &mut observation).is_none() {
            exit(1)
        }
        // edit 3: drive your actuators.
        act(agent.decide(&observation).action);
    }
    exit(0)
}

fn act(action: Action<'_>) {
    match action {
        Action::Discrete(action) => print!("{action}"),
        Action::Continuous(values) => {
            for value in values {
                print!("{:08x} ", value.to_bits());
            }
        }
    }
    println!();
}
