//! The shape of the workspace: what each package may depend on, that modules import in one direction, where `unsafe` is.

#[path = "architecture/imports.rs"]
mod imports;
#[path = "architecture/unsafe_code.rs"]
mod unsafe_code;

use std::path::{Path, PathBuf};
use std::process::Command;

/// Packages of the workspace that no package below the trainer may use.
const TRAINER: [&str; 4] = ["tpg-tasks", "tpg-trainer", "tpg-experiments", "tpg"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Names of the packages that a package depends on, itself included, without build and test dependencies.
fn dependencies(package: &str, flags: &[&str]) -> Vec<String> {
    let mut command = Command::new(env!("CARGO"));
    command.args(["tree", "--package", package, "--edges", "normal"]);
    command.args(["--prefix", "none", "--offline"]).args(flags);
    let output = command.current_dir(root()).output().expect("cargo tree");
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{package}: {error}");
    let text = String::from_utf8(output.stdout).expect("text");
    let name = |line: &str| line.split(' ').next().unwrap_or_default().to_owned();
    text.lines().map(name).collect()
}

fn assert_none_of(package: &str, flags: &[&str], forbidden: &[&str]) {
    let found = dependencies(package, flags);
    assert!(found.iter().any(|name| name == package), "{found:?}");
    for name in forbidden {
        assert!(
            !found.iter().any(|found| found == name),
            "{package} depends on {name}"
        );
    }
}

/// Each package has what its audience needs, and no more.
#[test]
fn packages_depend_on_what_their_audience_needs() {
    let drawing = ["plotters", "png", "ab_glyph", "dejavu"];
    let runtime = [&TRAINER[..], &drawing, &["tpg-tools", "mujoco-rs", "clap"]].concat();
    assert_none_of("tpg-runtime", &[], &runtime);
    assert_none_of("tpg-runtime-c", &[], &runtime);
    let tools = [&TRAINER[..], &drawing, &["mujoco-rs", "clap"]].concat();
    assert_none_of("tpg-tools", &[], &tools);
    let tasks = [&TRAINER[1..], &drawing, &["clap"]].concat();
    assert_none_of("tpg-tasks", &[], &tasks);
    let trainer = [&TRAINER[2..], &drawing, &["clap"]].concat();
    assert_none_of("tpg-trainer", &[], &trainer);
    assert_none_of("tpg-experiments", &[], &["clap", "tpg"]);
    let bridge = [&TRAINER[1..], &drawing, &["tpg-tools"]].concat();
    assert_none_of("tpg-sim-bridge", &[], &bridge);
    let controller = [&TRAINER[..], &drawing, &["tpg-tools", "mujoco-rs"]].concat();
    assert_none_of("tpg-sim-bridge", &["--no-default-features"], &controller);
}

/// A build without MuJoCo needs none of it.
#[test]
fn mujoco_is_optional() {
    for package in ["tpg-tasks", "tpg-trainer", "tpg-experiments", "tpg"] {
        assert_none_of(package, &["--no-default-features"], &["mujoco-rs"]);
    }
    let plant = ["--no-default-features", "--features", "plant"];
    assert_none_of("tpg-sim-bridge", &plant, &["mujoco-rs"]);
}

/// The root files of the crates whose modules import in one direction.
const CRATES: &[&str] = &[
    "runtime/src/lib.rs",
    "runtime/c-api/src/lib.rs",
    "runtime/tools/src/lib.rs",
    "trainer/src/lib.rs",
    "trainer/tasks/src/lib.rs",
    "trainer/experiments/src/lib.rs",
    "trainer/cli/src/main.rs",
    "sim-bridge/src/lib.rs",
    "tests/src/lib.rs",
];

#[test]
fn modules_import_in_one_direction() {
    let circles: Vec<String> = CRATES
        .iter()
        .flat_map(|crate_root| {
            let circles = imports::circles(&root().join(crate_root));
            circles
                .into_iter()
                .map(move |circle| format!("{crate_root}: {circle}"))
        })
        .collect();
    assert!(
        circles.is_empty(),
        "modules import in a circle:\n{}",
        circles.join("\n")
    );
}

#[test]
fn unsafe_code_is_where_it_is_listed_and_says_why_it_is_sound() {
    let faults = unsafe_code::faults(&root());
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
