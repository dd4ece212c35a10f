//! What can go wrong between two processes.

use std::error::Error;

use crate::Status;
use crate::message::Role;

/// Why a loop could not be joined, or broke off.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BridgeError {
    /// The name of a run cannot be used.
    #[error(
        "{name:?} is not a run name: use 1 to 64 letters, digits, hyphens, underscores or dots"
    )]
    RunName {
        /// The name.
        name: String,
    },
    /// The policy has more inputs or outputs than a message holds.
    #[error("policy has {got} {what}, a message of the bridge holds at most {limit}")]
    TooLarge {
        /// Inputs or outputs.
        what: &'static str,
        /// What the policy has.
        got: usize,
        /// What fits.
        limit: usize,
    },
    /// The policy does not say how often it decides.
    #[error("policy has no control period, so it cannot run in real time: leave out --realtime")]
    NoPeriod,
    /// The policy needs more state than the controller has.
    #[error("controller cannot hold the policy")]
    Capacity(#[from] tpg_runtime::CapacityError),
    /// The shared memory of this machine is too small or not accessible.
    #[error("{place} has no {needed} bytes of shared memory left: free some, or enlarge it")]
    NoSpace {
        /// Where the shared memory lies.
        place: &'static str,
        /// Bytes that are needed.
        needed: usize,
        /// What the system said.
        source: std::io::Error,
    },
    /// The folder of the bridge's runs is not this user's alone.
    #[error(
        "cannot use the folder {path}: {problem}; remove it, or set XDG_RUNTIME_DIR to a folder of your own with mode 700"
    )]
    Folder {
        /// The folder.
        path: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A file has the name of the run's shared memory, but is not this user's, or no memory.
    #[error(
        "{path} is in the way, which this run did not make: remove it, or choose another --run"
    )]
    NotOurs {
        /// The file.
        path: String,
    },
    /// iceoryx2 failed.
    #[error("shared memory failed to {action}")]
    Transport {
        /// What it was to do.
        action: &'static str,
        /// What it said.
        source: Box<dyn Error + Send + Sync>,
    },
    /// There is such a process in this run already.
    #[error("run {run} has a {role} already: choose another --run, or end that process")]
    Taken {
        /// The run.
        run: String,
        /// Which process.
        role: Role,
    },
    /// The other process did not appear.
    #[error(
        "no {peer} joined run {run} within {waited_ms} ms: start `tpg-{peer} FILE.tpg --run {run}`, check --run, or, where \
         its model takes long to compile, wait longer by --start-timeout-ms"
    )]
    NotConnected {
        /// Who was waited for.
        peer: Role,
        /// The run.
        run: String,
        /// For how long.
        waited_ms: u128,
    },
    /// The other process exchanges other messages, or belongs to another program.
    #[error(
        "{peer} of run {run} uses other messages than this program: use programs of the same build"
    )]
    Foreign {
        /// Who.
        peer: Role,
        /// The run.
        run: String,
        /// What iceoryx2 said.
        source: Box<dyn Error + Send + Sync>,
    },
    /// The other process runs another policy or build.
    #[error("{peer} of run {run} does not match: {difference}; {advice}")]
    Mismatch {
        /// Who.
        peer: Role,
        /// The run.
        run: String,
        /// What differs, with both values.
        difference: String,
        /// What to do.
        advice: &'static str,
    },
    /// The other process was killed or crashed.
    #[error("{peer} died (process {pid}): it was killed or crashed")]
    Died {
        /// Who.
        peer: Role,
        /// Its process.
        pid: u32,
    },
    /// The other process has left the loop.
    #[error("{peer} is gone (process {pid}): it ended before the loop did, see its own message")]
    Left {
        /// Who.
        peer: Role,
        /// Its process.
        pid: u32,
    },
    /// The other process lives but does not answer.
    #[error("{peer} is alive but silent for {waited_ms} ms (process {pid}): stopped or stalled?")]
    Silent {
        /// Who.
        peer: Role,
        /// Its process.
        pid: u32,
        /// For how long.
        waited_ms: u128,
    },
    /// A message has another number than lock-step asks for.
    #[error("{peer} is out of step: message {expected} was due, message {got} came")]
    OutOfStep {
        /// Who.
        peer: Role,
        /// The number that was due.
        expected: u64,
        /// The number that came.
        got: u64,
    },
    /// A message has an invalid content.
    #[error("{peer} sent an invalid message: {what} is {got}")]
    Invalid {
        /// Who.
        peer: Role,
        /// Which field.
        what: &'static str,
        /// Its value.
        got: String,
    },
    /// The controller refused a request.
    #[error(
        "{peer} refused the request: {what} {got} is not what its policy or lock-step asks for"
    )]
    Refused {
        /// Who.
        peer: Role,
        /// What it refused.
        what: &'static str,
        /// The value that it names.
        got: u32,
    },
    /// The serial line cannot be opened.
    #[error("cannot open {path}: is the board plugged in, and may you use its line?")]
    CannotOpen {
        /// The line.
        path: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// The serial line broke.
    #[error("controller at {path} is gone: unplugged or switched off?")]
    Unplugged {
        /// The line.
        path: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// The board does not answer, or nothing that can be read.
    #[error(
        "controller at {path} has not answered for {waited_ms} ms ({resent} requests sent again, {damaged} damaged \
         frames came): does it run the firmware `serial`, at this rate?"
    )]
    NoAnswer {
        /// The line.
        path: String,
        /// For how long.
        waited_ms: u128,
        /// Requests that were sent again.
        resent: u64,
        /// Damaged frames that came instead.
        damaged: u64,
    },
    /// The board runs another policy, or talks otherwise.
    #[error("controller at {path} does not match: {difference}; {advice}")]
    OtherBoard {
        /// The line.
        path: String,
        /// What differs, with both values.
        difference: String,
        /// What to do.
        advice: &'static str,
    },
    /// The new policy is for another robot than the board's confirmed one.
    #[error(
        "policy is for another robot than that of the controller at {path}: {}; nothing was written, and --force sends it \
         all the same",
        differences.join("; ")
    )]
    OtherRobot {
        /// The line.
        path: String,
        /// What differs, with both values.
        differences: Vec<String>,
    },
    /// The board refused a request.
    #[error("controller at {path} refused the request: {reason}")]
    BoardRefused {
        /// The line.
        path: String,
        /// Why.
        reason: String,
    },
    /// A controller cannot listen.
    #[error(
        "cannot listen at {place}: is it in use, or was a controller there killed that left its socket?"
    )]
    CannotListen {
        /// The place.
        place: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// The system does not give the process what it asks for.
    #[error("cannot {what}: {advice}")]
    Denied {
        /// What it was to do.
        what: String,
        /// What the user can do.
        advice: &'static str,
        /// What the system said.
        source: std::io::Error,
    },
    /// A recording cannot be written.
    #[error("cannot write {path}")]
    Record {
        /// The file.
        path: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// The handler of Ctrl-C cannot be installed.
    #[error("cannot watch for Ctrl-C")]
    Signals(#[from] ctrlc::Error),
    /// The user asked to stop.
    #[error("interrupted")]
    Interrupted,
}

impl BridgeError {
    /// Wraps what iceoryx2 said.
    pub(crate) fn transport<E: Into<Box<dyn Error + Send + Sync>>>(
        action: &'static str,
    ) -> impl Fn(E) -> BridgeError {
        move |source| BridgeError::Transport {
            action,
            source: source.into(),
        }
    }

    /// The exit status of a process that ends with this error.
    #[must_use]
    pub const fn status(&self) -> Status {
        match self {
            Self::NoSpace { .. }
            | Self::Folder { .. }
            | Self::NotOurs { .. }
            | Self::Transport { .. }
            | Self::Signals(_) => Status::OurFault,
            Self::RunName { .. }
            | Self::CannotListen { .. }
            | Self::Denied { .. }
            | Self::Record { .. } => Status::Usage,
            Self::TooLarge { .. } | Self::NoPeriod | Self::Capacity(_) => Status::BadInput,
            Self::Taken { .. }
            | Self::NotConnected { .. }
            | Self::Foreign { .. }
            | Self::Mismatch { .. }
            | Self::Died { .. }
            | Self::Left { .. }
            | Self::Silent { .. }
            | Self::OutOfStep { .. }
            | Self::Invalid { .. }
            | Self::Refused { .. }
            | Self::CannotOpen { .. }
            | Self::Unplugged { .. }
            | Self::NoAnswer { .. }
            | Self::OtherBoard { .. }
            | Self::OtherRobot { .. }
            | Self::BoardRefused { .. } => Status::Peer,
            Self::Interrupted => Status::Interrupted,
        }
    }
}
