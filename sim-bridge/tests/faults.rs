//! The short form of the harness that breaks loops in many ways: each recovers or says why it ends, and nothing is left.
#![cfg(all(feature = "plant", target_os = "linux"))]

use std::path::Path;
use std::process::Command;

#[test]
fn broken_loops_recover_or_tell_and_leave_nothing() {
    let repository = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let programs = Path::new(env!("CARGO_BIN_EXE_tpg-hil"))
        .parent()
        .expect("a folder");
    let ended = Command::new("python3")
        .arg("-B")
        .arg(repository.join("scripts/bridge-harness"))
        .arg(programs)
        .arg(repository.join("docs/champions/pendulum.tpg"))
        .arg("--short")
        .status()
        .expect("python3 is there");
    assert!(ended.success(), "its table and complaints are above");
}
