//! The firmware examples, built and run on QEMU.

use std::collections::BTreeMap;
use std::env;
use std::fs;
use std::num::NonZero;
use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{LazyLock, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use tpg_tools::footprint::{self, Emulation, boards};

pub use tpg_tools::footprint::pack;

/// Set this environment variable to `1` where a missing emulator, target or memory checker must be a failure, not a skipped test.
pub const REQUIRED: &str = "TPG_REQUIRE_QEMU";
/// After this long an emulator is taken to hang.
const WATCHDOG: Duration = Duration::from_secs(600);

/// A board that has a package in `firmware-examples/`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Board(&'static footprint::Board);

/// Cortex-M4F, single-precision floating-point unit.
pub static M4F: LazyLock<Board> = LazyLock::new(|| Board::named("mps2-an386"));

/// 32-bit RISC-V without floating-point unit and atomics.
pub static RISCV: LazyLock<Board> = LazyLock::new(|| Board::named("riscv-virt"));

/// Root of the repository.
#[must_use]
pub fn repository() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// Whether a program is there and runs with these arguments.
#[must_use]
pub fn runs(program: &str, args: &[&str]) -> bool {
    let status = (Command::new(program).args(args))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    status.is_ok_and(|status| status.success())
}

/// Says why tests are skipped; `false`.
///
/// # Panics
/// If the environment says that they must not be, by [`REQUIRED`].
pub fn skip(name: &str, reason: &str) -> bool {
    assert!(
        env::var(REQUIRED).is_err(),
        "{REQUIRED} is set, but {reason}"
    );
    eprintln!("skipped on {name}: {reason}");
    false
}

/// Whether programs in C can be built for [`M4F`] and run; says why not.
///
/// # Panics
/// If they cannot and the environment says that they must be, by [`REQUIRED`].
#[must_use]
pub fn c_is_available() -> bool {
    if !M4F.is_available() {
        return false;
    }
    for (program, package) in [("arm-none-eabi-gcc", "gcc-arm-none-eabi"), ("make", "make")] {
        if !runs(program, &["--version"]) {
            let reason = format!("{program} is missing: apt-get install {package}");
            return skip("c-mps2-an386", &reason);
        }
    }
    true
}

/// Builds the example in C with a policy and returns its program.
///
/// # Panics
/// If it does not build.
#[must_use]
pub fn build_c(policy: &Path) -> PathBuf {
    // All builds share a folder: the second one waits, and gets a program of its own.
    static BUILDING: Mutex<()> = Mutex::new(());
    let _one = BUILDING.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = repository().join("firmware-examples/c-mps2-an386");
    let build = repository().join("target/firmware/c-mps2-an386");
    let output = Command::new("make")
        .args(["--silent", "-C"])
        .arg(folder)
        .arg(format!("CHAMPION={}", policy.display()))
        .arg(format!("BUILD={}", build.display()))
        .env_remove("RUSTFLAGS")
        .env_remove("CARGO_ENCODED_RUSTFLAGS")
        .output()
        .expect("make starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success(),
        "the example in C does not build: {said}"
    );
    let name = policy.file_stem().expect("a file's name");
    let program = build.join(name).with_extension("elf");
    fs::copy(build.join("decide.elf"), &program).expect("copied");
    program
}

impl Board {
    /// Every board.
    pub fn all() -> impl Iterator<Item = Board> {
        boards().iter().map(Board)
    }

    /// The boards that QEMU emulates.
    pub fn emulated() -> impl Iterator<Item = Board> {
        Self::all().filter(|board| board.0.emulation.is_some())
    }

    /// Calls `run` with each board whose emulator is there, with as many at once as there are cores: an emulator uses one.
    ///
    /// # Panics
    /// If `run` does.
    pub fn on_each_emulated(run: impl Fn(Board) + Sync) {
        let boards = Mutex::new(Self::emulated().filter(Board::is_available));
        let next = || boards.lock().unwrap_or_else(PoisonError::into_inner).next();
        thread::scope(|scope| {
            for _ in 0..thread::available_parallelism().map_or(1, NonZero::get) {
                scope.spawn(|| {
                    while let Some(board) = next() {
                        run(board);
                    }
                });
            }
        });
    }

    /// The board of that name.
    ///
    /// # Panics
    /// If there is none.
    #[must_use]
    pub fn named(name: &str) -> Board {
        let found = Self::all().find(|board| board.name == name);
        found.unwrap_or_else(|| panic!("no board {name} in firmware-examples/boards.toml"))
    }

    /// How the board is emulated.
    ///
    /// # Panics
    /// If nothing emulates it.
    #[must_use]
    pub fn emulation(&self) -> &'static Emulation {
        let emulation = self.0.emulation.as_ref();
        emulation.unwrap_or_else(|| panic!("nothing emulates {}", self.name))
    }

    /// Whether the board's emulator and compiler are here; says why not.
    ///
    /// # Panics
    /// If they are not and the environment says that they must be, by [`REQUIRED`].
    #[must_use]
    pub fn is_available(&self) -> bool {
        let emulator = self.0.emulation.as_ref().map(|e| e.command[0].as_str());
        let missing = emulator.filter(|emulator| !runs(emulator, &["--version"]));
        let cargo_for = repository().join("scripts/cargo-for");
        let reason = if let Some(emulator) = missing {
            format!("{emulator} is missing: apt-get install qemu-system-arm qemu-system-misc")
        } else if !runs(&cargo_for.to_string_lossy(), &["--check", &self.target]) {
            format!(
                "no compiler for {0}: rustup target add {0}, or scripts/cross-toolchain .cross {0}",
                self.target
            )
        } else {
            return true;
        };
        skip(&self.name, &reason)
    }

    /// Builds one of the board's programs with the champion of the examples and returns its file.
    ///
    /// # Panics
    /// If it does not build.
    #[must_use]
    pub fn build(&self, program: &str) -> PathBuf {
        self.build_with(program, &[])
    }

    /// As [`build`](Self::build), with environment variables of the build, such as the champion's file.
    ///
    /// # Panics
    /// If it does not build.
    #[must_use]
    pub fn build_with(&self, program: &str, variables: &[(&str, &Path)]) -> PathBuf {
        self.cargo(program, &["--release"], "release", variables)
    }

    /// As [`build`](Self::build), for short decisions: profile `speed`, without the runtime's feature `small-code`.
    ///
    /// # Panics
    /// If it does not build.
    #[must_use]
    pub fn build_fast(&self, program: &str) -> PathBuf {
        let fast = [
            "--profile=speed",
            "--no-default-features",
            "--features=all-operations",
        ];
        self.cargo(program, &fast, "speed", &[])
    }

    fn cargo(
        &self,
        program: &str,
        options: &[&str],
        folder: &str,
        variables: &[(&str, &Path)],
    ) -> PathBuf {
        // Builds for one board share a folder: the second one waits, and must not replace the first's file.
        static BUILDING: LazyLock<BTreeMap<String, Mutex<()>>> = LazyLock::new(|| {
            let boards = Board::all();
            boards
                .map(|board| (board.name.clone(), Mutex::default()))
                .collect()
        });
        let one = &BUILDING[&self.name];
        let _one = one.lock().unwrap_or_else(PoisonError::into_inner);
        let target_dir = repository().join("target/firmware").join(&self.name);
        let mut cargo = Command::new(repository().join("scripts/cargo-for"));
        cargo
            .args([&self.target, "build", "--quiet", "--bin", program])
            .args(options)
            .current_dir(repository().join("firmware-examples").join(&self.name))
            .env("CARGO_TARGET_DIR", &target_dir)
            .envs(variables.iter().copied())
            .env_remove("RUSTFLAGS")
            .env_remove("CARGO_ENCODED_RUSTFLAGS");
        let status = cargo.status().expect("scripts/cargo-for starts");
        assert!(
            status.success(),
            "{program} does not build for {}",
            self.name
        );
        target_dir.join(&self.target).join(folder).join(program)
    }

    /// The emulator with a program, semihosting and no window, ready to be started.
    #[must_use]
    pub fn emulator(&self, program: &Path) -> Command {
        let emulator = &self.emulation().command;
        let mut command = Command::new(&emulator[0]);
        command
            .args(&emulator[1..])
            .args(["-display", "none", "-monitor", "none"])
            .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
            .arg(program)
            .stdin(Stdio::null());
        command
    }

    /// Runs a program to its end; returns exit status and what it printed.
    ///
    /// # Panics
    /// If it hangs.
    #[must_use]
    pub fn run(&self, program: &Path, options: &[String]) -> (Option<i32>, String) {
        let mut command = self.emulator(program);
        command.args(["-serial", "null"]).args(options);
        run(command, &self.name)
    }

    /// The option that loads a file into spare memory.
    #[must_use]
    pub fn load(&self, file: &Path) -> [String; 2] {
        let (file, address) = (file.display(), self.emulation().spare);
        [
            "-device".into(),
            format!("loader,file={file},addr={address:#x},force-raw=on"),
        ]
    }
}

/// Runs an emulator to its end; returns exit status and what the program printed.
///
/// # Panics
/// If it hangs.
fn run(mut command: Command, name: &str) -> (Option<i32>, String) {
    // Semihosting prints to standard error of some versions of QEMU, to standard output of others.
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("output");
    let output = fs::File::create(&file).expect("a file");
    let mut child = command
        .stdout(output.try_clone().expect("a second handle"))
        .stderr(output)
        .spawn()
        .expect("the emulator starts");
    let started = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().expect("a child to wait for") {
            break status;
        }
        if started.elapsed() > WATCHDOG {
            child.kill().expect("a child to end");
            panic!("{name} hangs");
        }
        thread::sleep(Duration::from_millis(10));
    };
    (
        status.code(),
        fs::read_to_string(file).expect("the output is text"),
    )
}

/// Builds the example of a framework for a target and runs it on a machine of QEMU; returns exit status and what it
/// printed. `None` if the compiler or the emulator is missing; says why.
///
/// # Panics
/// If it does not build or hangs, or if something is missing and the environment says that it must be here, by
/// [`REQUIRED`].
#[must_use]
pub fn run_framework(name: &str, target: &str, machine: &str) -> Option<(Option<i32>, String)> {
    let cargo_for = repository().join("scripts/cargo-for");
    let emulator = "qemu-system-arm";
    if !runs(emulator, &["--version"]) || !runs(&cargo_for.to_string_lossy(), &["--check", target])
    {
        skip(
            name,
            &format!("{emulator} or a compiler for {target} is missing"),
        );
        return None;
    }
    let build = repository().join("target/firmware").join(name);
    let status = Command::new(cargo_for)
        .args([target, "build", "--quiet", "--release"])
        .current_dir(repository().join("firmware-examples/frameworks").join(name))
        .env("CARGO_TARGET_DIR", &build)
        .env_remove("RUSTFLAGS")
        .env_remove("CARGO_ENCODED_RUSTFLAGS")
        .status();
    assert!(
        status.expect("scripts/cargo-for starts").success(),
        "{name}"
    );
    let program = build
        .join(target)
        .join("release")
        .join(format!("tpg-{name}"));
    let mut command = Command::new(emulator);
    command
        .args(["-machine", machine, "-display", "none", "-monitor", "none"])
        .args(["-serial", "null", "-semihosting-config"])
        .args(["enable=on,target=native", "-kernel"])
        .arg(program)
        .stdin(Stdio::null());
    Some(run(command, name))
}

impl Deref for Board {
    type Target = footprint::Board;

    fn deref(&self) -> &Self::Target {
        self.0
    }
}
