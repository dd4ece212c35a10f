//! Machine instructions of decisions, counted by Callgrind: the same in every run, so a regression shows on any machine.
//!
//! `scripts/instruction-counts` runs this and compares with the committed counts.

#![expect(
    missing_docs,
    unused_qualifications,
    reason = "of items that macros make"
)]

use std::hint::black_box;

use gungraun::{library_benchmark, library_benchmark_group, main};
use tpg_runtime::isa::Op;
use tpg_runtime::{Agent, HostAgent, Policy};
use tpg_tests::shapes::{
    ARITHMETIC, TRANSCENDENTAL, VECTORS, drifting_observations, straight, typical_graph,
};

const MATRICES: &[Op] = &[Op::MAdd, Op::MMul, Op::MatVec, Op::Outer, Op::Transpose];
const SHARED: &[Op] = &[Op::ReloadS, Op::ReloadV, Op::ReloadM];

/// An agent and the observations that it is to decide on, ready to run.
struct Ready {
    agent: Box<HostAgent<'static>>,
    observations: Vec<Vec<f32>>,
}

fn ready(bytes: Vec<u8>, observations: Vec<Vec<f32>>) -> Ready {
    let policy = Policy::load(bytes.leak()).expect("a well-formed policy");
    let agent = Box::new(Agent::new(policy).expect("room"));
    Ready {
        agent,
        observations,
    }
}

fn line(mix: &[Op]) -> Ready {
    ready(straight(mix, 11, 200).encode(), vec![vec![0.5; 11]; 10])
}

fn graph(mix: &[Op], stateful: bool) -> Ready {
    let observations = drifting_observations();
    let (bytes, _) = typical_graph(mix, 9, stateful, &observations);
    let some = observations.iter().step_by(100).map(|x| x.to_vec());
    ready(bytes, some.collect())
}

#[library_benchmark]
#[bench::scalar(line(ARITHMETIC))]
#[bench::vector(line(VECTORS))]
#[bench::matrix(line(MATRICES))]
#[bench::product(line(&[Op::MatMul]))]
#[bench::reload(line(SHARED))]
#[bench::graph_stateless(graph(ARITHMETIC, false))]
#[bench::graph_stateful(graph(ARITHMETIC, true))]
#[bench::graph_transcendental(graph(TRANSCENDENTAL, false))]
fn decide(mut ready: Ready) -> Ready {
    for observation in &ready.observations {
        black_box(ready.agent.decide(black_box(observation)).is_ok());
    }
    ready
}

library_benchmark_group!(name = decisions; benchmarks = decide);
main!(library_benchmark_groups = decisions);
