//! Controls a plant over the board's USB cable. Accepts new policies over it and stores them in the board's flash.
//!
//! The ST-Link connects USART2 to the host at 115 200 baud. Under Linux it is `/dev/ttyACM0`.
#![no_std]
#![no_main]

#[path = "../slot_flash.rs"]
mod slot_flash;

use cortex_m_rt::entry;
use stm32f4xx_hal::{nb, pac, prelude::*, rcc, serial};
use tpg_board::serial::{Rules, Session};
use tpg_runtime::{Agent, Capacities, Fixed, Policy, State};

use slot_flash::SlotFlash;

static CHAMPION: &[u8] = include_bytes!(env!("TPG_CHAMPION"));
// edit 2: room for later policies: words, programs, teams, streams.
type Room = State<4096, 64, 16, 48>;
type Roomy = Agent<'static, Fixed<{ Capacities::of(CHAMPION).width }>, &'static mut Room>;
const RULES: Rules = Rules {
    // edit 3: `true` refuses policies of a lower release than the board has.
    releases: false,
    // The feature `signature` refuses policies that the owner of this key did not sign.
    #[cfg(feature = "signature")]
    key: Some(tpg_board::public_key(include_bytes!(env!(
        "TPG_PUBLIC_KEY"
    )))),
    ..Rules::DEFAULT
};

#[entry]
fn main() -> ! {
    static mut ROOM: Room = Room::new();

    // `take` succeeds because this is its first call after reset.
    let (Some(device), Ok(policy)) = (pac::Peripherals::take(), Policy::load(CHAMPION)) else {
        stop()
    };
    let Ok(mut agent) = Roomy::new_in(policy, ROOM) else {
        stop()
    };
    let flash = SlotFlash::new(device.FLASH);
    let Ok(mut session) = Session::start(CHAMPION, Some(flash), &mut agent, RULES) else {
        stop()
    };
    let mut rcc = device.RCC.freeze(
        rcc::Config::hse(8.MHz())
            .bypass_hse_oscillator()
            .sysclk(168.MHz()),
    );
    let pins = device.GPIOA.split(&mut rcc);
    let rate = serial::Config::default().baudrate(115_200.bps());
    let Ok(mut line) = (device.USART2).serial::<u8>((pins.pa2, pins.pa3), rate, &mut rcc) else {
        stop()
    };
    loop {
        // If a byte is lost or damaged, the checksum rejects the frame and the host sends it again.
        let Ok(byte) = nb::block!(line.read()) else {
            continue;
        };
        for answer in session.take(&mut agent, byte) {
            let _ = nb::block!(line.write(*answer));
        }
    }
}

/// Stops answering. The host notices the missing answers and makes its plant safe.
fn stop() -> ! {
    loop {
        cortex_m::asm::wfi();
    }
}
