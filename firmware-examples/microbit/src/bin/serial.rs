//! Controls a plant over the serial line and accepts new policies over it.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use semihosting::process::exit;
use tpg_board::{
    microbit,
    ram::RamFlash,
    serial::{Rules, Session},
};
use tpg_runtime::{Agent, Capacities, Fixed, Policy, State};

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

    let policy = Policy::load(CHAMPION).ok();
    let Some(mut agent) = policy.and_then(|policy| Roomy::new_in(policy, ROOM).ok()) else {
        exit(1)
    };
    // SAFETY: The board has this memory, and the program does not use it otherwise. It keeps its contents over a reset.
    let flash = unsafe { RamFlash::new(microbit::SPARE, 64 * 1024) };
    let Ok(mut session) = Session::start(CHAMPION, Some(flash), &mut agent, RULES) else {
        exit(1)
    };
    let mut uart = microbit::Uart::start();
    loop {
        let byte = uart.wait();
        for answer in session.take(&mut agent, byte) {
            uart.write(*answer);
        }
    }
}
