//! A policy as a task of RTIC: it reads, decides and acts once in each control period, and other tasks may interrupt it.
//!
//! In place of sensors it reads recorded observations; in place of actuators it prints the bits of its actions.
#![no_std]
#![no_main]

use tpg_runtime::policy;

policy!(mod champion = include_bytes!(env!("TPG_CHAMPION")));
static OBSERVATIONS: &str = include_str!(env!("TPG_OBSERVATIONS"));

#[rtic::app(device = lm3s6965, dispatchers = [UART0])]
mod app {
    use rtic_monotonics::systick::prelude::*;
    use semihosting::{print, println, process::exit};
    use tpg_board::cycles::observation_of;
    use tpg_runtime::{Action, Reset};

    use super::{OBSERVATIONS, champion};

    // A tick is a millisecond.
    systick_monotonic!(Mono, 1000);
    /// The board's clock at reset, in hertz.
    const CLOCK_HZ: u32 = 12_000_000;
    // For periods that are no whole milliseconds, take a faster tick.
    const _: () = assert!(champion::PERIOD_US > 0 && champion::PERIOD_US.is_multiple_of(1000));

    #[shared]
    struct Shared {}

    #[local]
    struct Local {
        agent: champion::Agent<'static>,
    }

    // The agent's state is zero at the start, so it takes no flash and never lies on the stack.
    #[init(local = [state: champion::State = champion::State::new()])]
    fn init(context: init::Context) -> (Shared, Local) {
        Mono::start(context.core.SYST, CLOCK_HZ);
        let Ok(mut agent) = champion::load(context.local.state) else {
            exit(1) // The policy is damaged. On a robot, take the safe action here.
        };
        agent.reset(Reset::Agent, 1);
        // Spawned once, so there is room.
        let _ = control::spawn();
        (Shared {}, Local { agent })
    }

    #[task(local = [agent], priority = 1)]
    async fn control(context: control::Context) {
        let period = (champion::PERIOD_US / 1000).millis();
        let mut next = Mono::now();
        for line in OBSERVATIONS.lines() {
            let mut observation = [0.0; champion::INPUTS];
            // edit 2: read your sensors.
            if observation_of(line, &mut observation).is_none() {
                exit(1)
            }
            // edit 3: drive your actuators.
            act(context.local.agent.decide(&observation).action);
            // From instant to instant, so the period does not drift.
            next += period;
            Mono::delay_until(next).await;
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
}
