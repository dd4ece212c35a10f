//! Checkpoints: everything that a run needs to go on, in one file that is replaced as a whole.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

use super::{Session, SessionError, State};
use crate::config::Config;
use crate::files;
use crate::front_end::Learner;
use tpg_tasks::task::Spec;

const MAGIC: &[u8; 8] = b"TPGCHKPT";
const VERSION: u32 = 6;
const DIGEST_BYTES: usize = 32;

/// Why a checkpoint could not be written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// The file system refused.
    #[error("cannot {action} {path}")]
    Io {
        /// What was tried: `read` or `write`.
        action: &'static str,
        /// On which path.
        path: PathBuf,
        /// What came of it.
        source: std::io::Error,
    },
    /// The file is no checkpoint, or a damaged one.
    #[error("{path} is no checkpoint: {why}")]
    Malformed {
        /// Which file.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
}

/// A file that the task depends on, and its SHA-256 in hexadecimal.
pub type TaskFile = (String, String);

/// How much of a log belongs to a checkpoint: its length in bytes, and their SHA-256.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct LogMark {
    /// Length in bytes.
    pub bytes: u64,
    /// SHA-256 of these bytes.
    pub sha256: [u8; DIGEST_BYTES],
}

#[derive(Serialize, Deserialize)]
struct Stored {
    /// As TOML, whose keys may be left out: a checkpoint outlives new settings.
    config: String,
    seed: u64,
    task_files: Vec<TaskFile>,
    log: LogMark,
    state: State,
    learner: Option<Learner>,
}

/// A session as it stands between two generations.
///
/// It shares the session's genomes, so training can go on while this is written.
#[derive(Clone)]
pub struct Snapshot {
    config: Config,
    seed: u64,
    state: State,
    learner: Option<Learner>,
}

/// What a checkpoint holds.
pub struct Checkpoint {
    /// The session, ready to go on.
    pub session: Session,
    /// The files of the task when the checkpoint was written.
    pub task_files: Vec<TaskFile>,
    /// The part of the log that the checkpoint stands behind.
    pub log: LogMark,
}

impl Snapshot {
    /// Takes one.
    #[must_use]
    pub fn new(session: &Session) -> Self {
        Snapshot {
            config: session.config.clone(),
            seed: session.seed,
            state: session.state.clone(),
            learner: session.learner.clone(),
        }
    }

    /// Replaces the file at `path` as a whole: a crash leaves the old checkpoint.
    ///
    /// # Errors
    /// [`CheckpointError::Io`].
    pub fn save(
        self,
        path: &Path,
        task_files: Vec<TaskFile>,
        log: LogMark,
    ) -> Result<(), CheckpointError> {
        let stored = Stored {
            config: toml::to_string(&self.config).map_err(|why| malformed(path, &why))?,
            seed: self.seed,
            task_files,
            log,
            state: self.state,
            learner: self.learner,
        };
        let body = postcard::to_stdvec(&stored).map_err(|why| malformed(path, &why))?;
        let digest = Sha256::digest(&body);
        let version = VERSION.to_le_bytes();
        let parts = [MAGIC.as_slice(), &version, &digest, &body];
        files::replace_durably(path, &parts).map_err(|source| CheckpointError::Io {
            action: "write",
            path: path.to_owned(),
            source,
        })
    }
}

/// Reads a checkpoint.
///
/// # Errors
/// [`CheckpointError`] if the file cannot be read, is damaged, or was written by another version.
pub fn load(path: &Path) -> Result<Checkpoint, CheckpointError> {
    load_with(path, Session::new)
}

/// Reads the checkpoint of a run on a task whose episodes somebody else runs.
///
/// # Errors
/// As for [`load`].
pub fn load_external(path: &Path, spec: &Spec) -> Result<Checkpoint, CheckpointError> {
    load_with(path, |config, seed| Session::external(config, seed, spec))
}

fn load_with(
    path: &Path,
    make: impl FnOnce(Config, u64) -> Result<Session, SessionError>,
) -> Result<Checkpoint, CheckpointError> {
    let bytes = std::fs::read(path).map_err(|source| CheckpointError::Io {
        action: "read",
        path: path.to_owned(),
        source,
    })?;
    let rest = bytes
        .strip_prefix(MAGIC)
        .ok_or_else(|| malformed(path, &"it does not begin as one"))?;
    let (version, rest) = rest
        .split_first_chunk::<4>()
        .ok_or_else(|| malformed(path, &"it is truncated"))?;
    let version = u32::from_le_bytes(*version);
    if version != VERSION {
        let why = format!(
            "it has version {version}, this build reads version {VERSION}; \
             resume it with the build that wrote it"
        );
        return Err(malformed(path, &why));
    }
    let (digest, body) = rest
        .split_first_chunk::<DIGEST_BYTES>()
        .ok_or_else(|| malformed(path, &"it is truncated"))?;
    if Sha256::digest(body).as_slice() != digest {
        return Err(malformed(path, &"its checksum differs, so it is damaged"));
    }
    let stored: Stored = postcard::from_bytes(body).map_err(|why| malformed(path, &why))?;
    let config: Config = toml::from_str(&stored.config).map_err(|why| malformed(path, &why))?;
    let session = make(config, stored.seed).map_err(|why| malformed(path, &why))?;
    let genes = &session.settings.genes;
    stored
        .state
        .check(genes)
        .map_err(|why| malformed(path, &why))?;
    match (&stored.learner, &session.learner) {
        (Some(learner), Some(_)) => {
            let inputs = usize::from(genes.shape.inputs);
            let checked = learner.check(inputs, genes.shape.actions);
            checked.map_err(|why| malformed(path, &format!("of its front end, {why}")))?;
        }
        (None, None) => {}
        _ => {
            return Err(malformed(
                path,
                &"it has a front end in a run without, or none",
            ));
        }
    }
    Ok(Checkpoint {
        session: Session {
            state: stored.state,
            learner: stored.learner,
            ..session
        },
        task_files: stored.task_files,
        log: stored.log,
    })
}

fn malformed(path: &Path, why: &dyn ToString) -> CheckpointError {
    CheckpointError::Malformed {
        path: path.to_owned(),
        why: why.to_string(),
    }
}
