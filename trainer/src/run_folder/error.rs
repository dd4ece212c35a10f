//! What can be wrong with the folder of a run.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use tpg_tasks::console::{command_line, one_line};
use tpg_tasks::exit_status::{HasStatus, Status};
use tpg_tasks::task::UnknownTask;

use crate::session::{CheckpointError, SessionError};

/// Why the folder of a run could not be made, read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunFolderError {
    /// There is a run in it.
    #[error(
        "{} holds a run already; go on with it by `{}`, or choose another folder",
        .0.display(),
        command_line(["tpg", "train", "--resume", &.0.display().to_string()])
    )]
    HoldsRun(PathBuf),
    /// A file has a name that a run uses, but no run wrote it.
    #[error("{} is there, but no run that wrote it; choose another folder", .0.display())]
    Foreign(PathBuf),
    /// Another process trains in it.
    #[error("another process{pid} trains in {path}; wait for its end, or stop it")]
    Locked {
        /// The folder.
        path: PathBuf,
        /// The number of the process, in words; empty if it is not known.
        pid: String,
    },
    /// There is no run in it.
    #[error("{} holds no run: there is no checkpoint and no run.toml", .0.display())]
    NoRun(PathBuf),
    /// The run ended before its first checkpoint.
    #[error(
        "{path} holds no checkpoint: the run ended before its first; begin it again: {}",
        command_line(command)
    )]
    NoCheckpoint {
        /// The folder.
        path: PathBuf,
        /// The command that began the run.
        command: Vec<String>,
    },
    /// A file of the run is not what belongs to the checkpoint.
    #[error(
        "{path} does not belong to the checkpoint beside it: {what}; restore it, or begin a new run"
    )]
    Differs {
        /// Which file.
        path: PathBuf,
        /// What differs.
        what: String,
    },
    /// The task is not what it was.
    #[error(
        "the task of {path} has changed since generation {generation}: {changed}. Scores of before and after cannot be \
         compared: begin a new run, or go on all the same with --accept-changed-task"
    )]
    TaskChanged {
        /// The folder.
        path: PathBuf,
        /// Generations that the run has completed.
        generation: u64,
        /// Names of the files that changed.
        changed: String,
    },
    /// The task is not to be had.
    #[error(transparent)]
    Task(UnknownTask),
    /// A file or folder of the run cannot be written.
    #[error("cannot write {path}")]
    Write {
        /// Which one.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A file of the run cannot be read.
    #[error("cannot read {path}")]
    Read {
        /// Which one.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A file of the run is not what it should be.
    #[error("cannot use {path}: {why}")]
    Malformed {
        /// Which one.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// The checkpoint cannot be read or written.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// The run cannot go on.
    #[error(transparent)]
    Session(#[from] SessionError),
}

impl HasStatus for RunFolderError {
    fn status(&self) -> Status {
        match self {
            Self::HoldsRun(_)
            | Self::Foreign(_)
            | Self::Locked { .. }
            | Self::Write { .. }
            | Self::Checkpoint(CheckpointError::Io {
                action: "write", ..
            })
            | Self::Session(SessionError::Config(_)) => Status::Usage,
            Self::NoRun(_)
            | Self::NoCheckpoint { .. }
            | Self::Differs { .. }
            | Self::TaskChanged { .. }
            | Self::Task(_)
            | Self::Read { .. }
            | Self::Malformed { .. }
            | Self::Checkpoint(_) => Status::BadInput,
            Self::Session(_) => Status::OurFault,
        }
    }
}

pub(super) fn read(path: &Path) -> Result<String, RunFolderError> {
    fs::read_to_string(path).map_err(|source| RunFolderError::Read {
        path: path.to_owned(),
        source,
    })
}

pub(super) fn unwritable(path: &Path) -> impl FnOnce(io::Error) -> RunFolderError + use<> {
    let path = path.to_owned();
    move |source| RunFolderError::Write { path, source }
}

pub(super) fn malformed(path: &Path, why: &str) -> RunFolderError {
    RunFolderError::Malformed {
        path: path.to_owned(),
        why: one_line(why),
    }
}
