//! Arguments that the bridge's programs share.

#[cfg(feature = "plant")]
use std::path::PathBuf;
use std::time::Duration;

#[cfg(feature = "plant")]
use tpg_tasks::exit_status::Failure;

use crate::error::BridgeError;
use crate::interrupt;
use crate::message::Role;
use crate::note;
#[cfg(feature = "plant")]
use crate::record::RecordPath;
#[cfg(feature = "plant")]
use crate::require::{Needs, Requirement};
use crate::resources::{Place, ResourceArgs};
use crate::run::RunName;
use crate::watchdog::may_end_this_process;

/// How long to wait for the other process.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct TimeoutArgs {
    /// Deadline of every wait for the other process, in milliseconds.
    #[arg(long, value_name = "N", default_value_t = 5_000, value_parser = clap::value_parser!(u64).range(1..=86_400_000))]
    pub timeout_ms: u64,
}

impl TimeoutArgs {
    /// The deadline.
    #[must_use]
    pub const fn timeout(self) -> Duration {
        Duration::from_millis(self.timeout_ms)
    }
}

/// How long to wait for the other process, which may have a model to compile before it appears.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct DeadlineArgs {
    /// Once it is there.
    #[command(flatten)]
    pub timeout: TimeoutArgs,
    /// Deadline for the other process to appear, in milliseconds; by default 120000 where tpg hil starts both, else as
    /// --timeout-ms.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=86_400_000))]
    pub start_timeout_ms: Option<u64>,
}

/// Deadlines of waits for the other process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Deadlines {
    /// For it to appear.
    pub start: Duration,
    /// For each of its answers.
    pub answer: Duration,
}

impl From<Duration> for Deadlines {
    /// The same for both.
    fn from(deadline: Duration) -> Self {
        Deadlines {
            start: deadline,
            answer: deadline,
        }
    }
}

impl DeadlineArgs {
    /// The deadlines.
    #[must_use]
    pub fn deadlines(self) -> Deadlines {
        let answer = self.timeout.timeout();
        Deadlines {
            start: self.start_timeout_ms.map_or(answer, Duration::from_millis),
            answer,
        }
    }
}

/// Whether and how a plant keeps to real time.
#[cfg(feature = "plant")]
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct PaceArgs {
    /// Run in real time: an action must answer within the policy's control period.
    #[arg(long)]
    pub realtime: bool,
    /// Misses in a row that hold the last action; from the next one on the safe action is applied.
    #[arg(long, value_name = "N", default_value_t = 5, requires = "realtime")]
    pub max_misses: u32,
    /// Go on with further episodes until this much time has passed; the last one is finished.
    #[arg(long, value_name = "N", requires = "realtime", conflicts_with = "episodes", value_parser = clap::value_parser!(u64).range(1..=86_400))]
    pub seconds: Option<u64>,
}

/// Whether the controller is a board.
#[cfg(feature = "plant")]
#[derive(Debug, Clone, clap::Args)]
pub struct ControllerArgs {
    /// The controller is a board, or any program that speaks its protocol: serial:PATH of its tty (serial:PATH@RATE, by
    /// default 115200 bits per second) or of a Unix socket, or udp:HOST:PORT.
    #[arg(long, value_name = "serial:PATH|udp:HOST:PORT")]
    pub controller: Option<crate::serial::SerialPath>,
    /// Take a controller that runs another policy than FILE.tpg, or none at all.
    #[arg(long, requires = "controller")]
    pub any_controller: bool,
}

/// What a loop has to fulfil, and what it leaves behind.
#[cfg(feature = "plant")]
#[derive(Debug, Clone, clap::Args)]
pub struct BenchArgs {
    /// Fail with status 5 unless this holds: 'mean >= 3000', 'misses == 0', 'p99 < 2ms'; may be repeated. An unknown
    /// quantity lists all.
    #[arg(long, value_name = "REQUIREMENT")]
    pub require: Vec<Requirement>,
    /// Write the result to this file, as JUnit XML.
    #[arg(long, value_name = "FILE.xml")]
    pub junit: Option<PathBuf>,
    /// Record every step to this file.
    #[arg(long, value_name = "FILE.mcap|FILE.csv")]
    pub record: Option<RecordPath>,
    /// Write the distribution of round trips to this file, as HdrHistogram's percentiles in microseconds.
    #[arg(long, value_name = "FILE")]
    pub latency_histogram: Option<PathBuf>,
}

#[cfg(feature = "plant")]
impl BenchArgs {
    /// Checks that the loop has what is required.
    ///
    /// # Errors
    /// A quantity of real time without real time, or of a line without one.
    pub fn check(&self, pace: &PaceArgs, controller: &ControllerArgs) -> Result<(), Failure> {
        for requirement in &self.require {
            let missing = match requirement.needs() {
                Needs::RealTime if !pace.realtime => "--realtime",
                Needs::Line if controller.controller.is_none() => "--controller",
                _ => continue,
            };
            return Err(Failure::usage(anyhow::anyhow!(
                "bad --require: {requirement} is about something that this loop does not have: add {missing}"
            )));
        }
        Ok(())
    }
}

/// How a process of the loop behaves.
#[derive(Debug, Clone, clap::Args)]
pub struct ProcessArgs {
    /// How long to wait.
    #[command(flatten)]
    pub deadlines: DeadlineArgs,
    /// What to ask of the system.
    #[command(flatten)]
    pub resources: ResourceArgs,
    /// Say nothing but errors, and end when standard input closes: for `tpg-hil`, which starts both.
    #[arg(long)]
    pub attached: bool,
}

/// Which run to join, and how.
#[derive(Debug, Clone, clap::Args)]
pub struct LinkArgs {
    /// Name of the run; plant and controller find each other by it.
    #[arg(long, value_name = "NAME")]
    pub run: RunName,
    /// How this process behaves.
    #[command(flatten)]
    pub process: ProcessArgs,
}

impl ProcessArgs {
    /// Prepares the process to be asked to stop, and to be ended where shared memory hangs; `place` says which of the
    /// processors of `--cpu` is its.
    ///
    /// # Errors
    /// Those of [`interrupt::install`] and [`ResourceArgs::apply`].
    pub fn prepare(&self, place: Place) -> Result<(), BridgeError> {
        may_end_this_process();
        interrupt::install()?;
        if self.attached {
            interrupt::follow_standard_input();
        }
        // After the threads above, which keep the usual priority.
        self.resources.apply(place)
    }

    /// Tells the user which process was found, unless `tpg-hil` started this one.
    pub fn announce(&self, peer: Role, pid: u32) {
        if !self.attached {
            note(format_args!("connected to {peer}, process {pid}"));
        }
    }
}
