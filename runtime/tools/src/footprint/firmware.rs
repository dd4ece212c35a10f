//! Finds, builds, inspects and runs the firmware for a policy.

use std::collections::HashMap;
use std::env;
use std::ffi::OsStr;
use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Output};

use object::{Object as _, ObjectSection as _, SectionFlags, elf};
use serde::Serialize;
use tpg_runtime::Policy;

use super::board::{Board, Emulation, boards};
use super::costs::{Costs, Trial};
use super::pack::pack;
use super::stack::{self, StackError};

/// How the firmware is compiled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Profile {
    /// Saves flash. Uses opt-level s and the runtime's feature `small-code`. The examples use this by default.
    Size,
    /// Makes decisions fast. Uses opt-level 3 without `small-code`.
    Speed,
}

impl Profile {
    /// All profiles. The command line lists their names.
    pub const ALL: [Profile; 2] = [Profile::Size, Profile::Speed];

    /// The profile's name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Profile::Size => "size",
            Profile::Speed => "speed",
        }
    }

    /// The options for cargo, and the folder that cargo then builds in.
    const fn options(self) -> (&'static [&'static str], &'static str) {
        match self {
            Profile::Size => (&["--release"], "release"),
            Profile::Speed => (
                &[
                    "--profile=speed",
                    "--no-default-features",
                    "--features=all-operations",
                ],
                "speed",
            ),
        }
    }
}

impl fmt::Display for Profile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Why a footprint could not be measured.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FootprintError {
    /// The firmware's sources were not found.
    #[error(
        "no firmware-examples/ in or above {0}, nor above this program: name the folder with --firmware DIR"
    )]
    NoSources(PathBuf),
    /// The folder does not hold the expected package.
    #[error("{0} holds no package {1}: --firmware must name the repository's firmware-examples/")]
    NoPackage(PathBuf, String),
    /// A program cannot be started.
    #[error("cannot start {program}: {advice}")]
    NoProgram {
        /// The program.
        program: String,
        /// How to get it.
        advice: &'static str,
        /// The system's error.
        source: io::Error,
    },
    /// The firmware does not build.
    #[error("firmware does not build for {board}:\n{output}")]
    Build {
        /// The board.
        board: String,
        /// The compiler's output.
        output: String,
    },
    /// The firmware does not run, or its output is not as expected.
    #[error("firmware does not run on {board} ({status}): {output}")]
    Run {
        /// The board.
        board: String,
        /// How the emulator ended.
        status: ExitStatus,
        /// What it printed.
        output: String,
    },
    /// The policies that are tried for the costs of operations cannot be made or counted.
    #[error("no costs of operations on {board}: {reason}")]
    Costs {
        /// The board.
        board: String,
        /// Why.
        reason: String,
    },
    /// No bound was found for a decision's stack.
    #[error("no bound of the stack in {path} ({board})")]
    Stack {
        /// The board.
        board: String,
        /// The program.
        path: PathBuf,
        /// Why.
        source: StackError,
    },
    /// The firmware's file cannot be read.
    #[error("cannot look into {path}")]
    Elf {
        /// The file.
        path: PathBuf,
        /// Why.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
}

/// Part of the mangled name of the function that decides once, in the program `decide`.
const DECISION: &str = "6decide4step";

/// What was measured for a policy on a board. The fields are the keys of `--json`. A value that needs an emulator is
/// `null` if the board has none.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measured {
    /// The board.
    pub board: String,
    /// Its processor.
    pub processor: String,
    /// Flash used by the firmware `decide` without the policy, in bytes.
    pub flash_code_bytes: u64,
    /// Size of the policy's file, in bytes. The file is stored in flash.
    pub flash_blob_bytes: u64,
    /// Bytes of the static variables of `decide`, among them the agent's state, and of the stack frame of `main`, in which
    /// the rest of the agent lies.
    pub ram_static_bytes: u64,
    /// The most stack that a decision of `decide` can use, in bytes, found from its code. Interrupt handlers need more.
    pub stack_bytes_bound: u64,
    /// What was measured by running it.
    #[serde(flatten)]
    pub seen: Seen,
}

/// What was measured by running the firmware. Every field is `None` if the board has no emulator.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Seen {
    /// RAM of the agent and its state, in bytes.
    pub agent_bytes: Option<u64>,
    /// The most stack that a measured decision used, in bytes.
    pub stack_bytes: Option<u64>,
    /// The number of decisions measured.
    pub decisions: Option<u64>,
    /// The mean number of policy instructions per decision.
    pub instructions_mean: Option<f64>,
    /// The mean number of processor instructions per decision.
    pub machine_instructions_mean: Option<f64>,
    /// The most processor instructions in a measured decision.
    pub machine_instructions_worst_seen: Option<u64>,
    /// The policy instructions of that decision.
    pub instructions_in_worst_seen: Option<u64>,
}

/// The folder with the firmware's sources.
#[derive(Debug, Clone)]
pub struct Firmware {
    folder: PathBuf,
}

impl Firmware {
    /// Uses the given folder. Without one, looks for `firmware-examples` in or above the working directory, then above
    /// this program.
    ///
    /// # Errors
    /// [`FootprintError::NoSources`] or [`FootprintError::NoPackage`].
    pub fn find(given: Option<&Path>) -> Result<Self, FootprintError> {
        let here = env::current_dir().unwrap_or_default();
        let program = env::current_exe().unwrap_or_default();
        let nearby = || {
            (here.ancestors().chain(program.ancestors()))
                .map(|folder| folder.join("firmware-examples"))
                .find(|folder| folder.is_dir())
        };
        let folder = match given {
            Some(folder) => folder.to_owned(),
            None => nearby().ok_or_else(|| FootprintError::NoSources(here.clone()))?,
        };
        let first = &boards()[0].name;
        if !folder.join(first).join("Cargo.toml").is_file() {
            return Err(FootprintError::NoPackage(folder, first.clone()));
        }
        let folder = fs::canonicalize(&folder).unwrap_or(folder);
        Ok(Firmware { folder })
    }

    /// Builds the firmware for a policy and inspects it. Runs it if the board has an emulator.
    ///
    /// # Errors
    /// Any other [`FootprintError`].
    pub fn measure(
        &self,
        board: &Board,
        profile: Profile,
        policy: &Path,
    ) -> Result<Measured, FootprintError> {
        let bytes = fs::metadata(policy).map(|data| data.len());
        let flash_blob_bytes = bytes.map_err(|error| unreadable(policy, error))?;
        let decide = self.build(board, profile, "decide", policy)?;
        let (flash, ram) = sections(&decide)?;
        let unbounded = |source| FootprintError::Stack {
            board: board.name.clone(),
            path: decide.clone(),
            source,
        };
        let stack_bytes_bound = stack::bound(&decide, DECISION).map_err(unbounded)?;
        let frame = stack::callers_frame(&decide, DECISION).map_err(unbounded)?;
        let seen = match &board.emulation {
            None => Seen::default(),
            Some(emulation) => self.run(board, emulation, profile, policy)?,
        };
        Ok(Measured {
            board: board.name.clone(),
            processor: board.processor.clone(),
            flash_code_bytes: flash.saturating_sub(flash_blob_bytes),
            flash_blob_bytes,
            ram_static_bytes: ram + frame,
            stack_bytes_bound,
            seen,
        })
    }

    /// Measures what the policy's operations cost on an emulated board, and bounds a decision by them.
    ///
    /// # Errors
    /// [`FootprintError::Costs`] if nothing emulates the board, or if the policy is too large to be tried; any other
    /// [`FootprintError`].
    pub fn costs(
        &self,
        board: &Board,
        profile: Profile,
        path: &Path,
    ) -> Result<Costs, FootprintError> {
        let none = |reason: String| FootprintError::Costs {
            board: board.name.clone(),
            reason,
        };
        let Some(emulation) = &board.emulation else {
            return Err(none("nothing emulates it".into()));
        };
        let bytes = fs::read(path).map_err(|error| unreadable(path, error))?;
        let policy = Policy::load(&bytes).map_err(|error| unreadable(path, error))?;
        let trial = Trial::new(&bytes, &policy).map_err(|error| none(error.to_string()))?;
        let program = self.build(board, profile, "count", path)?;
        // Beside the program, which this call has just built.
        let file = program.with_extension("pack");
        fs::write(&file, pack(&trial.policies, 0)).map_err(|error| unreadable(&file, error))?;
        let load = format!(
            "loader,file={},addr={:#x},force-raw=on",
            file.display(),
            emulation.spare
        );
        let (status, printed) = emulate(emulation, &program, &["-device", &load])?;
        let most: Vec<u64> = (printed.lines())
            .filter_map(|line| line.split(' ').nth(2)?.parse().ok())
            .collect();
        let bound = trial.bound(&most).filter(|_| status.success());
        bound.ok_or_else(|| {
            none(format!(
                "its program `count` ended with {status}: {printed}"
            ))
        })
    }

    /// Builds and runs the program `measure`.
    fn run(
        &self,
        board: &Board,
        emulation: &Emulation,
        profile: Profile,
        policy: &Path,
    ) -> Result<Seen, FootprintError> {
        let program = self.build(board, profile, "measure", policy)?;
        let printed = run(board, emulation, &program)?;
        let number = |key: &str| printed.get(key).copied();
        let decisions = number("decisions");
        let mean = |key: &str| Some(number(key)? as f64 / decisions?.max(1) as f64);
        Ok(Seen {
            agent_bytes: number("agent_bytes"),
            stack_bytes: number("stack_bytes"),
            decisions,
            instructions_mean: mean("instructions_sum"),
            machine_instructions_mean: mean("machine_instructions_sum"),
            machine_instructions_worst_seen: number("machine_instructions_worst_seen"),
            instructions_in_worst_seen: number("instructions_in_worst_seen"),
        })
    }

    fn build(
        &self,
        board: &Board,
        profile: Profile,
        program: &str,
        policy: &Path,
    ) -> Result<PathBuf, FootprintError> {
        let repository = self.folder.parent().unwrap_or(&self.folder);
        let target_dir = repository.join("target/footprint").join(&board.name);
        let policy = fs::canonicalize(policy).map_err(|error| unreadable(policy, error))?;
        let (options, folder) = profile.options();
        let mut cargo = Command::new(repository.join("scripts/cargo-for"));
        cargo
            .args([&board.target, "build", "--quiet", "--bin", program])
            .args(options)
            .current_dir(self.folder.join(&board.name))
            .env("CARGO_TARGET_DIR", &target_dir)
            .env("TPG_CHAMPION", policy)
            .env_remove("RUSTFLAGS")
            .env_remove("CARGO_ENCODED_RUSTFLAGS");
        let output = output(&mut cargo, "it lies in the repository's scripts/")?;
        if !output.status.success() {
            return Err(FootprintError::Build {
                board: board.name.clone(),
                output: text(&output),
            });
        }
        Ok(target_dir.join(&board.target).join(folder).join(program))
    }
}

fn run(
    board: &Board,
    emulation: &Emulation,
    program: &Path,
) -> Result<HashMap<String, u64>, FootprintError> {
    let (status, printed) = emulate(emulation, program, &[])?;
    let numbers: HashMap<_, _> = (printed.lines())
        .filter_map(|line| line.split_once(' '))
        .filter_map(|(key, number)| Some((key.to_owned(), number.parse().ok()?)))
        .collect();
    if status.success() && numbers.contains_key("decisions") {
        return Ok(numbers);
    }
    Err(FootprintError::Run {
        board: board.name.clone(),
        status,
        output: printed,
    })
}

/// Runs a program on the emulator while its clock counts instructions. Returns how it ended and what it printed.
fn emulate(
    emulation: &Emulation,
    program: &Path,
    options: &[&str],
) -> Result<(ExitStatus, String), FootprintError> {
    let mut emulator = Command::new(&emulation.command[0]);
    emulator
        .args(&emulation.command[1..])
        .args(&emulation.count)
        .args(["-display", "none", "-monitor", "none", "-serial", "null"])
        .args(options)
        .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(program);
    let advice = "install it (apt-get install qemu-system-arm qemu-system-misc)";
    let output = output(&mut emulator, advice)?;
    Ok((output.status, text(&output)))
}

/// The bytes of flash and the bytes of static variables of a program.
fn sections(path: &Path) -> Result<(u64, u64), FootprintError> {
    let bytes = fs::read(path).map_err(|error| unreadable(path, error))?;
    let file = object::File::parse(bytes.as_slice()).map_err(|error| unreadable(path, error))?;
    let (mut flash, mut ram) = (0, 0);
    for section in file.sections() {
        let SectionFlags::Elf { sh_flags, .. } = section.flags() else {
            continue;
        };
        let (allocated, writable) = (
            sh_flags & u64::from(elf::SHF_ALLOC) != 0,
            sh_flags & u64::from(elf::SHF_WRITE) != 0,
        );
        // A linker script reserves these sections. They hold no variables.
        let reserved = matches!(section.name(), Ok(".stack" | ".heap"));
        if !allocated || reserved {
            continue;
        }
        let stored = section.file_range().is_some();
        flash += if stored { section.size() } else { 0 };
        ram += if writable { section.size() } else { 0 };
    }
    Ok((flash, ram))
}

fn unreadable(
    path: &Path,
    source: impl Into<Box<dyn std::error::Error + Send + Sync>>,
) -> FootprintError {
    FootprintError::Elf {
        path: path.to_owned(),
        source: source.into(),
    }
}

fn output(command: &mut Command, advice: &'static str) -> Result<Output, FootprintError> {
    command
        .output()
        .map_err(|source| FootprintError::NoProgram {
            program: OsStr::to_string_lossy(command.get_program()).into_owned(),
            advice,
            source,
        })
}

/// Both outputs together. Some versions of QEMU print semihosting text to standard error, others to standard output.
fn text(output: &Output) -> String {
    [&output.stdout, &output.stderr]
        .map(|bytes| String::from_utf8_lossy(bytes))
        .concat()
}
