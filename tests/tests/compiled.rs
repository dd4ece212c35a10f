//! Policies that are compiled, as Rust and as C, decide as the interpreter does, bit for bit.
//!
//! All policies go into one Rust program and one C program, which read the same script of resets and observations and
//! print actions, paths and shared memory; the interpreter follows the script here.

#[path = "compiled/programs.rs"]
mod programs;
#[path = "compiled/script.rs"]
mod script;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use tpg_runtime::blob::RegisterMode;
use tpg_runtime::isa::Op;
use tpg_runtime::{HostAgent, Policy};
use tpg_tests::shapes::{ARITHMETIC, LONG, TRANSCENDENTAL, drifting_observations, typical_graph};
use tpg_tests::{fixtures, golden, old_format, random, samples};
use tpg_tools::export;

use programs::{Compiled, Toolchain, run_c, run_rust};
use script::{Followed, follow, write_script};

/// Random policies beside the golden ones.
const RANDOM: u64 = 32;
/// Random policies with front ends.
const PERCEIVING: u64 = 8;
/// Random policies with earlier observations in their windows.
const REMEMBERING: u64 = 16;

/// The policies with names that C and Rust accept.
fn policies() -> Vec<(String, Vec<u8>)> {
    let mut policies = Vec::new();
    for (name, _) in samples::all() {
        // Version 1 has no moves and latches.
        let version = if name == "copies" { 3 } else { 1 };
        let path = golden::path(&format!("v{version}/{name}.tpg"));
        let bytes = fs::read(path).expect("a golden policy");
        policies.push((format!("golden_{}", name.replace('-', "_")), bytes));
    }
    for (name, mode) in [
        ("stateful", RegisterMode::Stateful),
        ("stateless", RegisterMode::Stateless),
    ] {
        for task in ["cartpole", "pendulum"] {
            policies.push((
                format!("evolved_{task}_{name}"),
                fixtures::three_teams(task, mode),
            ));
        }
    }
    for (name, draft) in samples::large().into_iter().chain(samples::remembering()) {
        policies.push((format!("golden_{}", name.replace('-', "_")), draft.encode()));
    }
    for (name, draft) in samples::perceiving() {
        let name = format!("golden_{}", name.replace('-', "_"));
        let file = draft.encode();
        policies.push((format!("{name}_old"), old_format(&file)));
        policies.push((name, file));
    }
    for path in champions() {
        let name = path.file_stem().expect("a name").display().to_string();
        let bytes = fs::read(&path).expect("a champion");
        policies.push((format!("champion_{}", name.replace('-', "_")), bytes));
    }
    for seed in 0..RANDOM {
        policies.push((format!("random_{seed}"), random::policy(seed).encode()));
    }
    for seed in 0..PERCEIVING {
        let draft = random::perceiving_policy(seed);
        policies.push((format!("perceiving_{seed}"), draft.encode()));
    }
    for seed in 0..REMEMBERING {
        let draft = random::remembering_policy(seed);
        policies.push((format!("remembering_{seed}"), draft.encode()));
    }
    policies
}

/// The committed champions.
fn champions() -> Vec<PathBuf> {
    let folders = ["../docs/champions", "golden/champions"];
    let folders = folders.map(|folder| Path::new(env!("CARGO_MANIFEST_DIR")).join(folder));
    let mut files: Vec<PathBuf> = (folders.iter())
        .flat_map(|folder| fs::read_dir(folder).expect("a folder"))
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "tpg"))
        .collect();
    files.sort();
    assert!(files.len() >= 10, "{files:?}");
    files
}

#[test]
fn compiled_policies_decide_as_the_interpreter() {
    let blobs = policies();
    let mut script = String::new();
    let mut expected = Vec::new();
    let mut executed: BTreeSet<Op> = BTreeSet::new();
    let (mut most_teams, mut skipped) = (0, 0);
    let mut compiled = Vec::new();
    for (number, (name, bytes)) in blobs.iter().enumerate() {
        let policy = Policy::load(bytes).unwrap_or_else(|fault| panic!("{name}: {fault}"));
        let events = write_script(&mut script, number, &policy);
        let Followed {
            lines,
            ops,
            teams,
            skips,
        } = follow(policy, &events);
        expected.push(format!("P {number}"));
        expected.extend(lines);
        executed.extend(ops);
        most_teams = most_teams.max(teams);
        skipped += skips;
        compiled.push(Compiled {
            name: name.clone(),
            inputs: usize::from(policy.header().observation_len),
            outputs: policy.header().outputs(),
            memory: memory_words(&policy),
            rust: export::rust(&policy, "the tests"),
            c: export::c(&policy, name, "the tests"),
        });
    }
    let missing: Vec<&str> = Op::ALL
        .iter()
        .filter(|op| !executed.contains(op))
        .map(|op| op.mnemonic())
        .collect();
    assert!(missing.is_empty(), "no policy executed {missing:?}");
    assert!(
        most_teams >= 3 && skipped > 0,
        "{most_teams} teams, {skipped} programs took no part"
    );
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("compiled");
    let rust = run_rust(&folder, &compiled, &script);
    assert_same("Rust", &blobs, &expected, &rust);
    // Any sound set of options gives the same bits; the second one lets the compiler fuse and vectorise what it may.
    let toolchains: [Toolchain; 4] = [
        ("cc", &["-std=c11", "-O2", "-ffp-contract=off"]),
        ("cc", &["-std=gnu11", "-O3", "-march=native"]),
        ("cc", &["-std=c99", "-O1", "-DTPG_NO_ASSEMBLY"]),
        ("c++", &["-std=c++17", "-O1", "-x", "c++"]),
    ];
    for toolchain in toolchains {
        let c = run_c(&folder, &compiled, &script, toolchain);
        assert_same(&format!("C with {toolchain:?}"), &blobs, &expected, &c);
    }
    println!("{} policies, {} lines agree", blobs.len(), expected.len());
}

fn memory_words(policy: &Policy<'_>) -> usize {
    let agent = HostAgent::new(*policy).map(Box::new).expect("room");
    agent.memory().len()
}

/// Compares what a program printed with what the interpreter did, and names the first difference.
fn assert_same(what: &str, blobs: &[(String, Vec<u8>)], expected: &[String], found: &str) {
    let mut policy = "";
    let mut step = 0;
    let mut found = found.lines();
    for line in expected {
        if let Some(number) = line.strip_prefix("P ") {
            policy = &blobs[number.parse::<usize>().expect("a number")].0;
            step = 0;
        }
        assert_eq!(
            found.next(),
            Some(line.as_str()),
            "{what}, {policy}, line {step} (found, interpreter)"
        );
        step += 1;
    }
    assert_eq!(found.next(), None, "{what} prints more");
}

/// The modules that the bench times are those of its policies.
#[test]
fn timed_modules_are_current() {
    for (name, mix) in [
        ("arithmetic", ARITHMETIC),
        ("transcendental", TRANSCENDENTAL),
    ] {
        let (blob, _) = typical_graph(mix, 9, &LONG, false, &drifting_observations());
        let policy = Policy::load(&blob).expect("a policy");
        let text = export::rust(
            &policy,
            "TPG_ACCEPT=1 cargo test -p tpg-tests --test compiled timed",
        );
        golden::assert_text(&format!("../benches/compiled/{name}.rs"), &text);
    }
}

/// What the interpreter refuses is refused: a word of C, a path that is no C file, a damaged policy.
#[test]
fn export_refuses_what_it_cannot_write() {
    use tpg_tests::process::{stderr, text, tpg};
    let policy = golden::path("v1/classic.tpg");
    let folder = tempfile::tempdir().expect("a folder");
    let damaged = folder.path().join("damaged.tpg");
    let mut bytes = fs::read(&policy).expect("a golden policy");
    bytes[100] ^= 1;
    fs::write(&damaged, bytes).expect("a file");
    for (file, out, status, says) in [
        (&policy, "while.c", 2, "not a C keyword"),
        (&policy, "1st.c", 2, "champion.c"),
        (&policy, "champion.cpp", 2, "champion.c"),
        (&policy, "nowhere/champion.c", 2, "cannot write"),
        (&damaged, "champion.c", 3, "damaged.tpg"),
    ] {
        let out = folder.path().join(out);
        let output = tpg(["export", text(file), "--c", text(&out)]);
        assert_eq!(
            output.status.code(),
            Some(status),
            "{}: {}",
            out.display(),
            stderr(&output)
        );
        assert!(stderr(&output).contains(says), "{}", stderr(&output));
    }
    let neither = tpg(["export", text(&policy)]);
    assert_eq!(neither.status.code(), Some(2));
}
