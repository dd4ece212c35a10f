//! Arguments that the bridge's programs share.

use std::time::Duration;

use crate::error::BridgeError;
use crate::interrupt;
use crate::message::Role;
use crate::note;
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
    /// The controller is a board: serial:PATH of its tty (serial:PATH@RATE, by default 115200 bits per second), or of a
    /// Unix socket.
    #[arg(long, value_name = "serial:PATH")]
    pub controller: Option<crate::serial::SerialPath>,
}

/// Which run to join, and how.
#[derive(Debug, Clone, clap::Args)]
pub struct LinkArgs {
    /// Name of the run; plant and controller find each other by it.
    #[arg(long, value_name = "NAME")]
    pub run: RunName,
    /// How long to wait.
    #[command(flatten)]
    pub deadlines: DeadlineArgs,
    /// Say nothing but errors, and end when standard input closes: for `tpg-hil`, which starts both.
    #[arg(long)]
    pub attached: bool,
}

impl LinkArgs {
    /// Prepares the process to be asked to stop, and to be ended where shared memory hangs.
    ///
    /// # Errors
    /// Those of [`interrupt::install`].
    pub fn prepare(&self) -> Result<(), BridgeError> {
        may_end_this_process();
        interrupt::install()?;
        if self.attached {
            interrupt::follow_standard_input();
        }
        Ok(())
    }

    /// Tells the user which process was found, unless `tpg-hil` started this one.
    pub fn announce(&self, peer: Role, pid: u32) {
        if !self.attached {
            note(format_args!("connected to {peer}, process {pid}"));
        }
    }
}
