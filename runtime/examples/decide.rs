//! Loads a policy, feeds it a slow wave as observations, and prints its decisions.
//!
//! `cargo run -p tpg-runtime --example decide -- FILE.tpg [STEPS]`

use std::error::Error;
use std::{env, fs};

use tpg_runtime::{Action, HostAgent, Policy, Reset};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = env::args().skip(1);
    let path = arguments.next().ok_or("usage: decide FILE.tpg [STEPS]")?;
    let steps: u16 = arguments.next().map_or(Ok(10), |steps| steps.parse())?;

    let bytes = fs::read(&path).map_err(|error| format!("{path}: {error}"))?;
    let policy = Policy::load(&bytes).map_err(|error| format!("{path}: {error}"))?;
    println!("{path}: at most {:?} in a decision", policy.bounds());
    for (name, unit) in policy.inputs() {
        println!("input {name} [{unit}]");
    }

    // The agent of a host has room for every policy, so it is large: it belongs on the heap.
    let mut agent: Box<HostAgent<'_>> = Box::new(HostAgent::new(policy)?);
    agent.reset(Reset::Agent, 42);
    let mut observation = vec![0.0; usize::from(policy.header().observation_len)];
    for step in 0..steps {
        for (x, channel) in observation.iter_mut().zip(0u16..) {
            *x = 0.1 * (0.3 * f32::from(step) + f32::from(channel)).sin();
        }
        let decision = agent.decide(&observation)?;
        let instructions = decision.instructions;
        match decision.action {
            Action::Discrete(index) => {
                println!("step {step}: action {index} after {instructions} instructions");
            }
            Action::Continuous(values) => {
                println!("step {step}: outputs {values:?} after {instructions} instructions");
            }
        }
    }
    Ok(())
}
