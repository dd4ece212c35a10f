//! The checks themselves: each tries what it speaks of.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use tpg_tasks::task;
use tpg_tools::footprint::boards;

use super::{Finding, Part};
use crate::external::beside;
use crate::version::VERSION;

/// A small policy, to be run in the loop.
const POLICY: &[u8] = include_bytes!("../../../../docs/champions/cartpole.tpg");

/// Everything, in the order in which a user meets it.
pub(super) fn all() -> Vec<Finding> {
    let mut all = vec![tasks(), the_loop()];
    let rust = concat!(
        "install Rust ",
        env!("CARGO_PKG_RUST_VERSION"),
        " or newer: https://rustup.rs"
    );
    for tool in ["cargo", "rustc"] {
        all.push(program(Part::Build, tool, &[tool, "--version"], rust));
    }
    all.extend(emulated());
    let python = "apt-get install python3 python3-pip";
    all.push(program(
        Part::Python,
        "python3",
        &["python3", "--version"],
        python,
    ));
    all.push(program(
        Part::Python,
        "pip",
        &["python3", "-m", "pip", "--version"],
        python,
    ));
    let version = "import tpg; print('tpg', getattr(tpg, '__version__', ''), tpg.__file__)";
    all.push(program(
        Part::Python,
        "the package tpg",
        &["python3", "-c", version],
        "pip install ./trainer/python, in the repository",
    ));
    all.push(program(
        Part::Browser,
        "chromium",
        &["chromium", "--version"],
        "apt-get install chromium",
    ));
    all.push(drawing());
    all
}

/// MuJoCo's renderer, by a picture.
fn drawing() -> Finding {
    let what = "MuJoCo's renderer";
    #[cfg(feature = "render")]
    return finding(
        Part::Drawing,
        what,
        tpg_tasks::animation::try_to_draw()
            .map(|()| "a picture of Hopper".to_owned())
            .map_err(|failure| failure.error.to_string()),
        "apt-get install libegl1 libgl1-mesa-dri",
    );
    #[cfg(not(feature = "render"))]
    return finding(
        Part::Drawing,
        what,
        Err("built without it".to_owned()),
        "cargo build --release -p tpg --features render",
    );
}

fn finding(part: Part, what: &str, result: Result<String, String>, fix: &str) -> Finding {
    let works = result.is_ok();
    let found = result.unwrap_or_else(|why| why);
    Finding {
        part,
        what: what.to_owned(),
        works,
        found,
        fix: (!works).then(|| fix.to_owned()),
    }
}

/// The simulator and the models, by making every task.
fn tasks() -> Finding {
    let simulator = match task::simulator_version().as_str() {
        "none" => "without MuJoCo".to_owned(),
        version => format!("MuJoCo {version}"),
    };
    let names = task::names();
    let faults = names.iter().filter_map(|name| task::create(name).err());
    let faults: Vec<String> = faults.map(|fault| fault.to_string()).collect();
    let made = names.len() - faults.len();
    let said = format!(
        "tpg {VERSION}, {simulator}: {made} of {} tasks can be made",
        names.len()
    );
    let result = match faults.first() {
        None => Ok(said),
        Some(fault) => Err(format!("{said}; the first that cannot: {fault}")),
    };
    finding(
        Part::Tasks,
        "simulator and models",
        result,
        "make setup, then build again: cargo build --release",
    )
}

/// An episode of a small policy in the loop.
fn the_loop() -> Finding {
    let file = std::env::temp_dir().join(format!("tpg-doctor-{}.tpg", std::process::id()));
    let result = std::fs::write(&file, POLICY)
        .map_err(|error| format!("cannot write {}: {error}", file.display()))
        .and_then(|()| {
            let words = ["--episodes", "1", "--json"];
            let mut command = Command::new(beside("tpg-hil"));
            output(command.arg(&file).args(words))
        })
        .map(|_| "an episode of CartPole in two processes".to_owned());
    // A file that is left over in a folder for such files does no harm.
    let _ = std::fs::remove_file(&file);
    finding(
        Part::Loop,
        "programs, shared memory",
        result,
        "cargo build --release -p tpg-sim-bridge; shared memory needs space in /dev/shm and a writable $XDG_RUNTIME_DIR or /tmp",
    )
}

/// For each board that something emulates: the emulator, and a compiler.
fn emulated() -> Vec<Finding> {
    let mut findings: Vec<Finding> = Vec::new();
    for board in boards() {
        let Some(emulation) = &board.emulation else {
            continue;
        };
        if let Some(emulator) = emulation.command.first()
            && !findings.iter().any(|finding| finding.what == *emulator)
        {
            findings.push(program(
                Part::Boards,
                emulator,
                &[emulator, "--version"],
                "apt-get install qemu-system-arm qemu-system-misc",
            ));
        }
        let target = &board.target;
        findings.push(finding(
            Part::Boards,
            &board.name,
            compiler(target),
            &format!("rustup target add {target}, or in the repository: scripts/cargo-for --install {target}"),
        ));
    }
    findings
}

/// A compiler for a board: the toolchain's own, or one that the repository's script made.
fn compiler(target: &str) -> Result<String, String> {
    let folder =
        output(Command::new("rustc").args(["--print", "target-libdir", "--target", target]));
    if folder.is_ok_and(|folder| Path::new(&folder).is_dir()) {
        return Ok(format!("rustc compiles for {target}"));
    }
    let here = std::env::current_dir().unwrap_or_default();
    let mut scripts = here
        .ancestors()
        .map(|folder| folder.join("scripts/cargo-for"));
    let script = scripts.find(|script| script.is_file());
    let made = script.is_some_and(|script: PathBuf| {
        output(Command::new(script).args(["--check", target])).is_ok()
    });
    match made {
        true => Ok(format!("scripts/cargo-for compiles for {target}")),
        false => Err(format!("no compiler for {target}")),
    }
}

/// A program that says its version.
fn program(part: Part, what: &str, command: &[&str], fix: &str) -> Finding {
    let result = match command {
        [name, words @ ..] => output(Command::new(name).args(words)),
        [] => Err("no command".to_owned()),
    };
    finding(part, what, result, fix)
}

/// The first line that a command prints, or why it failed.
fn output(command: &mut Command) -> Result<String, String> {
    let name = command.get_program().to_string_lossy().into_owned();
    let output = command.stdin(Stdio::null()).output();
    let output = output.map_err(|error| format!("cannot run {name}: {error}"))?;
    let first = |bytes: &[u8]| {
        let text = String::from_utf8_lossy(bytes);
        text.lines().next().unwrap_or_default().trim().to_owned()
    };
    match output.status.success() {
        true => Ok(first(&output.stdout)),
        false => {
            // A traceback ends with what went wrong.
            let said = String::from_utf8_lossy(&output.stderr);
            let last = said.lines().last().unwrap_or_default();
            Err(format!("{name} fails ({}): {}", output.status, last.trim()))
        }
    }
}
