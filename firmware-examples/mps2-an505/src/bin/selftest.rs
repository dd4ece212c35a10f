//! Replays the champion's golden run. The exit status is 0 if every bit is the same as on the host.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use semihosting::{println, process::exit};
use tpg_board::selftest;
use tpg_runtime::{Agent, Policy, policy};

policy!(mod champion = include_bytes!(env!("TPG_CHAMPION")));
static GOLDEN: &str = include_str!(env!("TPG_GOLDEN"));
type Champion = Agent<'static, champion::Width, &'static mut champion::State>;

#[entry]
fn main() -> ! {
    static mut STATE: champion::State = champion::State::new();

    let policy = Policy::load(champion::BYTES).ok();
    let made = policy.and_then(|policy| Champion::new_in(policy, STATE).ok());
    let Some(mut agent) = made else {
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
