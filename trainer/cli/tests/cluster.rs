//! `tpg train` as the ranks of an MPI job: `cargo test -p tpg --features mpi --test cluster`. Needs `mpirun` of OpenMPI.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use tpg_trainer::cluster::{Member, join};

/// A run of seconds whose teams differ in the length of their episodes.
const SMALL: [&str; 8] = [
    "cartpole-sr-sm",
    "--seed",
    "3",
    "--set",
    "evolution.population=60",
    "--set",
    "evolution.children=60",
    "--checkpoint-every=0",
];

fn mpirun(ranks: usize) -> Command {
    let mut command = Command::new("mpirun");
    command.args(["--oversubscribe", "--allow-run-as-root", "-n"]);
    command.arg(ranks.to_string());
    command
}

fn tpg(ranks: usize) -> Command {
    let mut command = mpirun(ranks);
    command.arg(env!("CARGO_BIN_EXE_tpg"));
    command
}

fn output(command: &mut Command) -> Output {
    let output = command.output().expect("the program starts");
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {error}");
    output
}

/// What a run left, without the times: champion, champions, and the log without its seconds.
fn left(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files = vec![folder.join("champion.tpg")];
    let champions = fs::read_dir(folder.join("champions")).expect("a folder of champions");
    files.extend(champions.map(|entry| entry.expect("an entry").path()));
    files.sort();
    let name = |path: &Path| path.strip_prefix(folder).expect("inside").to_owned();
    let mut left: Vec<(PathBuf, Vec<u8>)> = files
        .iter()
        .map(|path| (name(path), fs::read(path).expect("readable")))
        .collect();
    let log = fs::read_to_string(folder.join("log.csv")).expect("a log");
    let header: Vec<&str> = log.lines().next().expect("a header").split(',').collect();
    let seconds = header.iter().position(|column| *column == "seconds");
    let seconds = seconds.expect("a column of seconds");
    let without = |line: &str| {
        let mut cells: Vec<&str> = line.split(',').collect();
        cells.remove(seconds);
        cells.join(",") + "\n"
    };
    left.push((
        "log.csv".into(),
        log.lines().map(without).collect::<String>().into(),
    ));
    left
}

/// Trains with the threads of one process.
fn alone(folder: &Path, threads: &str, arguments: &[&str]) -> Vec<(PathBuf, Vec<u8>)> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tpg"));
    command.arg("train").args(arguments);
    command.args(["--threads", threads, "--out"]).arg(folder);
    output(&mut command);
    left(folder)
}

fn assert_same_with_ranks(arguments: &[&str]) {
    let parent = tempfile::tempdir().expect("a temporary folder");
    let one = alone(&parent.path().join("1"), "1", arguments);
    let two = alone(&parent.path().join("2"), "2", arguments);
    assert!(one == two, "{arguments:?}: two threads differ from one");
    for ranks in [2, 3, 4] {
        let folder = parent.path().join(format!("ranks-{ranks}"));
        let mut command = tpg(ranks);
        command
            .arg("train")
            .args(arguments)
            .arg("--out")
            .arg(&folder);
        output(&mut command);
        assert!(
            one == left(&folder),
            "{arguments:?}: {ranks} ranks differ from one thread"
        );
    }
}

#[test]
fn any_number_of_ranks_gives_the_bytes_of_one_thread() {
    assert_same_with_ranks(&[&SMALL[..], &["--generations", "12"]].concat());
}

/// Plain evolution on physics, in whose episodes robots fall early or late.
#[cfg(feature = "mujoco")]
#[test]
fn a_plain_champion_of_hopper_is_the_same_with_ranks() {
    assert_same_with_ranks(&[
        "hopper-sr-sm-b23",
        "--seed=1",
        "--generations=3",
        "--set=evolution.population=20",
        "--set=evolution.children=20",
    ]);
}

/// Where a front end learns from what all ranks see, constants are tuned, and champions race.
#[cfg(feature = "mujoco")]
#[test]
fn a_tuned_champion_of_hopper_is_the_same_with_ranks() {
    assert_same_with_ranks(&[
        "hopper-champion-b23",
        "--seed=1",
        "--generations=3",
        "--set=evolution.population=12",
        "--set=evolution.children=12",
    ]);
}

/// Waits for the end, at most 20 s, and says how long it took after `cause`.
fn wait(child: &mut Child, cause: &str) -> std::process::ExitStatus {
    let started = Instant::now();
    while started.elapsed() < Duration::from_secs(20) {
        if let Some(status) = child.try_wait().expect("it can be waited for") {
            let seconds = started.elapsed().as_secs_f64();
            println!("{cause}: the job ended after {seconds:.2} s, {status}");
            return status;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    child.kill().expect("it can be killed");
    panic!("{cause}: the job goes on");
}

fn signal(process: u32, name: &str) {
    let mut kill = Command::new("kill");
    kill.args([&format!("-{name}"), &process.to_string()]);
    output(&mut kill);
}

/// Processes of the job's ranks, in any order: the children of `mpirun`.
fn ranks_of(mpirun: &Child) -> Vec<u32> {
    let mut pgrep = Command::new("ps");
    pgrep.args(["-o", "pid=", "--ppid", &mpirun.id().to_string()]);
    let text = String::from_utf8(output(&mut pgrep).stdout).expect("text");
    text.split_whitespace()
        .filter_map(|pid| pid.parse().ok())
        .collect()
}

/// Starts a long run and waits until it has made some generations.
fn begin(folder: &Path, ranks: usize) -> Child {
    let mut command = tpg(ranks);
    command
        .arg("train")
        .args(SMALL)
        .args(["--generations", "100000", "--out"])
        .arg(folder);
    let child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn();
    let child = child.expect("mpirun starts");
    let started = Instant::now();
    let rows = || fs::read_to_string(folder.join("log.csv")).map_or(0, |log| log.lines().count());
    while rows() < 4 {
        assert!(
            started.elapsed() < Duration::from_secs(60),
            "the run makes no generations"
        );
        std::thread::sleep(Duration::from_millis(10));
    }
    child
}

/// Goes on with another number of ranks to a few generations more, and compares with the undisturbed run.
fn assert_resumes(folder: &Path, ranks: usize) {
    let rows = fs::read_to_string(folder.join("log.csv"))
        .expect("a log")
        .lines()
        .count();
    let generations = (rows + 3).to_string();
    let mut command = tpg(ranks);
    command
        .args(["train", "--generations", &generations, "--resume"])
        .arg(folder);
    output(&mut command);
    let parent = tempfile::tempdir().expect("a temporary folder");
    let undisturbed = [&SMALL[..], &["--generations", &generations]].concat();
    assert!(left(folder) == alone(&parent.path().join("undisturbed"), "2", &undisturbed));
}

#[test]
fn a_killed_rank_ends_the_job_and_another_number_of_ranks_goes_on() {
    let parent = tempfile::tempdir().expect("a temporary folder");
    let folder = parent.path().join("run");
    let mut child = begin(&folder, 3);
    let last = ranks_of(&child).into_iter().max().expect("ranks");
    signal(last, "KILL");
    let status = wait(&mut child, "SIGKILL to a rank");
    assert!(!status.success(), "{status}");
    assert_resumes(&folder, 2);
}

#[test]
fn signals_to_the_launcher_leave_a_checkpoint() {
    for name in ["TERM", "USR1"] {
        let parent = tempfile::tempdir().expect("a temporary folder");
        let folder = parent.path().join("run");
        let mut child = begin(&folder, 3);
        signal(child.id(), name);
        let status = wait(&mut child, &format!("SIG{name} to mpirun"));
        assert!(!status.success(), "{name}: {status}");
        assert_resumes(&folder, 4);
    }
}

#[test]
fn a_rank_that_panics_ends_the_job_with_its_message() {
    let mut command = mpirun(3);
    command.arg(std::env::current_exe().expect("this program"));
    command.args(["--exact", "rank_that_panics", "--ignored", "--nocapture"]);
    let mut child = command
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("mpirun starts");
    let status = wait(&mut child, "start of a job whose rank panics");
    assert_eq!(status.code(), Some(101));
    let error = child.wait_with_output().expect("what it wrote").stderr;
    let error = String::from_utf8_lossy(&error).into_owned();
    assert!(error.contains("the last rank panics"), "{error}");
}

/// A rank of the test above.
#[test]
#[ignore = "a process of another test"]
fn rank_that_panics() {
    let member = join().expect("MPI starts");
    if let Member::Worker(_) = &member
        && std::env::var("OMPI_COMM_WORLD_RANK").as_deref() == Ok("2")
    {
        panic!("the last rank panics");
    }
    std::thread::sleep(Duration::from_secs(60));
    drop(member);
}

#[test]
fn threads_are_refused_and_nothing_is_left() {
    let parent = tempfile::tempdir().expect("a temporary folder");
    let mut command = tpg(2);
    command
        .arg("train")
        .args(SMALL)
        .args(["--threads", "2", "--out"])
        .arg(parent.path().join("run"));
    let output = command.output().expect("mpirun starts");
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{error}");
    assert!(error.contains("--threads"), "{error}");
}

#[test]
fn processes_share_the_runs_of_an_experiment() {
    let parent = tempfile::tempdir().expect("a temporary folder");
    let file = parent.path().join("small.toml");
    let text = "name = \"small\"\ntasks = [\"cartpole\"]\nvariants = [\"sl\", \"sr\"]\nrepeats = 3\n\
        budget = { generations = 2 }\ntest-episodes = 4\n[set]\nevolution.population = 20\nevolution.children = 20\n";
    fs::write(&file, text).expect("written");
    let mut command = tpg(3);
    command
        .args(["experiment", "run", "--jobs", "1"])
        .arg(&file);
    let error = String::from_utf8(output(&mut command).stderr).expect("text");
    let done = error
        .lines()
        .filter(|line| line.contains(" training "))
        .count();
    assert_eq!(done, 6, "{error}");
    let rows = fs::read_dir(parent.path().join("small/rows")).expect("rows");
    assert_eq!(rows.count(), 6);
}
