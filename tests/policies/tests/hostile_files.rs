//! Valid files that are made to take much work: the promised bound covers it, and loading stays linear.

use std::time::Duration;

use cpu_time::ThreadTime;
use tpg_runtime::blob::RegisterMode;
use tpg_runtime::tables::{Instruction, ProgramId, Target};
use tpg_runtime::trace::Observer;
use tpg_runtime::{HostAgent, Policy};
use tpg_test_policies::hostile::{decisions, members, readers, reads};

/// Counts what a decision does for each of its events.
struct Work<'p> {
    policy: Policy<'p>,
    /// Members looked at, once in each pass.
    members: u64,
    /// Operations of the programs that ran, by the costs of their instructions.
    operations: u64,
    /// Register words that were reset.
    words: u64,
}

impl Observer for Work<'_> {
    fn skip(&mut self, _: ProgramId) {
        self.members += 1;
    }

    fn run(&mut self, program_id: ProgramId, _: u16) {
        let (header, tables) = (self.policy.header(), self.policy.tables());
        let program = tables.program(program_id).expect("it runs");
        let cells = u16::try_from(tables.cells.len()).expect("at most 800");
        let cost = |bytes: &[u8; Instruction::BYTES]| {
            let op = Instruction::from_bytes(bytes).expect("it was verified").op;
            // A write without kept cells has no cost in the table, but takes work.
            op.cost().weight(header.width, cells).max(1)
        };
        self.operations += tables.code(&program).iter().map(cost).sum::<u64>();
        if header.register_mode == RegisterMode::Stateless {
            self.words += program.register_words(usize::from(header.width)) as u64;
        }
    }

    fn bid(&mut self, _: ProgramId, _: f32) {
        self.members += 1;
    }

    fn choose(&mut self, _: ProgramId, _: Target) {}
}

#[test]
fn the_bound_covers_the_work_of_hostile_decisions() {
    for (name, draft) in decisions() {
        let bytes = draft.encode();
        let policy = Policy::load(&bytes).expect("a valid file");
        let (header, bounds) = (*policy.header(), *policy.bounds());
        let mut agent = Box::new(HostAgent::new(policy).expect("it fits a host"));
        let mut work = Work {
            policy,
            members: 0,
            operations: 0,
            words: 0,
        };
        let observation = vec![0.5; usize::from(header.observation_len)];
        let decision = agent.decide_traced(&observation, &mut work);
        let instructions = decision.expect("the right length").instructions;
        let marks = u64::from(header.programs) + u64::from(header.teams);
        let done = work.members + work.operations + work.words + marks + u64::from(header.window);
        println!(
            "{name}: {done} done, {} promised, {} bytes",
            bounds.weighted_operations,
            bytes.len()
        );
        assert!(instructions <= bounds.instructions, "{name}");
        assert!(work.members <= u64::from(bounds.members), "{name}");
        assert!(done <= bounds.weighted_operations, "{name}");
        // A bound that promises far more than is done would be of no use.
        assert!(bounds.weighted_operations <= 9 * done, "{name}");
    }
}

#[test]
fn a_program_listed_often_is_promised_often() {
    let bound = |times: usize| {
        let bytes = members(times).encode();
        *Policy::load(&bytes).expect("a valid file").bounds()
    };
    let (few, many) = (bound(1), bound(65_535));
    assert_eq!((few.members, many.members), (1, 65_535));
    assert_eq!(few.instructions, many.instructions);
    let walk = many.weighted_operations - few.weighted_operations;
    assert_eq!(walk, 4 * 65_534);
}

/// The least processor time of five loads.
fn load_time(bytes: &[u8]) -> Duration {
    let time = |_| {
        let start = ThreadTime::now();
        Policy::load(bytes).expect("a valid file");
        start.elapsed()
    };
    (0..5).map(time).min().unwrap_or_default()
}

/// A file that lists a long program often is loaded about as fast as one of its size that lists it once.
///
/// Reading the code for each member would take some thousand times as long, so a factor of ten disturbs no machine.
#[test]
fn loading_takes_time_by_the_size_of_a_file() {
    let plain = reads(65_535, 1).encode();
    for hostile in [reads(49_151, 65_535), readers(2_000, 65_535)] {
        let hostile = hostile.encode();
        let (a_byte, expected) = (load_time(&hostile), load_time(&plain));
        let longer = a_byte.as_secs_f64() / hostile.len() as f64;
        let usual = expected.as_secs_f64() / plain.len() as f64;
        println!(
            "{} bytes: {:.0} ns a byte, usual {:.0} ns",
            hostile.len(),
            longer * 1e9,
            usual * 1e9
        );
        assert!(longer < 10.0 * usual, "{longer} s and {usual} s a byte");
    }
}
