//! What other users of the machine prepare does no harm: their folders and files are refused, and nothing waits for ever.
#![cfg(feature = "plant")]

mod support;

use std::fs::{self, Permissions};
use std::os::unix::fs::{PermissionsExt as _, chown, symlink};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use support::{Folder, Process, WATCHDOG, policy};
use tpg_runtime::hash::{START_64, fnv1a_64};
use tpg_sim_bridge::RunName;

const HIL: &str = env!("CARGO_BIN_EXE_tpg-hil");
const PLANT: &str = env!("CARGO_BIN_EXE_tpg-plant");
const CONTROLLER: &str = env!("CARGO_BIN_EXE_tpg-controller");
/// A user with no rights to the files of others.
const NOBODY: u32 = 65_534;

/// A controller that joins a run, in a machine whose user has this `XDG_RUNTIME_DIR`.
fn controller(file: &Path, run: &str, runtime: &Path) -> Command {
    let mut command = Command::new(CONTROLLER);
    command
        .arg(file)
        .args(["--run", run, "--timeout-ms", "300"]);
    command.env("XDG_RUNTIME_DIR", runtime);
    command
}

/// A folder for `XDG_RUNTIME_DIR`.
fn runtime_folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    fs::set_permissions(&folder, Permissions::from_mode(0o700)).expect("it is ours");
    folder
}

/// The shared memory of a run that has a plant, found by what appears when it starts.
fn shared_files(run: &str, file: &Path) -> (Process, Vec<PathBuf>) {
    let list = || {
        let files = fs::read_dir("/dev/shm").expect("shared memory").flatten();
        files.map(|file| file.path()).collect::<Vec<_>>()
    };
    let arguments = ["--run", run, "--timeout-ms", "60000", "--episodes", "1"];
    let plant = Process::start(PLANT, file, &arguments);
    let prefix = format!("/dev/shm/{}", prefix(run));
    let start = Instant::now();
    loop {
        let ours = list().into_iter();
        let ours: Vec<_> = ours
            .filter(|path| path.to_string_lossy().starts_with(&prefix))
            .collect();
        // The file of nodes comes first, the plant's messages last.
        if ours.len() >= 3 || (!ours.is_empty() && start.elapsed() > Duration::from_secs(5)) {
            return (plant, ours);
        }
        assert!(start.elapsed() < WATCHDOG, "no file {prefix}*");
        thread::sleep(Duration::from_millis(10));
    }
}

/// First part of the names of a run's shared memory.
fn prefix(run: &str) -> String {
    format!("tpg_{:016x}_", fnv1a_64(START_64, run.as_bytes()))
}

#[test]
fn runs_lie_in_the_users_runtime_folder() {
    let (folder, runtime) = (Folder::new(), runtime_folder());
    let file = folder.file("a.tpg", &policy::cartpole(0));
    let mut command = Command::new(HIL);
    command.arg(&file).args(["--episodes", "1"]);
    command.env("XDG_RUNTIME_DIR", runtime.path());
    let end = Process::spawn(&mut command).end();
    assert!(end.status.success(), "{end:?}");
    let runs = runtime.path().join("tpg-bridge");
    let left: Vec<_> = fs::read_dir(&runs).expect("it was made").collect();
    assert!(left.is_empty(), "{left:?}");
}

/// The attack of an entry that leads elsewhere, in each of the ways that another user can prepare it.
#[test]
fn a_prepared_folder_is_refused_and_nothing_is_made_through_it() {
    let (folder, runtime) = (Folder::new(), runtime_folder());
    let file = folder.file("a.tpg", &policy::cartpole(0));
    let victim = runtime.path().join("victim");
    fs::create_dir(&victim).expect("a folder");
    let base = runtime.path().join("tpg-bridge");

    symlink(&victim, &base).expect("a link");
    let end = Process::spawn(&mut controller(&file, "x", runtime.path())).end();
    end.assert_failure(1, &["cannot use the folder", "symbolic link"]);
    fs::remove_file(&base).expect("a link");

    let planted = victim.join("planted");
    fs::create_dir_all(base.join("x")).expect("a folder");
    symlink(&planted, base.join("x/alive")).expect("a link");
    fs::set_permissions(&base, Permissions::from_mode(0o777)).expect("it is ours");
    let end = Process::spawn(&mut controller(&file, "x", runtime.path())).end();
    end.assert_failure(1, &["cannot use the folder", "mode 777"]);

    // Within a folder that is right, links are not followed either.
    fs::set_permissions(&base, Permissions::from_mode(0o700)).expect("it is ours");
    let end = Process::spawn(&mut controller(&file, "x", runtime.path())).end();
    end.assert_failure(1, &["enter the run's folder"]);
    assert!(!planted.exists());

    if chown(&base, Some(NOBODY), None).is_err() {
        eprintln!("skipped: only root can give a folder away");
        return;
    }
    let end = Process::spawn(&mut controller(&file, "x", runtime.path())).end();
    end.assert_failure(1, &["belongs to user 65534, not to user 0"]);
    assert!(!planted.exists());
}

/// The same attack by another user's own process, on a user without `XDG_RUNTIME_DIR`.
#[test]
fn another_users_folder_in_tmp_is_refused() {
    let folder = Folder::new();
    let file = folder.file("a.tpg", &policy::cartpole(0));
    // A user that nobody has, so that no other test of this machine is in the way.
    let victim = 1_700_000_000 + std::process::id() % 100_000_000;
    let base = PathBuf::from(format!("/tmp/tpg-bridge-{victim}"));
    let planted = folder.file("planted", b"");
    fs::remove_file(&planted).expect("just made");
    let prepare = format!(
        "mkdir -m 777 {0} {0}/x && ln -s {1} {0}/x/alive",
        base.display(),
        planted.display()
    );
    if !as_user(NOBODY, "/bin/sh", &["-c", &prepare]).is_ok_and(|ended| ended) {
        eprintln!("skipped: only root can act as another user (setpriv)");
        return;
    }
    let program = folder.file("tpg-controller", b"");
    fs::copy(CONTROLLER, &program).expect("copied with its permissions");
    let parent = program.parent().expect("a folder");
    fs::set_permissions(parent, Permissions::from_mode(0o755)).expect("it is ours");
    let mut command = Command::new("setpriv");
    command
        .args(set_user(victim))
        .arg(&program)
        .arg(&file)
        .args(["--run", "x", "--timeout-ms", "300"])
        .env_remove("XDG_RUNTIME_DIR");
    let end = Process::spawn(&mut command).end();
    fs::remove_dir_all(&base).expect("root may");
    let owners = format!("belongs to user {NOBODY}, not to user {victim}");
    end.assert_failure(1, &["cannot use the folder", &owners]);
    assert!(!planted.exists());
}

fn set_user(user: u32) -> [String; 3] {
    [
        format!("--reuid={user}"),
        format!("--regid={user}"),
        "--clear-groups".into(),
    ]
}

/// Runs a program as another user, which root may; whether it succeeded.
fn as_user(user: u32, program: &str, arguments: &[&str]) -> std::io::Result<bool> {
    let mut command = Command::new("setpriv");
    command.args(set_user(user)).arg(program).args(arguments);
    Ok(command.output()?.status.success())
}

#[test]
fn shared_memory_is_closed_to_others() {
    let folder = Folder::new();
    let file = folder.file("a.tpg", &policy::cartpole(0));
    let run = RunName::unique().to_string();
    let (plant, files) = shared_files(&run, &file);
    for file in &files {
        let mode = fs::metadata(file)
            .expect("it is there")
            .permissions()
            .mode();
        assert_eq!(mode & 0o077, 0, "{}: mode {mode:o}", file.display());
        let name = file.to_str().expect("UTF-8");
        if let Ok(truncated) = as_user(NOBODY, "truncate", &["-s", "0", name]) {
            assert!(!truncated, "another user truncated {name}");
        }
    }
    let controller = Process::start(CONTROLLER, &file, &["--run", &run]).end();
    assert!(controller.status.success(), "{controller:?}");
    let end = plant.end();
    assert!(end.status.success(), "{end:?}");
}

/// The library waits for ever for a file without content. The process ends all the same.
#[test]
fn a_truncated_file_of_nodes_costs_the_timeout() {
    let folder = Folder::new();
    let file = folder.file("a.tpg", &policy::cartpole(0));
    let run = RunName::unique().to_string();
    let (plant, files) = shared_files(&run, &file);
    let of_nodes = files
        .iter()
        .find(|file| file.to_string_lossy().ends_with("global_mgmt"));
    let of_nodes = of_nodes.expect("the library's file of nodes");
    fs::File::options()
        .write(true)
        .truncate(true)
        .open(of_nodes)
        .expect("it is ours");
    let start = Instant::now();
    let arguments = ["--run", &run, "--timeout-ms", "2500"];
    let end = Process::start(CONTROLLER, &file, &arguments).end();
    end.assert_failure(4, &["within 2500 ms", "choose another --run"]);
    assert!(
        start.elapsed() < Duration::from_secs(20),
        "{:?}",
        start.elapsed()
    );
    plant.signal("INT");
    plant.end().assert_failure(130, &["interrupted"]);
}

#[test]
fn a_pipe_in_the_place_of_shared_memory_is_refused() {
    let folder = Folder::new();
    let file = folder.file("a.tpg", &policy::cartpole(0));
    let run = RunName::unique().to_string();
    let pipe = format!("/dev/shm/{}node.global_mgmt", prefix(&run));
    let made = Command::new("mkfifo").arg(&pipe).status();
    assert!(made.expect("mkfifo").success());
    let arguments = ["--run", &run, "--timeout-ms", "2500"];
    let end = Process::start(CONTROLLER, &file, &arguments).end();
    fs::remove_file(&pipe).expect("it is ours");
    end.assert_failure(1, &[&pipe, "is in the way", "choose another --run"]);
}
