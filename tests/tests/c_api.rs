//! The library for C: its header is that of its source, C decides as Rust, and misuse is answered by a status.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use tpg_runtime::{Action, HostAgent, Policy, Reset};
use tpg_tests::process::{memory_checker, pipe, static_library};
use tpg_tests::random::{self, Dice};
use tpg_tests::{golden, samples};

fn c_api() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../runtime/c-api")
}

#[test]
fn the_header_is_that_of_the_source() {
    let mut config =
        cbindgen::Config::from_file(c_api().join("cbindgen.toml")).expect("a configuration");
    config.language = cbindgen::Language::C;
    let mut builder = cbindgen::Builder::new().with_config(config);
    for file in ["status", "agent"] {
        builder = builder.with_src(c_api().join(format!("src/{file}.rs")));
    }
    let mut text = Vec::new();
    builder.generate().expect("a header").write(&mut text);
    let text = String::from_utf8(text).expect("text");
    golden::assert_text("../../runtime/c-api/include/tpg_runtime.h", &text);
}

/// Compiles a C program against the library, as C11 with every warning an error.
fn compile(source: &Path, name: &str) -> PathBuf {
    let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let mut cc = Command::new("cc");
    cc.args(["-std=c11", "-O1", "-Wall", "-Wextra", "-Werror", "-I"])
        .arg(c_api().join("include"));
    cc.arg(source)
        .arg(static_library())
        .arg("-o")
        .arg(&program)
        .args(["-lpthread", "-ldl", "-lm"]);
    assert!(
        cc.status().expect("a C compiler, as cc").success(),
        "{} does not build",
        source.display()
    );
    program
}

/// Golden policies and random ones, with front ends and without.
fn policies() -> impl Iterator<Item = Vec<u8>> {
    let golden = samples::all().into_iter().chain(samples::large());
    let golden = golden.chain(samples::remembering());
    let golden = golden.map(|(_, draft)| draft.encode());
    let random = (100..110).map(|seed| random::policy(seed).encode());
    let perceiving = (100..106).map(|seed| random::perceiving_policy(seed).encode());
    golden.chain(random).chain(perceiving)
}

#[test]
fn c_decides_as_rust() {
    let program = compile(&c_api().join("examples/decide.c"), "decide");
    let folder = tempfile::tempdir().expect("a folder");
    for (number, bytes) in policies().enumerate() {
        let path = folder.path().join("policy.tpg");
        fs::write(&path, &bytes).expect("a file");
        let policy = Policy::load(&bytes).expect("a policy");
        let mut agent = Box::new(HostAgent::new(policy).expect("room"));
        agent.reset(Reset::Agent, 0xfeed);
        let mut dice = Dice::new(number as u64);
        let (mut script, mut expected) = (String::new(), String::new());
        for step in 0..100 {
            if step % 40 == 39 {
                let _ = writeln!(script, "reset {step:x}");
                agent.reset(Reset::Episode, step);
            }
            let x: Vec<f32> = (0..policy.header().observation_len)
                .map(|_| dice.measurement())
                .collect();
            let words = |x: &[f32]| {
                x.iter()
                    .map(|x| format!(" {:08x}", x.to_bits()))
                    .collect::<String>()
            };
            let _ = writeln!(script, "{}", words(&x));
            let _ = match agent.decide(&x).expect("the right length").action {
                Action::Discrete(index) => writeln!(expected, " {index:08x}"),
                Action::Continuous(values) => writeln!(expected, "{}", words(values)),
            };
        }
        let mut command = Command::new(&program);
        command.arg(&path).arg("feed");
        assert_eq!(pipe(command, &script), expected, "policy {number}");
    }
}

#[test]
fn misuse_is_answered_by_a_status() {
    let command = Command::new(compile(&own_source("misuse.c"), "misuse"));
    print!("{}", misuse(command));
}

/// A C program of these tests.
fn own_source(name: &str) -> PathBuf {
    (Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/c_api")).join(name)
}

/// What the misusing program prints of its calls.
fn misuse(mut command: Command) -> String {
    command.args([
        golden::path("v1/reactive.tpg"),
        golden::path("v1/classic.tpg"),
    ]);
    pipe(command, "")
}

#[test]
fn a_memory_checker_finds_nothing() {
    let Some(checked) = memory_checker() else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let exact = compile(&own_source("exact.c"), "exact");
    let mut command = checked(&exact);
    command.arg("0");
    for (number, bytes) in policies().enumerate() {
        let path = folder.path().join(format!("{number}.tpg"));
        fs::write(&path, &bytes).expect("a file");
        command.arg(path);
    }
    print!("{}", pipe(command, ""));
    let misusing = compile(&own_source("misuse.c"), "misuse-checked");
    print!("{}", misuse(checked(&misusing)));
    // It watches the library too: a read beyond a block that is too short is found.
    let mut short = checked(&exact);
    short.arg("1").arg(golden::path("v1/reactive.tpg"));
    let output = short.output().expect("valgrind starts");
    let found = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(99), "{found}");
    assert!(found.contains("Invalid read"), "{found}");
    assert!(found.contains("tpg_decide"), "{found}");
}
