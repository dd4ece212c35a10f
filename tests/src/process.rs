//! The project's own commands, built once and run as a user would run them.

use std::ffi::OsStr;
use std::io::{Read, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::OnceLock;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::firmware;

/// After this long a command is taken to hang; far above what any of them needs on a busy machine.
const WATCHDOG: Duration = Duration::from_secs(300);

/// Path of one of the workspace's commands, built in the profile of the running test.
///
/// # Panics
/// If the command cannot be built.
#[must_use]
pub fn command_path(name: &str) -> PathBuf {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let exe = std::env::current_exe().expect("the test's own path");
        // target/<profile>/deps/<test>
        let folder = exe
            .ancestors()
            .nth(2)
            .expect("a profile's folder")
            .to_owned();
        let mut build = Command::new(env!("CARGO"));
        // `--examples` counts the features of dev-dependencies, as `cargo test` does: what it compiled is used again.
        build.args(["build", "--quiet", "--workspace", "--bins", "--examples"]);
        build.current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
        if folder.ends_with("release") {
            build.arg("--release");
        }
        if cfg!(not(feature = "mujoco")) {
            build.args([
                "--no-default-features",
                "--features",
                "tpg-sim-bridge/plant",
            ]);
        }
        assert!(
            build.status().expect("cargo runs").success(),
            "the commands do not build"
        );
        folder
    });
    folder.join(name)
}

/// Path of the runtime's library for C, built in the profile of the running test.
///
/// # Panics
/// If the library cannot be built.
#[must_use]
pub fn static_library() -> PathBuf {
    let exe = std::env::current_exe().expect("the test's own path");
    let folder = exe.ancestors().nth(2).expect("a profile's folder");
    let mut build = Command::new(env!("CARGO"));
    build.args(["build", "--quiet", "--package", "tpg-runtime-c"]);
    build.current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    if folder.ends_with("release") {
        build.arg("--release");
    }
    let built = build.status().expect("cargo runs").success();
    assert!(built, "the library for C does not build");
    folder.join("libtpg_runtime_c.a")
}

/// What makes a command that runs a program under Valgrind and fails with status 99 if that finds memory misused or lost; says why if
/// Valgrind is missing.
///
/// # Panics
/// If it is missing and the environment says that it must not be, by [`REQUIRED`](crate::firmware::REQUIRED).
#[must_use]
pub fn memory_checker() -> Option<impl Fn(&Path) -> Command> {
    if !firmware::runs("valgrind", &["--version"]) {
        firmware::skip("memory", "valgrind is missing: apt-get install valgrind");
        return None;
    }
    Some(|program: &Path| {
        let mut command = Command::new("valgrind");
        command.args(["--quiet", "--error-exitcode=99", "--leak-check=full"]);
        command.arg(program);
        command
    })
}

/// Runs a program with text on its standard input and returns its standard output.
///
/// # Panics
/// If the program cannot be started, fails, or prints something else than text.
#[must_use]
pub fn pipe(mut command: Command, input: &str) -> String {
    let mut child = command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("a program that starts");
    let mut stdin = child.stdin.take().expect("its input");
    let input = input.to_owned();
    // Beside the reader: neither side waits for the other with a full pipe. A program need not read its input.
    let writer = std::thread::spawn(move || stdin.write_all(input.as_bytes()));
    let output = child.wait_with_output().expect("its output");
    let _ = writer.join().expect("a writer");
    let text = String::from_utf8(output.stdout).expect("text");
    assert!(output.status.success(), "{}: {text}", output.status);
    text
}

/// Starts `tpg` with its output captured.
///
/// # Panics
/// If it cannot be started.
pub fn start<S: AsRef<OsStr>>(args: impl IntoIterator<Item = S>) -> Child {
    Command::new(command_path("tpg"))
        .args(args)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("tpg starts")
}

/// Waits for a command, which the watchdog ends if it hangs.
///
/// # Panics
/// If it hangs.
#[must_use]
pub fn finish(mut child: Child) -> Output {
    let started = Instant::now();
    // Read while it runs: a pipe holds 64 KiB, and who fills it waits.
    let stdout = child.stdout.take().map(read);
    let stderr = child.stderr.take().map(read);
    let status = loop {
        if let Some(status) = child.try_wait().expect("a child to wait for") {
            break status;
        }
        if started.elapsed() > WATCHDOG {
            child.kill().expect("a child to end");
            panic!("the command hangs");
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    let whole = |reader: Option<JoinHandle<Vec<u8>>>| {
        reader.map_or_else(Vec::new, |reader| reader.join().expect("its output"))
    };
    Output {
        status,
        stdout: whole(stdout),
        stderr: whole(stderr),
    }
}

fn read(mut pipe: impl Read + Send + 'static) -> JoinHandle<Vec<u8>> {
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        pipe.read_to_end(&mut bytes).expect("a pipe");
        bytes
    })
}

/// Runs `tpg` to its end.
#[must_use]
pub fn tpg<S: AsRef<OsStr>>(args: impl IntoIterator<Item = S>) -> Output {
    finish(start(args))
}

/// Runs `tpg`, which must succeed.
///
/// # Panics
/// If it fails.
pub fn tpg_ok<S: AsRef<OsStr> + std::fmt::Debug>(args: &[S]) -> Output {
    let output = tpg(args);
    assert_eq!(
        output.status.code(),
        Some(0),
        "{args:?}: {}",
        stderr(&output)
    );
    output
}

/// Runs `tpg`, which must succeed, and reads its JSON.
///
/// # Panics
/// If it fails or prints something else.
#[must_use]
pub fn tpg_json(args: &[&str]) -> Value {
    let output = tpg_ok(args);
    serde_json::from_slice(&output.stdout).expect("one JSON object")
}

/// What a command wrote to standard error.
#[must_use]
pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A path as text, for arguments.
///
/// # Panics
/// If the path is no Unicode.
#[must_use]
pub fn text(path: &Path) -> &str {
    path.to_str().expect("a Unicode path")
}
