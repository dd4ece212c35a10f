//! `tpg hil`: both processes of a loop as children, watched until both have ended.

use std::env;
use std::ffi::OsString;
use std::io::{self, Read as _};
use std::os::unix::process::ExitStatusExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context as _, anyhow};
use clap::Parser;
use tpg_tasks::console::print;
use tpg_tasks::exit_status::{Failure, Status};
use tpg_tasks::score::{ScoreArgs, Setup};

use crate::args::{BenchArgs, ControllerArgs, DeadlineArgs, PaceArgs};
use crate::interrupt;
use crate::junit;
use crate::outcome::failure;
use crate::resources::ResourceArgs;
use crate::run::{self, RunName};

/// Time for a process that this one started to appear, in milliseconds. Its end is noticed at once, so a long time costs
/// nothing, and models with many meshes compile for long.
const START_TIMEOUT_MS: u64 = 120_000;
const PLANT: &str = "tpg-plant";
const CONTROLLER: &str = "tpg-controller";
/// Time between two looks at the children.
const LOOK_INTERVAL: Duration = Duration::from_millis(5);
/// Time for a child to end after the other one has failed, and again after it was asked to end.
const GRACE: Duration = Duration::from_secs(1);

/// Score a policy in another process than the simulator.
///
/// Starts tpg-plant and tpg-controller, which run the episodes of `tpg eval` over shared memory, in lock-step or in
/// real time, and reports what they returned and how long the round trips took.
#[derive(Debug, Parser)]
#[command(
    name = "tpg-hil",
    bin_name = "tpg hil",
    version,
    after_help = Status::help(
        "Examples:\n  \
         tpg hil champion.tpg --episodes 5 --json\n  \
         tpg hil champion.tpg --realtime --seconds 60 --disturb delay:1\n  \
         tpg hil champion.tpg --realtime --require 'misses == 0' --require 'p99 < 2ms' --junit result.xml\n  \
         tpg hil champion.tpg --record loop.mcap"
    )
)]
pub struct HilArgs {
    /// What to score.
    #[command(flatten)]
    score: ScoreArgs,
    /// Lock-step or real time; the plant gets these arguments too.
    #[command(flatten)]
    pace: PaceArgs,
    /// Whether the controller is a board.
    #[command(flatten)]
    controller: ControllerArgs,
    /// What the loop has to fulfil, and what it leaves behind; the plant does that.
    #[command(flatten)]
    bench: BenchArgs,
    /// What both processes ask of the system.
    #[command(flatten)]
    resources: ResourceArgs,
    /// How long to wait.
    #[command(flatten)]
    deadlines: DeadlineArgs,
}

impl HilArgs {
    /// Finds whatever is wrong with the arguments, before anything is started.
    ///
    /// # Errors
    /// A [`Failure`] with its status.
    pub fn check(&self) -> Result<(), Failure> {
        self.setup().map(|_| ())
    }

    fn setup(&self) -> Result<Setup, Failure> {
        self.bench.check(&self.pace, &self.controller)?;
        self.resources.check().map_err(failure)?;
        let setup = self.score.clone().resolve()?;
        setup.arena()?;
        Ok(setup)
    }
}

/// Runs the loop and prints what came of it; `forwarded` are the arguments as they were given, which the plant
/// understands too.
///
/// # Errors
/// A [`Failure`] with the status of the process that failed first.
pub fn run(args: &HilArgs, forwarded: &[OsString]) -> Result<Status, Failure> {
    interrupt::install().map_err(failure)?;
    let (status, text) = run_loop(args, forwarded)?;
    print(text.trim_end())?;
    Ok(status)
}

/// Runs the loop; with which status it ended, and what the plant printed.
pub(crate) fn run_loop(
    args: &HilArgs,
    forwarded: &[OsString],
) -> Result<(Status, String), Failure> {
    let setup = args.setup()?;
    let ended = run_processes(args, &setup, forwarded);
    if let (Err(failure), Some(path)) = (&ended, &args.bench.junit) {
        junit::write_broken(path, setup.file.display().to_string(), failure)?;
    }
    ended
}

fn run_processes(
    args: &HilArgs,
    setup: &Setup,
    forwarded: &[OsString],
) -> Result<(Status, String), Failure> {
    let [plant_path, controller_path] = [sibling(PLANT)?, sibling(CONTROLLER)?];
    let name = RunName::unique().to_string();
    let start_timeout_ms = args.deadlines.start_timeout_ms.unwrap_or(START_TIMEOUT_MS);
    let start_timeout_ms = start_timeout_ms.to_string();
    let mut plant = Part::start(PLANT, &plant_path, |command| {
        command.args(["--run", &name, "--attached"]);
        if args.deadlines.start_timeout_ms.is_none() {
            command.args(["--start-timeout-ms", &start_timeout_ms]);
        }
        command.args(forwarded).stdout(Stdio::piped());
    })?;
    let start_controller = || {
        Part::start(CONTROLLER, &controller_path, |command| {
            let timeout_ms = args.deadlines.timeout.timeout_ms.to_string();
            command
                .args([
                    "--run",
                    &name,
                    "--attached",
                    "--timeout-ms",
                    &timeout_ms,
                    "--start-timeout-ms",
                    &start_timeout_ms,
                ])
                .args(args.resources.to_arguments())
                .arg("--")
                .arg(&setup.file)
                .stdout(Stdio::null());
        })
    };
    // A board is there already.
    let mut controller = match args.controller.controller {
        Some(_) => None,
        None => Some(start_controller()?),
    };
    let output = plant.child.stdout.take();
    // Read all along, so that the plant never waits for room in the pipe.
    let reader = thread::spawn(move || {
        let mut text = Vec::new();
        output.map_or(Ok(0), |mut pipe| pipe.read_to_end(&mut text))?;
        Ok::<_, io::Error>(text)
    });
    let timeout = args.deadlines.timeout.timeout();
    let watched = watch(&mut plant, controller.as_mut(), timeout);
    let ended = plant.ended;
    let controller_killed = controller.as_ref().is_some_and(|part| part.killed);
    if plant.killed || controller_killed || watched.is_err() {
        drop((plant, controller));
        run::sweep();
    }
    watched?;
    let text = reader
        .join()
        .map_err(|_| anyhow!("reader of the plant's output panicked"))??;
    let unmet = ended.is_some_and(|(status, _)| is_unmet(status));
    let status = if unmet { Status::Unmet } else { Status::Fine };
    Ok((status, String::from_utf8_lossy(&text).into_owned()))
}

/// Whether a plant ran the loop to its end, and a requirement does not hold.
fn is_unmet(status: ExitStatus) -> bool {
    status.code() == Some(Status::Unmet.code().into())
}

/// A child process, which does not outlive this value.
struct Part {
    name: &'static str,
    child: Child,
    ended: Option<(ExitStatus, Instant)>,
    killed: bool,
}

impl Part {
    fn start(
        name: &'static str,
        path: &Path,
        prepare: impl FnOnce(&mut Command),
    ) -> Result<Self, Failure> {
        let mut command = Command::new(path);
        // The pipe closes when this process ends, in whatever way, and the child ends with it.
        command.stdin(Stdio::piped());
        prepare(&mut command);
        let child = command
            .spawn()
            .with_context(|| format!("cannot start {}", path.display()))
            .map_err(Failure::peer)?;
        Ok(Part {
            name,
            child,
            ended: None,
            killed: false,
        })
    }

    /// Looks whether the child has ended.
    fn look(&mut self) -> io::Result<()> {
        if self.ended.is_none() {
            self.ended = self
                .child
                .try_wait()?
                .map(|status| (status, Instant::now()));
        }
        Ok(())
    }

    /// Asks the child to end.
    fn stop(&mut self) {
        drop(self.child.stdin.take());
    }

    fn kill(&mut self) -> io::Result<()> {
        if self.ended.is_none() {
            self.child.kill()?;
            self.ended = Some((self.child.wait()?, Instant::now()));
            self.killed = true;
        }
        Ok(())
    }

    /// Why the loop failed, if this child failed by itself.
    fn failure(&self) -> Option<(Instant, Failure)> {
        let (status, at) = self.ended.filter(|_| !self.killed)?;
        if status.success() || is_unmet(status) {
            return None;
        }
        let code = status.code().and_then(|code| u8::try_from(code).ok());
        let error = anyhow!(
            "loop broke off: {} (process {}) ended with {status}{}",
            self.name,
            self.child.id(),
            reason(status)
        );
        // A code that is no status is a panic's; without a code, a signal ended the child.
        let status = code.map_or(Status::Peer, |code| {
            Status::from_code(code).unwrap_or(Status::OurFault)
        });
        Some((at, Failure::new(status, error)))
    }
}

/// What a signal says of the reason.
fn reason(status: ExitStatus) -> &'static str {
    // There was room when the loop began, but another process took it before this one wrote there.
    match status.signal() {
        Some(nix::libc::SIGBUS) => ": shared memory ran out; free some in /dev/shm, or enlarge it",
        _ => "",
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        // A child that cannot be killed is left to the system.
        let _ = self.kill();
    }
}

/// A program that lies beside this one.
fn sibling(name: &str) -> Result<PathBuf, Failure> {
    let file = format!("{name}{}", env::consts::EXE_SUFFIX);
    let path = env::current_exe()?.with_file_name(file);
    if path.is_file() {
        Ok(path)
    } else {
        Err(Failure::peer(anyhow!(
            "no program {}: it must lie beside tpg-hil; build it with `cargo build -p tpg-sim-bridge`",
            path.display()
        )))
    }
}

/// Waits until all have ended; kills the one that does not follow the other in time.
///
/// Where none has failed, that is as long as any other wait for a process: a busy machine costs no loop that was run to its end.
fn watch(
    plant: &mut Part,
    controller: Option<&mut Part>,
    timeout: Duration,
) -> Result<(), Failure> {
    let mut parts: Vec<&mut Part> = [Some(plant), controller].into_iter().flatten().collect();
    let mut interrupted = None;
    loop {
        for part in &mut parts {
            part.look()?;
        }
        let ends: Vec<_> = parts.iter().map(|p| p.ended.map(|(_, at)| at)).collect();
        if ends.iter().all(Option::is_some) {
            break;
        }
        if interrupt::requested() {
            interrupted.get_or_insert_with(Instant::now);
        }
        // Where one has failed, the other has the time to say what it saw before it is stopped.
        let waited = ends.into_iter().flatten().min().map(|end| end.elapsed());
        let failed = parts.iter().any(|part| part.failure().is_some());
        let grace = if failed { GRACE } else { timeout.max(GRACE) };
        if interrupted.is_some() || waited.is_some_and(|waited| waited >= grace) {
            parts.iter_mut().for_each(|part| part.stop());
        }
        let overdue = waited.is_some_and(|waited| waited >= grace + GRACE)
            || interrupted.is_some_and(|since: Instant| since.elapsed() >= GRACE);
        if overdue {
            for part in &mut parts {
                part.kill()?;
            }
        }
        thread::sleep(LOOK_INTERVAL);
    }
    if interrupt::requested() {
        return Err(Failure::new(Status::Interrupted, anyhow!("interrupted")));
    }
    let failures = parts.iter().filter_map(|part| part.failure());
    match failures.min_by_key(|(at, _)| *at) {
        Some((_, failure)) => Err(failure),
        None if parts[0].killed => Err(Failure::peer(anyhow!("loop broke off: {PLANT} stalled"))),
        None => Ok(()),
    }
}
