//! A policy that C decides on an emulated board does what it does here, bit for bit.
//!
//! Where QEMU or a compiler is missing, this is skipped with the reason; `.ci/run` installs them and does not let it skip.

use std::fmt::Write as _;
use std::fs;

use tpg_board::trial::Generator;
use tpg_runtime::{Action, HostAgent, Policy, Reset};
use tpg_tests::firmware::{M4F, build_c, c_is_available};
use tpg_tests::golden;

/// What `decide.c` does with a policy, done here.
fn expected(bytes: &[u8]) -> String {
    let policy = Policy::load(bytes).expect("valid");
    let mut agent = Box::new(HostAgent::new(policy).expect("fits"));
    agent.reset(Reset::Agent, 1);
    let mut generator = Generator::new(1);
    let mut observation = vec![0.0; usize::from(policy.header().observation_len)];
    let mut text = String::new();
    for number in 1..=600 {
        generator.observe(&mut observation);
        let decision = agent.decide(&observation).expect("the right length");
        let words = match decision.action {
            Action::Discrete(index) => vec![u32::from(index)],
            Action::Continuous(values) => values.iter().map(|x| x.to_bits()).collect(),
        };
        for word in words {
            write!(text, " {word:08x}").expect("a string takes any text");
        }
        text.push('\n');
        if number % 250 == 0 {
            agent.reset(Reset::Episode, generator.bits());
        }
    }
    text
}

/// Discrete with indexed memory, continuous, and with team memory, each of another width; and one that fills in what is
/// missing by its model.
const POLICIES: [&str; 4] = [
    "v1/classic",
    "v1/reactive",
    "v1/team-memory",
    "v3/believed-cubic",
];

#[test]
fn c_on_a_board_decides_as_the_host() {
    if !c_is_available() {
        return;
    }
    for name in POLICIES {
        let file = golden::path(&format!("{name}.tpg"));
        let bytes = fs::read(&file).expect("a policy");
        let (status, printed) = M4F.run(&build_c(&file), &[]);
        let expected = expected(&bytes);
        let both = printed.lines().zip(expected.lines());
        let first = both.enumerate().find(|(_, (board, host))| board != host);
        assert_eq!(first, None, "{name}: line, board, host");
        assert_eq!(printed.lines().count(), 600, "{name}: {printed}");
        assert_eq!(status, Some(0), "{name}");
    }
}

#[test]
fn a_policy_that_the_library_refuses_ends_with_its_reason() {
    if !c_is_available() {
        return;
    }
    let mut bytes = fs::read(golden::path("v1/reactive.tpg")).expect("a policy");
    bytes[100] ^= 1;
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("damaged.tpg");
    fs::write(&file, bytes).expect("written");
    let (status, printed) = M4F.run(&build_c(&file), &[]);
    assert_eq!(status, Some(1), "{printed}");
    assert!(printed.contains("damaged"), "{printed}");
}
