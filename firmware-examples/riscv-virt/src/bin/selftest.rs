//! Replays the champion's golden run. The exit status is 0 if every bit is the same as on the host.
#![no_std]
#![no_main]

use riscv_rt::entry;
use semihosting::{println, process::exit};
use tpg_board::selftest;
use tpg_runtime::{Policy, agent_type};

static CHAMPION: &[u8] = include_bytes!(env!("TPG_CHAMPION"));
static GOLDEN: &str = include_str!(env!("TPG_GOLDEN"));
type Champion = agent_type!(CHAMPION);

#[entry]
fn main() -> ! {
    let policy = Policy::load(CHAMPION).ok();
    let Some(mut agent) = policy.and_then(|policy| Champion::new(policy).ok()) else {
        println!("selftest: the policy is damaged");
        exit(1)
    };
    match selftest::check(&mut agent, GOLDEN) {
        Ok(decisions) => {
            println!("selftest: {decisions} decisions as on the host");
            exit(0)
        }
        Err(fault) => {
            println!("selftest: {fault}");
            exit(1)
        }
    }
}
