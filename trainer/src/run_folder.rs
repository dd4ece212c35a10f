//! The folder of a run: it explains itself, and no crash leaves it half-written.
//!
//! | file | what it holds |
//! |---|---|
//! | `champion.tpg` | the best policy so far |
//! | `champions/NNNNNN.tpg` | the champion of generation N, where it differs from the one before |
//! | `log.csv` | one row for each generation |
//! | `config.toml` | the resolved configuration |
//! | `run.toml` | preset, seed, budget, command and versions |
//! | `checkpoint` | everything that `--resume` needs |

use std::fs::{self, File, OpenOptions};
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use tpg_tasks::exit_status::{HasStatus, Status};

use crate::session::{
    self, Budget, CheckpointError, GenerationReport, LOG_COLUMNS, Session, SessionError, Snapshot,
};

/// A checkpoint is written at the end, and in between not more often than this, beside the training that goes on.
const CHECKPOINT_EVERY: Duration = Duration::from_secs(20);

/// Why the folder of a run could not be made, read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunFolderError {
    /// There is a run in it.
    #[error(
        "{0} holds a run already; go on with it by `tpg train --resume {0}`, or choose another folder"
    )]
    HoldsRun(String),
    /// A file or folder of the run cannot be written.
    #[error("cannot write {path}")]
    Write {
        /// Which one.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A file of the run cannot be read.
    #[error("cannot read {path}")]
    Read {
        /// Which one.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A file of the run is not what it should be.
    #[error("cannot use {path}: {why}")]
    Malformed {
        /// Which one.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// There is no checkpoint to go on from.
    #[error("cannot resume {path}")]
    Resume {
        /// The folder.
        path: PathBuf,
        /// What is wrong with its checkpoint.
        source: CheckpointError,
    },
    /// The next checkpoint cannot be written.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// The run cannot go on.
    #[error(transparent)]
    Session(#[from] SessionError),
}

impl HasStatus for RunFolderError {
    fn status(&self) -> Status {
        match self {
            Self::HoldsRun(_) | Self::Write { .. } | Self::Checkpoint(_) => Status::Usage,
            Self::Read { .. } | Self::Malformed { .. } | Self::Resume { .. } => Status::BadInput,
            Self::Session(SessionError::Config(_)) => Status::Usage,
            Self::Session(_) => Status::OurFault,
        }
    }
}

/// What is known of a run beside its configuration.
#[derive(Debug, Serialize, Deserialize)]
struct RunFile {
    preset: String,
    seed: u64,
    budget: Budget,
    command: Vec<String>,
    versions: Versions,
}

#[derive(Debug, Serialize, Deserialize)]
struct Versions {
    tpg: String,
    blob_format: u16,
    mujoco: String,
}

/// The folder of a run in progress.
pub struct RunFolder {
    path: PathBuf,
    log: csv::Writer<File>,
    last_champion: Option<u64>,
    last_checkpoint: Instant,
    /// The thread that writes the last checkpoint, until it is known that it could.
    writer: Option<JoinHandle<Result<(), CheckpointError>>>,
}

impl RunFolder {
    /// Makes the folder of a new run.
    pub fn create(
        path: &Path,
        session: &Session,
        preset: &str,
        budget: Budget,
    ) -> Result<Self, RunFolderError> {
        if path.join("checkpoint").exists() || path.join("run.toml").exists() {
            return Err(RunFolderError::HoldsRun(path.display().to_string()));
        }
        let champions = path.join("champions");
        fs::create_dir_all(&champions).map_err(unwritable(&champions))?;
        let run = RunFile {
            preset: preset.to_owned(),
            seed: session.seed(),
            budget,
            command: std::env::args().collect(),
            versions: Versions {
                tpg: env!("CARGO_PKG_VERSION").into(),
                blob_format: tpg_runtime::blob::VERSION,
                mujoco: tpg_tasks::task::simulator_version(),
            },
        };
        write_whole(&path.join("run.toml"), as_toml(&run).as_bytes())?;
        write_whole(
            &path.join("config.toml"),
            as_toml(session.config()).as_bytes(),
        )?;
        let log_path = path.join("log.csv");
        let file = File::create(&log_path).map_err(unwritable(&log_path))?;
        let mut log = log_writer(file);
        let written = log.write_record(LOG_COLUMNS).map_err(Into::into);
        (written.and_then(|()| log.flush())).map_err(unwritable(&log_path))?;
        Ok(RunFolder {
            path: path.to_owned(),
            log,
            last_champion: None,
            last_checkpoint: Instant::now(),
            writer: None,
        })
    }

    /// Opens the folder of a run to go on with it; rows of the log behind the checkpoint are dropped.
    pub fn open(path: &Path) -> Result<(Self, Session, Budget), RunFolderError> {
        let session = session::load(&path.join("checkpoint")).map_err(|source| {
            let path = path.to_owned();
            RunFolderError::Resume { path, source }
        })?;
        let run_path = path.join("run.toml");
        let run: RunFile =
            toml::from_str(&read(&run_path)?).map_err(|e| malformed(&run_path, e.to_string()))?;
        let log_path = path.join("log.csv");
        let kept = rows_up_to(&read(&log_path)?, session.generation())
            .map_err(|why| malformed(&log_path, why))?;
        write_whole(&log_path, kept.as_bytes())?;
        let file = OpenOptions::new().append(true).open(&log_path);
        let folder = RunFolder {
            path: path.to_owned(),
            log: log_writer(file.map_err(unwritable(&log_path))?),
            last_champion: session.champion().map(|(id, _)| id.0),
            last_checkpoint: Instant::now(),
            writer: None,
        };
        Ok((folder, session, run.budget))
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The best policy's file.
    pub fn champion(&self) -> PathBuf {
        self.path.join("champion.tpg")
    }

    /// Records a generation: its row, its champion if that changed, and from time to time a checkpoint.
    pub fn record(
        &mut self,
        session: &Session,
        report: &GenerationReport,
    ) -> Result<(), RunFolderError> {
        let written = self.log.serialize(report).map_err(Into::into);
        (written.and_then(|()| self.log.flush()))
            .map_err(unwritable(&self.path.join("log.csv")))?;
        if self.last_champion != Some(report.champion) {
            let blob = session.export_champion()?;
            let name = format!("champions/{:06}.tpg", report.generation);
            write_whole(&self.path.join(name), &blob)?;
            write_whole(&self.champion(), &blob)?;
            self.last_champion = Some(report.champion);
        }
        if self.last_checkpoint.elapsed() >= CHECKPOINT_EVERY {
            self.join_writer()?;
            let (snapshot, path) = (Snapshot::new(session), self.path.join("checkpoint"));
            self.writer = Some(std::thread::spawn(move || snapshot.save(&path)));
            self.last_checkpoint = Instant::now();
        }
        Ok(())
    }

    /// Waits for the checkpoint that is being written, if there is one.
    fn join_writer(&mut self) -> Result<(), RunFolderError> {
        match self.writer.take().map(JoinHandle::join) {
            Some(Err(panic)) => std::panic::resume_unwind(panic),
            Some(Ok(written)) => Ok(written?),
            None => Ok(()),
        }
    }

    /// Writes the final checkpoint.
    pub fn finish(&mut self, session: &Session) -> Result<(), RunFolderError> {
        self.join_writer()?;
        if session.generation() > 0 {
            write_whole(&self.champion(), &session.export_champion()?)?;
        }
        Ok(Snapshot::new(session).save(&self.path.join("checkpoint"))?)
    }
}

/// Serialises what always can be: structs of plain values.
fn as_toml(value: &impl Serialize) -> String {
    toml::to_string(value).expect("a configuration is valid TOML")
}

fn log_writer(file: File) -> csv::Writer<File> {
    let mut builder = csv::WriterBuilder::new();
    builder.has_headers(false).from_writer(file)
}

fn read(path: &Path) -> Result<String, RunFolderError> {
    fs::read_to_string(path).map_err(|source| RunFolderError::Read {
        path: path.to_owned(),
        source,
    })
}

fn unwritable(path: &Path) -> impl FnOnce(std::io::Error) -> RunFolderError + use<> {
    let path = path.to_owned();
    move |source| RunFolderError::Write { path, source }
}

fn malformed(path: &Path, why: String) -> RunFolderError {
    RunFolderError::Malformed {
        path: path.to_owned(),
        why: why.trim_end().replace('\n', "; "),
    }
}

/// The log's header and its rows of generations up to `generation`, as text; else why it is no log of this build.
fn rows_up_to(log: &str, generation: u64) -> Result<String, String> {
    let mut lines = log.split_inclusive('\n');
    let header = lines.next().unwrap_or_default();
    if header.trim_end() != LOG_COLUMNS.join(",") {
        return Err(format!(
            "its columns are not those of this build: {}",
            LOG_COLUMNS.join(",")
        ));
    }
    let mut kept = header.to_owned();
    for line in lines {
        let number = line.split(',').next().and_then(|n| n.parse::<u64>().ok());
        // A row that a crash cut short has no end of line; it is behind the checkpoint in any case.
        if line.ends_with('\n') && number.is_some_and(|n| n <= generation) {
            kept.push_str(line);
        }
    }
    Ok(kept)
}

/// Replaces a file as a whole, so that a crash leaves the old one.
fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), RunFolderError> {
    let temporary = path.with_extension("tmp");
    let written = fs::write(&temporary, bytes).and_then(|()| fs::rename(&temporary, path));
    written.map_err(unwritable(path))
}
