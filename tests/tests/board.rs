//! Boards compute what the host computes, in every bit. QEMU stands in for the boards.
//!
//! Where QEMU or a compiler for the board is missing, these tests are skipped with the reason; `.ci/run` installs both
//! and does not let them skip.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;

use tpg_board::{pack, selftest, trial};
use tpg_runtime::blob::{ActionKind, MemoryModel, RegisterMode};
use tpg_runtime::front_end::Fallback;
use tpg_runtime::isa::Op;
use tpg_runtime::tables::Instruction;
use tpg_runtime::{HostAgent, Policy};
use tpg_tests::firmware::{self, Board};
use tpg_tests::{golden, graphs, samples};

/// The champions that evolution made; `golden/champions/make` makes them again.
fn champions() -> Vec<Vec<u8>> {
    let entries = fs::read_dir(golden::path("champions")).expect("a folder of champions");
    let mut files: Vec<_> = entries
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "tpg"))
        .collect();
    files.sort();
    assert!(files.len() >= 3, "{files:?}");
    let read = |path| fs::read(path).expect("a champion");
    files.into_iter().map(read).collect()
}

fn policies() -> Vec<Vec<u8>> {
    let mut all = graphs::all();
    all.extend(champions());
    let remembering = samples::remembering().into_iter();
    all.extend(remembering.map(|(_, draft)| draft.encode()));
    all
}

/// What `bits` prints on a board, computed here.
fn host_lines(memory: &[u8]) -> String {
    let mut text = String::new();
    pack::try_all(memory, |number, decisions, hash| {
        let line = match decisions {
            Some(decisions) => writeln!(text, "{number} {decisions} {:016x}", hash.0),
            None => writeln!(text, "{number} end {:016x}", hash.0),
        };
        line.expect("a string takes any text");
    })
    .expect("every policy can be tried");
    text
}

#[test]
fn the_graphs_cover_everything() {
    let mut ops = BTreeSet::new();
    let mut modes = BTreeSet::new();
    let mut beliefs = BTreeSet::new();
    let mut deep = 0;
    for (number, bytes) in graphs::all().iter().enumerate() {
        let policy = Policy::load(bytes).unwrap_or_else(|error| panic!("graph {number}: {error}"));
        let header = policy.header();
        if let Some(front_end) = policy.front_end() {
            beliefs.insert((front_end.fallback as u8, front_end.degree));
        }
        modes.insert((
            header.register_mode as u8,
            header.memory_model as u8,
            header.action_kind as u8,
        ));
        // The root's first three programs run in every decision, and between them have every operation.
        let code = policy.tables().code.iter();
        ops.extend(code.filter_map(|bytes| Instruction::from_bytes(bytes).map(|i| i.op as u8)));
        let outcome = pack::try_one(policy, 300, |_, _| {}).expect("fits");
        deep += usize::from(outcome.deepest >= 3);
    }
    let all: BTreeSet<u8> = Op::ALL.iter().map(|op| *op as u8).collect();
    assert_eq!(ops, all, "an operation is missing");
    let (zero, hold, believe) = (
        Fallback::Zero as u8,
        Fallback::Hold as u8,
        Fallback::Model as u8,
    );
    let all = [
        (zero, 0),
        (hold, 0),
        (believe, 1),
        (believe, 2),
        (believe, 3),
    ];
    assert_eq!(beliefs, BTreeSet::from(all), "a front end is missing");
    for register_mode in RegisterMode::ALL {
        for memory in MemoryModel::ALL {
            for action in ActionKind::ALL {
                let mode = (*register_mode as u8, *memory as u8, *action as u8);
                assert!(
                    modes.contains(&mode),
                    "{register_mode:?} {memory:?} {action:?}"
                );
            }
        }
    }
    assert!(
        deep >= 20,
        "only {deep} graphs were followed three teams deep"
    );
}

#[test]
fn an_agent_of_any_width_computes_the_same() {
    for (number, bytes) in policies().iter().enumerate() {
        let policy = Policy::load(bytes).expect("valid");
        let fixed = pack::try_one(policy, 500, |_, _| {}).expect("fits");
        let mut agent = Box::new(HostAgent::new(policy).expect("fits"));
        let any = trial::run(&mut agent, pack::SEED, 500, |_, _| {});
        assert_eq!(fixed, any, "policy {number}");
    }
}

#[test]
fn boards_agree_with_the_host_in_every_bit() {
    let folder = tempfile::tempdir().expect("a folder");
    Board::on_each_emulated(|board| {
        let decisions = board.emulation().test_decisions;
        let memory = firmware::pack(&policies(), decisions);
        let file = folder.path().join(&board.name);
        fs::write(&file, &memory).expect("written");
        let (status, printed) = board.run(&board.build("bits"), &board.load(&file));
        let expected = host_lines(&memory);
        let first = printed.lines().zip(expected.lines()).find(|(p, e)| p != e);
        assert_eq!(first, None, "{} differs", board.name);
        assert_eq!(
            printed.lines().count(),
            expected.lines().count(),
            "{}: {printed}",
            board.name
        );
        assert_eq!(status, Some(0), "{}", board.name);
    });
}

/// The lines of a golden run, as `selftest` reads them.
fn golden_run(bytes: &[u8], decisions: u32) -> String {
    let policy = Policy::load(bytes).expect("valid");
    let mut text = String::new();
    let mut add = |number: u32, hash: trial::Hash| {
        writeln!(text, "{number} {:016x}", hash.0).expect("a string takes any text");
    };
    let outcome = pack::try_one(policy, decisions, &mut add).expect("fits");
    add(decisions, outcome.hash);
    text
}

#[test]
fn the_examples_selftest_is_golden_and_sees_a_difference() {
    let folder = firmware::repository().join("firmware-examples");
    let champion = fs::read(folder.join("champion.tpg")).expect("a champion");
    let computed = golden_run(&champion, 1000);
    golden::assert_text("../../firmware-examples/champion.golden", &computed);
    let policy = Policy::load(&champion).expect("valid");
    let mut agent = Box::new(HostAgent::new(policy).expect("fits"));
    assert_eq!(selftest::check(&mut agent, &computed), Ok(1000));
    let (last, _) = computed.trim_end().rsplit_once('\n').expect("many lines");
    let wrong = format!("{last}\n1000 0123456789abcdef\n");
    let error = selftest::check(&mut agent, &wrong).expect_err("another hash");
    assert!(error.to_string().contains("0123456789abcdef"), "{error}");
    Board::on_each_emulated(|board| {
        let (status, printed) = board.run(&board.build("selftest"), &[]);
        assert_eq!(status, Some(0), "{}: {printed}", board.name);
        assert!(
            printed.contains("1000 decisions as on the host"),
            "{printed}"
        );
        let damaged = folder_with_golden(&wrong);
        let variables = [("TPG_GOLDEN", damaged.path())];
        let (status, printed) = board.run(&board.build_with("selftest", &variables), &[]);
        assert_eq!(status, Some(1), "{}: {printed}", board.name);
        assert!(printed.contains("0123456789abcdef"), "{printed}");
    });
}

fn folder_with_golden(text: &str) -> tempfile::NamedTempFile {
    let file = tempfile::NamedTempFile::new().expect("a file");
    fs::write(file.path(), text).expect("written");
    file
}

#[test]
fn the_examples_build_for_boards_that_nothing_emulates() {
    for board in Board::all().filter(|board| board.emulation.is_none()) {
        if board.is_available() {
            for program in ["decide", "selftest", "serial", "robot", "cycles"] {
                assert!(board.build(program).is_file());
            }
        }
    }
}

/// `boards.toml` names each folder that is a board's package, and what it says of a board is what the folder says.
#[test]
fn the_table_of_boards_is_that_of_the_folders() {
    let examples = firmware::repository().join("firmware-examples");
    let entries = fs::read_dir(&examples).expect("a folder");
    let packages = entries.map(|entry| entry.expect("an entry").path());
    let boards: BTreeSet<String> = packages
        .filter(|path| path.join("Cargo.toml").is_file() && !path.ends_with("common"))
        .map(|path| path.file_name().expect("a name").display().to_string())
        .collect();
    let listed: BTreeSet<String> = Board::all().map(|board| board.name.clone()).collect();
    assert_eq!(listed, boards, "boards.toml, and the folders beside it");
    for board in Board::all() {
        let settings = examples.join(&board.name).join(".cargo/config.toml");
        let settings = fs::read_to_string(settings).expect("the settings of cargo");
        let target = format!("target = \"{}\"", board.target);
        assert!(settings.contains(&target), "{}: {target}", board.name);
        if let Some(emulation) = &board.emulation {
            let runner = format!("runner = \"{} ", emulation.command.join(" "));
            assert!(settings.contains(&runner), "{}: {runner}", board.name);
        }
    }
}

#[test]
fn the_examples_decide() {
    Board::on_each_emulated(|board| {
        let (status, printed) = board.run(&board.build("decide"), &[]);
        assert_eq!(status, Some(0), "{}: {printed}", board.name);
    });
}
