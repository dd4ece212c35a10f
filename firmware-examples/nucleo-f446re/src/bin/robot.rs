//! Drives the plant once per control period, and takes new policies over the board's USB cable between decisions.
//!
//! While a policy is being stored, the plant is in its safe state. A new policy is confirmed after it has decided in time
//! for [`GOOD_PERIODS`]. If it hangs or crashes before that, the watchdog restarts the board, which reverts it.
#![no_std]
#![no_main]

#[path = "../plant.rs"]
mod plant;
#[path = "../slot_flash.rs"]
mod slot_flash;

use cortex_m_rt::entry;
use stm32f4xx_hal::{
    pac, prelude::*, rcc, serial, timer::CounterUs, watchdog::IndependentWatchdog,
};
use tpg_board::serial::{Rules, Session};
use tpg_board::trial::MAX_OBSERVATION;
use tpg_runtime::{Agent, Capacities, Fixed, Header, Policy, Reset, State};

use slot_flash::SlotFlash;

static CHAMPION: &[u8] = include_bytes!(env!("TPG_CHAMPION"));
// edit 2: room for later policies: words, programs, teams, streams.
type Room = State<4096, 64, 16, 48>;
type Roomy = Agent<'static, Fixed<{ Capacities::of(CHAMPION).width }>, &'static mut Room>;
const RULES: Rules = Rules {
    drives: true,
    // edit 3: `true` refuses policies of a lower release than the board has.
    releases: false,
    // The feature `signature` refuses policies that the owner of this key did not sign.
    #[cfg(feature = "signature")]
    key: Some(tpg_board::public_key(include_bytes!(env!(
        "TPG_PUBLIC_KEY"
    )))),
    ..Rules::DEFAULT
};
const PERIOD_US: u32 = match Header::peek(CHAMPION) {
    Some(header) => header.control_period_us,
    None => 0,
};
// The watchdog counts milliseconds, at most 32 s.
const _: () = assert!(PERIOD_US > 0 && PERIOD_US <= 10_000_000);
const WATCHDOG_MS: u32 = 3 * PERIOD_US.div_ceil(1000);
/// The longest time in which a sector is erased, with a reserve. The processor waits meanwhile.
const ERASE_MS: u32 = 6_000;

#[entry]
fn main() -> ! {
    static mut ROOM: Room = Room::new();

    plant::make_safe();
    // `take` succeeds because this is its first call after reset.
    let (Some(device), Ok(policy)) = (pac::Peripherals::take(), Policy::load(CHAMPION)) else {
        stay_safe()
    };
    let Ok(mut agent) = Roomy::new_in(policy, ROOM) else {
        stay_safe()
    };
    let mut rcc = device.RCC.freeze(
        rcc::Config::hse(8.MHz())
            .bypass_hse_oscillator()
            .sysclk(168.MHz()),
    );
    // Signatures are verified here, so the clock is fast already.
    let flash = SlotFlash::new(device.FLASH);
    let Ok(mut session) = Session::start(CHAMPION, Some(flash), &mut agent, RULES) else {
        stay_safe()
    };
    let pins = device.GPIOA.split(&mut rcc);
    let rate = serial::Config::default().baudrate(115_200.bps());
    let Ok(mut line) = (device.USART2).serial::<u8>((pins.pa2, pins.pa3), rate, &mut rcc) else {
        stay_safe()
    };
    let mut timer: CounterUs<pac::TIM5> = device.TIM5.counter_us(&mut rcc);
    if timer.start(PERIOD_US.micros()).is_err() {
        stay_safe()
    }
    let mut watchdog = IndependentWatchdog::new(device.IWDG);
    watchdog.start(WATCHDOG_MS.millis());
    agent.reset(Reset::Agent, 1);
    let mut patient = false;
    let mut in_use = agent.policy().header().provenance;
    loop {
        let fit = suits(agent.policy()) && !session.is_updating();
        let decided = fit && step(&mut agent);
        if !decided {
            plant::make_safe();
        }
        // A decision that came too late skips a period, in which the line is still served.
        session.period(decided && timer.wait().is_err());
        while timer.wait().is_err() {
            let Ok(byte) = line.read() else {
                continue;
            };
            let answer = session.take_safely(&mut agent, byte, || {
                plant::make_safe();
                watchdog.start(ERASE_MS.millis());
                patient = true;
            });
            for byte in answer {
                let _ = stm32f4xx_hal::nb::block!(line.write(*byte));
            }
        }
        if in_use != agent.policy().header().provenance {
            in_use = agent.policy().header().provenance;
            agent.reset(Reset::Agent, 1);
        }
        if patient && !session.is_updating() {
            watchdog.start(WATCHDOG_MS.millis());
            patient = false;
        }
        watchdog.feed();
    }
}

/// Whether the plant can be driven by a policy. One that was sent by force may be for another plant.
fn suits(policy: &Policy<'_>) -> bool {
    plant::fits(policy) && policy.header().control_period_us == PERIOD_US
}

/// Decides and acts. Returns whether the policy decided.
#[inline(never)]
fn step(agent: &mut Roomy) -> bool {
    let mut observation = [0.0; MAX_OBSERVATION];
    let inputs = usize::from(agent.policy().header().observation_len);
    let Some(observation) = observation.get_mut(..inputs) else {
        return false;
    };
    plant::sense(observation);
    let decision = agent.decide(observation);
    if let Ok(decision) = decision {
        plant::act(decision.action);
    }
    decision.is_ok()
}

fn stay_safe() -> ! {
    loop {
        plant::make_safe();
    }
}
