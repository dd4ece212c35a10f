//! Machine instructions of decisions, counted by Valgrind's Callgrind: the same in every run, so a regression shows on
//! any machine.
//!
//! Prints a line for each case: name, count, and what the case promised by its own account. Or it is the process that Callgrind watches, if it is given a case's name.
//! `scripts/instruction-counts` runs this and compares with the committed counts.

use std::env;
use std::hint::black_box;
use std::ops::RangeInclusive;
use std::process::{Command, ExitCode};

use tpg_runtime::isa::Op;
use tpg_runtime::{Agent, HostAgent, Policy};
use tpg_test_policies::draft::Draft;
use tpg_test_policies::hostile::{self, readers, reads};
use tpg_test_policies::shapes::{
    ARITHMETIC, LONG, SHORT, TRANSCENDENTAL, VECTORS, drifting_observations, straight,
    typical_graph,
};

const MATRICES: &[Op] = &[Op::MAdd, Op::MMul, Op::MatVec, Op::Outer, Op::Transpose];
const SHARED: &[Op] = &[Op::ReloadS, Op::ReloadV, Op::ReloadM];

/// An agent and the observations that it is to decide on, ready to run.
struct Ready {
    agent: Box<HostAgent<'static>>,
    observations: Vec<Vec<f32>>,
    /// A file to load besides, or nothing.
    loaded: &'static [u8],
}

fn ready(bytes: Vec<u8>, observations: Vec<Vec<f32>>) -> Ready {
    let policy = Policy::load(bytes.leak()).expect("a well-formed policy");
    let agent = Box::new(Agent::new(policy).expect("room"));
    Ready {
        agent,
        observations,
        loaded: &[],
    }
}

fn line(mix: &[Op]) -> Ready {
    ready(straight(mix, 11, 200).encode(), vec![vec![0.5; 11]; 10])
}

fn graph(mix: &[Op], lengths: &RangeInclusive<u64>, stateful: bool) -> Ready {
    let observations = drifting_observations();
    let (bytes, _) = typical_graph(mix, 9, lengths, stateful, &observations);
    let some = observations.iter().step_by(100).map(|x| x.to_vec());
    ready(bytes, some.collect())
}

/// One decision of a hostile policy.
fn hostile(name: &str) -> Ready {
    let drafts = hostile::decisions();
    let draft = drafts.into_iter().find(|(other, _)| *other == name);
    let (_, draft) = draft.expect("a hostile policy of that name");
    let observation = vec![0.5; usize::from(draft.header.observation_len)];
    ready(hostile::encode(&draft), vec![observation])
}

/// A file that is loaded once.
fn load(draft: &Draft) -> Ready {
    let bytes = hostile::encode(draft).leak();
    Ready {
        loaded: bytes,
        ..ready(bytes.to_vec(), Vec::new())
    }
}

/// Makes what is counted.
type Make = fn() -> Ready;

/// The cases, by name.
const CASES: &[(&str, Make)] = &[
    ("scalar", || line(ARITHMETIC)),
    ("vector", || line(VECTORS)),
    ("matrix", || line(MATRICES)),
    ("product", || line(&[Op::MatMul])),
    ("reload", || line(SHARED)),
    ("graph_stateless", || graph(ARITHMETIC, &LONG, false)),
    ("graph_stateful", || graph(ARITHMETIC, &LONG, true)),
    ("graph_transcendental", || {
        graph(TRANSCENDENTAL, &LONG, false)
    }),
    ("graph_small_stateless", || graph(ARITHMETIC, &SHORT, false)),
    ("graph_small_stateful", || graph(ARITHMETIC, &SHORT, true)),
    ("hostile_members", || hostile("hostile_members")),
    ("hostile_each", || hostile("hostile_each")),
    ("hostile_registers", || hostile("hostile_registers")),
    ("hostile_window", || hostile("hostile_window")),
    ("hostile_marks", || hostile("hostile_marks")),
    ("hostile_writes", || hostile("hostile_writes")),
    ("load_half", || load(&reads(32_768, 32_768))),
    ("load_whole", || load(&reads(65_535, 65_535))),
    ("load_readers", || load(&readers(2_000, 65_535))),
];

/// What a case may take by its own account: weighted operations promised for its decisions, and bytes that it loads.
fn promised(ready: &Ready) -> u64 {
    let decision = ready.agent.policy().bounds().weighted_operations;
    decision * ready.observations.len() as u64 + ready.loaded.len() as u64
}

/// Callgrind counts while this function runs; it finds it by its name.
#[inline(never)]
fn decide(ready: &mut Ready) {
    for observation in &ready.observations {
        black_box(ready.agent.decide(black_box(observation)).is_ok());
    }
    if !ready.loaded.is_empty() {
        black_box(Policy::load(black_box(ready.loaded)).is_ok());
    }
}

/// Runs this program again under Callgrind for one case.
fn count(case: &str) -> Result<u64, String> {
    let program = env::current_exe().map_err(|e| format!("the program's own path: {e}"))?;
    let mut valgrind = Command::new("valgrind");
    valgrind
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .args([
            "--collect-atstart=no",
            "--toggle-collect=instructions::decide",
        ])
        .arg(program)
        .arg(case);
    let output = valgrind
        .output()
        .map_err(|e| format!("valgrind does not start: {e} (apt-get install valgrind)"))?;
    let text = String::from_utf8_lossy(&output.stderr);
    let found = text
        .lines()
        .find_map(|line| line.split_once("Collected : "));
    match found.and_then(|(_, count)| count.trim().parse().ok()) {
        Some(count) if count > 0 && output.status.success() => Ok(count),
        _ => Err(format!("Callgrind counted nothing for {case}:\n{text}")),
    }
}

fn main() -> ExitCode {
    let named = env::args().nth(1);
    if let Some((_, ready)) = CASES.iter().find(|case| Some(case.0) == named.as_deref()) {
        decide(&mut ready());
        return ExitCode::SUCCESS;
    }
    for (case, make) in CASES {
        match count(case) {
            Ok(count) => println!("{case} {count} {}", promised(&make())),
            Err(message) => {
                eprintln!("instructions: {message}");
                return ExitCode::FAILURE;
            }
        }
    }
    ExitCode::SUCCESS
}
