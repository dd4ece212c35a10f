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

use super::{Failure, Fault as _};
use crate::session::{
    self, Budget, CheckpointError, GenerationReport, LOG_COLUMNS, Session, Snapshot,
};

/// A checkpoint is written at the end, and in between not more often than this, beside the training that goes on.
const CHECKPOINT_EVERY: Duration = Duration::from_secs(20);

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
pub(super) struct RunFolder {
    path: PathBuf,
    log: csv::Writer<File>,
    last_champion: Option<u64>,
    last_checkpoint: Instant,
    /// The thread that writes the last checkpoint, until it is known that it could.
    writer: Option<JoinHandle<Result<(), CheckpointError>>>,
}

impl RunFolder {
    /// Makes the folder of a new run.
    pub(super) fn create(
        path: &Path,
        session: &Session,
        preset: &str,
        budget: Budget,
    ) -> Result<Self, Failure> {
        let shown = path.display();
        if path.join("checkpoint").exists() || path.join("run.toml").exists() {
            return Err(Failure::usage(anyhow::anyhow!(
                "{shown} holds a run already; go on with it by `tpg train --resume {shown}`, or \
                 choose another folder"
            )));
        }
        fs::create_dir_all(path.join("champions")).or_usage(format!("cannot create {shown}"))?;
        let run = RunFile {
            preset: preset.to_owned(),
            seed: session.seed(),
            budget,
            command: std::env::args().collect(),
            versions: Versions {
                tpg: env!("CARGO_PKG_VERSION").into(),
                blob_format: tpg_runtime::blob::VERSION,
                mujoco: crate::task::simulator_version(),
            },
        };
        write_whole(&path.join("run.toml"), toml::to_string(&run)?.as_bytes())?;
        let config = toml::to_string(session.config())?;
        write_whole(&path.join("config.toml"), config.as_bytes())?;
        let mut log = csv::WriterBuilder::new()
            .has_headers(false)
            .from_writer(File::create(path.join("log.csv"))?);
        log.write_record(LOG_COLUMNS)?;
        log.flush()?;
        Ok(RunFolder {
            path: path.to_owned(),
            log,
            last_champion: None,
            last_checkpoint: Instant::now(),
            writer: None,
        })
    }

    /// Opens the folder of a run to go on with it; rows of the log behind the checkpoint are dropped.
    pub(super) fn open(path: &Path) -> Result<(Self, Session, Budget), Failure> {
        let shown = path.display();
        let session = session::load(&path.join("checkpoint"))
            .or_bad_input(format!("cannot resume {shown}"))?;
        let run_path = path.join("run.toml");
        let text = fs::read_to_string(&run_path)
            .or_bad_input(format!("cannot read {}", run_path.display()))?;
        let run: RunFile =
            toml::from_str(&text).or_bad_input(format!("cannot use {}", run_path.display()))?;
        let log_path = path.join("log.csv");
        let kept = rows_up_to(&log_path, session.generation())
            .or_bad_input(format!("cannot use {}", log_path.display()))?;
        write_whole(&log_path, kept.as_bytes())?;
        let file = OpenOptions::new().append(true).open(&log_path)?;
        let folder = RunFolder {
            path: path.to_owned(),
            log: csv::WriterBuilder::new()
                .has_headers(false)
                .from_writer(file),
            last_champion: session.champion().map(|(id, _)| id.0),
            last_checkpoint: Instant::now(),
            writer: None,
        };
        Ok((folder, session, run.budget))
    }

    /// The folder.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// The best policy's file.
    pub(super) fn champion(&self) -> PathBuf {
        self.path.join("champion.tpg")
    }

    /// Records a generation: its row, its champion if that changed, and from time to time a checkpoint.
    pub(super) fn record(
        &mut self,
        session: &Session,
        report: &GenerationReport,
    ) -> Result<(), Failure> {
        self.log.serialize(report)?;
        self.log.flush()?;
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
    fn join_writer(&mut self) -> Result<(), Failure> {
        match self.writer.take().map(JoinHandle::join) {
            Some(Err(panic)) => std::panic::resume_unwind(panic),
            Some(Ok(written)) => Ok(written?),
            None => Ok(()),
        }
    }

    /// Writes the final checkpoint.
    pub(super) fn finish(&mut self, session: &Session) -> Result<(), Failure> {
        self.join_writer()?;
        if session.generation() > 0 {
            write_whole(&self.champion(), &session.export_champion()?)?;
        }
        Ok(Snapshot::new(session).save(&self.path.join("checkpoint"))?)
    }
}

/// The log's header and its rows of generations up to `generation`, as text.
fn rows_up_to(path: &Path, generation: u64) -> anyhow::Result<String> {
    let text = fs::read_to_string(path)?;
    let mut lines = text.split_inclusive('\n');
    let header = lines.next().unwrap_or_default();
    anyhow::ensure!(
        header.trim_end() == LOG_COLUMNS.join(","),
        "its columns are not those of this build: {}",
        LOG_COLUMNS.join(",")
    );
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
fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let temporary = path.with_extension("tmp");
    let written = fs::write(&temporary, bytes).and_then(|()| fs::rename(&temporary, path));
    written.map_err(|e| {
        anyhow::Error::new(e)
            .context(format!("cannot write {}", path.display()))
            .into()
    })
}
