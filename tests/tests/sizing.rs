//! Firmware is sized when it is compiled: what does not fit does not compile, and says why.

use std::path::Path;
use std::process::Command;

use tpg_runtime::{Agent, AnyWidth, Capacities, CapacityError, Policy, agent_type};
use tpg_tests::process::text;

static BLOB: &[u8] = include_bytes!("../golden/v1/team-memory.tpg");
const NEEDED: Capacities = Capacities::of(BLOB);
const _: () = NEEDED.assert_fits(&NEEDED);

#[test]
fn an_agent_of_the_policys_own_type_decides() {
    let policy = Policy::load(BLOB).expect("a policy");
    let mut agent = <agent_type!(BLOB)>::new(policy).expect("exactly enough");
    let observation = vec![0.25; usize::from(policy.header().observation_len)];
    assert!(agent.decide(&observation).is_ok());
    assert!(size_of_val(&agent) < NEEDED.state_bytes() + 400);
}

#[test]
fn a_policy_that_is_loaded_later_is_refused_with_both_numbers() {
    let policy = Policy::load(BLOB).expect("a policy");
    let refused = Agent::<'_, AnyWidth, 16, 64, 64, 64>::new(policy).map(|_| ());
    let error = CapacityError {
        resource: "words",
        needed: NEEDED.words,
        available: 16,
    };
    assert_eq!(refused, Err(error));
}

/// Compiles a firmware-like crate around a policy; what the compiler said if it failed.
fn compile(folder: &Path, policy: &[u8], check: &str) -> Result<(), String> {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let write = |name: &str, bytes: &[u8]| {
        std::fs::write(folder.join(name), bytes).expect("a file of the crate");
    };
    let runtime = root.join("runtime");
    let manifest = format!(
        "[package]\nname = \"firmware\"\nedition = \"2024\"\n[workspace]\n\
         [dependencies]\ntpg-runtime = {{ path = {:?} }}\n[lib]\npath = \"lib.rs\"\n",
        text(&runtime)
    );
    write("Cargo.toml", manifest.as_bytes());
    std::fs::copy(root.join("Cargo.lock"), folder.join("Cargo.lock")).expect("the versions");
    write("champion.tpg", policy);
    let source = format!(
        "#![no_std]\nuse tpg_runtime::Capacities;\n\
         pub static BLOB: &[u8] = include_bytes!(\"champion.tpg\");\n\
         pub const NEEDED: Capacities = Capacities::of(BLOB);\n{check}\n"
    );
    write("lib.rs", source.as_bytes());
    let output = Command::new(env!("CARGO"))
        .args(["check", "--quiet", "--offline"])
        .current_dir(folder)
        .env("CARGO_TARGET_DIR", folder.join("target"))
        .output()
        .expect("cargo runs");
    if output.status.success() {
        return Ok(());
    }
    Err(String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn what_does_not_fit_does_not_compile() {
    let folder = tempfile::tempdir().expect("a folder");
    let fails = |policy: &[u8], check: &str, message: &str| {
        let said = compile(folder.path(), policy, check).expect_err(message);
        assert!(said.contains(message), "no {message:?} in: {said}");
    };
    let agent = "pub type Champion = tpg_runtime::agent_type!(BLOB);\npub fn f(_: &Champion) {}";
    let available = |words: usize| {
        format!(
            "{agent}\nconst AVAILABLE: Capacities = Capacities {{ words: {words}, ..NEEDED }};\n\
             const _: () = NEEDED.assert_fits(&AVAILABLE);"
        )
    };
    let words = NEEDED.words;
    let message = format!("policy needs words = {words}, available are {}", words - 1);
    fails(BLOB, &available(words - 1), &message);
    fails(b"TPG", agent, "3 bytes are fewer than a header's 72");
    fails(&[b'x'; 100], agent, "the file does not begin with TPGB");
    let mut newer = BLOB.to_vec();
    newer[4] = 9;
    let versions = "the file has format version 9, this build reads versions 1 to 2";
    fails(&newer, agent, versions);
    let cut = &BLOB[..BLOB.len() - 5];
    let lengths = format!(
        "its header announces {} bytes, the file has {}",
        BLOB.len(),
        cut.len()
    );
    fails(cut, agent, &lengths);
    compile(folder.path(), BLOB, &available(words)).expect("what fits compiles");
}
