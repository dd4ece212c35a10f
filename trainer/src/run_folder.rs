//! The folder of a run. It explains itself, and no crash leaves it half-written.
//!
//! | file | what it holds |
//! |---|---|
//! | `champion.tpg` | the best policy so far |
//! | `champions/NNNNNN.tpg` | the champion of generation N, where it differs from the one before |
//! | `log.csv` | one row for each generation |
//! | `config.toml` | the resolved configuration |
//! | `run.toml` | preset, seed, budget, command, versions; when, where and with how many threads it began |
//! | `checkpoint` | everything that `--resume` needs |
//! | `report.html` | all of this to look at |
//! | `lock` | held by the process that trains, with its number in it |
//!
//! A power cut leaves the last checkpoint with everything that belongs to it: log and champions reach the disk before the
//! checkpoint that counts them. What comes after is made again by a resume, byte for byte.

mod begun;
mod error;
mod history;
mod lock;
mod log;
mod report;
mod task_files;

use std::fs;
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use crate::config::{Config, differences};
use crate::files;
use crate::made_with::MadeWith;
use crate::report_page::Page;
use crate::session::{
    self, Budget, Checkpoint, CheckpointError, GenerationReport, Session, Snapshot, TaskFile,
};
use tpg_tasks::task::Spec;

use begun::Begun;
pub use error::RunFolderError;
use error::{malformed, read, unwritable};
use history::History;
use lock::Lock;
use log::Log;
use task_files::{changed, task_files};

/// The form of the folder; raised when its files change their meaning.
const FORMAT: u32 = 2;

/// Files that only a run writes.
const FILES: [&str; 6] = [
    report::NAME,
    "champion.tpg",
    "champions",
    "log.csv",
    "config.toml",
    "checkpoint",
];

/// Least time between two pages, so that frequent checkpoints do not wait for them.
const PAGE_EVERY: Duration = Duration::from_secs(5);

/// What of a run's history stays in its folder, everything unless said otherwise, and how often it is made safe.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Keep {
    /// Generations between two rows of the log; at least 1.
    pub log_every: u64,
    /// Latest files that stay in `champions/`; 0 for all.
    pub champions: usize,
    /// Seconds between two checkpoints; 0 for one after each generation. There is always one at the beginning and at the end.
    pub checkpoint_every: u64,
}

impl Default for Keep {
    fn default() -> Self {
        Keep {
            log_every: 1,
            champions: 0,
            checkpoint_every: 20,
        }
    }
}

/// What a new run says of itself in `run.toml`.
#[derive(Debug, Clone)]
pub struct Origin {
    /// Name of the preset.
    pub preset: String,
    /// How long the run is to last.
    pub budget: Budget,
    /// The command that began it.
    pub command: Vec<String>,
    /// What of its history stays.
    pub keep: Keep,
    /// Threads that score, or ranks of an MPI job.
    pub threads: usize,
    /// The commit that the program was built from, where it is known.
    pub commit: Option<String>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct RunFile {
    preset: String,
    seed: u64,
    budget: Budget,
    command: Vec<String>,
    keep: Keep,
    made_with: MadeWith,
    /// Folders of older versions do not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    begun: Option<Begun>,
}

/// The folder of a run in progress.
pub struct RunFolder {
    path: PathBuf,
    run: RunFile,
    log: Log,
    history: History,
    /// What the page says of the champion.
    card: Vec<[String; 2]>,
    /// When the page was last written.
    last_page: Instant,
    task_files: Vec<TaskFile>,
    last_champion: Option<u64>,
    /// Champions that may not have reached the disk yet.
    unsynced: Vec<PathBuf>,
    /// When a checkpoint was last begun, and of which generation it is.
    last_checkpoint: (Instant, u64),
    /// The thread that writes the last checkpoint, until it is known that it could.
    writer: Option<JoinHandle<Result<(), RunFolderError>>>,
    _lock: Lock,
}

impl RunFolder {
    /// Makes the folder of a new run, with a checkpoint from which it can begin again.
    ///
    /// A run that ended before its first checkpoint is replaced.
    ///
    /// # Errors
    /// [`RunFolderError`]: the folder holds a run or files of somebody else, another process trains in it, or it cannot be
    /// written.
    pub fn create(path: &Path, session: &Session, origin: Origin) -> Result<Self, RunFolderError> {
        let champions = path.join("champions");
        files::create_folder_durably(path).map_err(unwritable(path))?;
        if let Some(file) = foreign(path) {
            return Err(RunFolderError::Foreign(file));
        }
        let lock = Lock::take(path)?;
        if path.join("checkpoint").exists() {
            return Err(RunFolderError::HoldsRun(path.to_owned()));
        }
        let run = RunFile {
            preset: origin.preset,
            seed: session.seed(),
            budget: origin.budget,
            command: origin.command,
            keep: origin.keep,
            made_with: MadeWith::this_build(FORMAT),
            begun: Some(Begun::now(origin.threads, origin.commit.as_deref())),
        };
        write(&path.join("run.toml"), as_toml(&run).as_bytes())?;
        // Of a run that ended before its first checkpoint.
        for stale in [champions.clone(), path.join("champion.tpg")] {
            let removed = match stale.is_dir() {
                true => fs::remove_dir_all(&stale),
                false if stale.exists() => fs::remove_file(&stale),
                false => Ok(()),
            };
            removed.map_err(unwritable(&stale))?;
        }
        fs::create_dir_all(&champions).map_err(unwritable(&champions))?;
        let config = as_toml(session.config());
        write(&path.join("config.toml"), config.as_bytes())?;
        let log = Log::create(&path.join("log.csv"))?;
        let mut folder = RunFolder {
            path: path.to_owned(),
            run,
            log,
            history: History::default(),
            card: Vec::new(),
            last_page: Instant::now(),
            task_files: task_files(session)?,
            last_champion: None,
            unsynced: Vec::new(),
            last_checkpoint: (Instant::now(), 0),
            writer: None,
            _lock: lock,
        };
        folder.checkpoint(session)?;
        folder.write_page(session)?;
        Ok(folder)
    }

    /// Opens the folder of a run to go on with it. Rows and champions of generations behind the checkpoint are dropped.
    ///
    /// With `accept_changed_task` the run goes on although files of its task are no more what they were.
    ///
    /// # Errors
    /// [`RunFolderError`]: there is no checkpoint, another process trains in the folder, or one of its files is not what the
    /// run wrote.
    pub fn open(
        path: &Path,
        accept_changed_task: bool,
    ) -> Result<(Self, Session, Budget), RunFolderError> {
        Self::open_with(path, accept_changed_task, &session::load)
    }

    /// As [`RunFolder::open`], for a run on a task whose episodes somebody else runs.
    ///
    /// # Errors
    /// As for [`RunFolder::open`].
    pub fn open_external(
        path: &Path,
        accept_changed_task: bool,
        spec: &Spec,
    ) -> Result<(Self, Session, Budget), RunFolderError> {
        Self::open_with(path, accept_changed_task, &|checkpoint| {
            session::load_external(checkpoint, spec)
        })
    }

    fn open_with(
        path: &Path,
        accept_changed_task: bool,
        load: &dyn Fn(&Path) -> Result<Checkpoint, CheckpointError>,
    ) -> Result<(Self, Session, Budget), RunFolderError> {
        let run_path = path.join("run.toml");
        let checkpoint_path = path.join("checkpoint");
        if !run_path.exists() && !checkpoint_path.exists() {
            return Err(RunFolderError::NoRun(path.to_owned()));
        }
        let lock = Lock::take(path)?;
        if !checkpoint_path.exists() {
            let run: RunFile = from_toml(&run_path)?;
            return Err(RunFolderError::NoCheckpoint {
                path: path.to_owned(),
                command: run.command,
            });
        }
        let Checkpoint {
            session,
            task_files: before,
            log: mark,
        } = load(&checkpoint_path)?;
        let run: RunFile = from_toml(&run_path)?;
        let differs = |path: &Path, what: String| RunFolderError::Differs {
            path: path.to_owned(),
            what,
        };
        if run.seed != session.seed() {
            let what = format!("seed {} instead of {}", run.seed, session.seed());
            return Err(differs(&run_path, what));
        }
        let config_path = path.join("config.toml");
        let config: Config = from_toml(&config_path)?;
        if let Some(what) = differences(&config, session.config()) {
            return Err(differs(&config_path, what));
        }
        let now = task_files(&session)?;
        if !accept_changed_task && let Some(changed) = changed(&before, &now) {
            return Err(RunFolderError::TaskChanged {
                path: path.to_owned(),
                generation: session.generation(),
                changed,
            });
        }
        let log_path = path.join("log.csv");
        let budget = run.budget;
        let mut folder = RunFolder {
            path: path.to_owned(),
            run,
            log: Log::reopen(&log_path, mark)?,
            history: History::read(&log_path)?,
            card: Vec::new(),
            last_page: Instant::now(),
            task_files: now,
            last_champion: session.champion().map(|(id, _)| id.0),
            unsynced: Vec::new(),
            last_checkpoint: (Instant::now(), session.generation()),
            writer: None,
            _lock: lock,
        };
        let champions = folder.champions();
        fs::create_dir_all(&champions).map_err(unwritable(&champions))?;
        folder.drop_champions_after(session.generation())?;
        folder.thin_champions()?;
        if session.generation() > 0 {
            folder.write_champion(&session)?;
        }
        folder.write_page(&session)?;
        Ok((folder, session, budget))
    }

    /// The folder.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The best policy's file.
    #[must_use]
    pub fn champion(&self) -> PathBuf {
        self.path.join("champion.tpg")
    }

    /// Records a generation: its row, its champion if that changed, and from time to time a checkpoint.
    ///
    /// # Errors
    /// [`RunFolderError`] if something cannot be written, now or in the checkpoint before.
    pub fn record(
        &mut self,
        session: &Session,
        report: &GenerationReport,
    ) -> Result<(), RunFolderError> {
        if report
            .generation
            .is_multiple_of(self.run.keep.log_every.max(1))
        {
            self.log.append(report)?;
        }
        self.history.push(report);
        if self.last_champion != Some(report.champion) {
            let blob = session.export_champion()?;
            let path = self.champions().join(file_name(report.generation));
            // The next checkpoint makes sure that they are on the disk; those of later generations a resume makes again.
            files::replace(&path, &[&blob]).map_err(unwritable(&path))?;
            self.unsynced.push(path);
            let path = self.champion();
            files::replace(&path, &[&blob]).map_err(unwritable(&path))?;
            self.last_champion = Some(report.champion);
            self.card = report::card(&blob);
        }
        let every = Duration::from_secs(self.run.keep.checkpoint_every);
        if self.last_checkpoint.0.elapsed() >= every {
            self.join_writer()?;
            self.thin_champions()?;
            let mark = self.log.mark()?;
            let (snapshot, path) = (Snapshot::new(session), self.path.join("checkpoint"));
            let (champions, unsynced) = (self.champions(), std::mem::take(&mut self.unsynced));
            let task_files = self.task_files.clone();
            let due = self.last_page.elapsed() >= PAGE_EVERY;
            let page = due.then(|| self.page(session));
            if due {
                self.last_page = Instant::now();
            }
            let page_path = report::path(&self.path);
            let write = move || {
                files::sync(&champions, &unsynced).map_err(unwritable(&champions))?;
                snapshot.save(&path, task_files, mark)?;
                page.map_or(Ok(()), |page| {
                    page.write(&page_path).map_err(unwritable(&page_path))
                })
            };

            self.writer = Some(std::thread::spawn(write));
            self.last_checkpoint = (Instant::now(), session.generation());
        }
        Ok(())
    }

    /// Writes the champion and the final checkpoint.
    ///
    /// # Errors
    /// [`RunFolderError`] if something cannot be written.
    pub fn finish(&mut self, session: &Session) -> Result<(), RunFolderError> {
        self.join_writer()?;
        if session.generation() > 0 {
            self.write_champion(session)?;
        }
        if self.last_checkpoint.1 != session.generation() {
            self.checkpoint(session)?;
        }
        self.write_page(session)?;
        self.thin_champions()
    }

    /// The page as the run stands.
    fn page(&self, session: &Session) -> Page {
        report::page(
            &self.path,
            &self.run,
            session.config(),
            &self.history,
            &self.card,
        )
    }

    fn write_page(&self, session: &Session) -> Result<(), RunFolderError> {
        let path = report::path(&self.path);
        self.page(session).write(&path).map_err(unwritable(&path))
    }

    /// The folder of the champions so far.
    fn champions(&self) -> PathBuf {
        self.path.join("champions")
    }

    fn write_champion(&mut self, session: &Session) -> Result<(), RunFolderError> {
        let blob = session.export_champion()?;
        self.card = report::card(&blob);
        write(&self.champion(), &blob)
    }

    /// Writes a checkpoint and waits for it.
    fn checkpoint(&mut self, session: &Session) -> Result<(), RunFolderError> {
        let mark = self.log.mark()?;
        let champions = self.champions();
        files::sync(&champions, &self.unsynced).map_err(unwritable(&champions))?;
        self.unsynced.clear();
        let path = self.path.join("checkpoint");
        Snapshot::new(session).save(&path, self.task_files.clone(), mark)?;
        self.last_checkpoint = (Instant::now(), session.generation());
        Ok(())
    }

    /// Waits for the checkpoint that is being written, if there is one.
    fn join_writer(&mut self) -> Result<(), RunFolderError> {
        match self.writer.take().map(JoinHandle::join) {
            Some(Err(panic)) => std::panic::resume_unwind(panic),
            Some(Ok(written)) => written,
            None => Ok(()),
        }
    }

    /// Removes the oldest of the champions that are not to stay. Those that the last checkpoint counts give way only to others that
    /// it counts: a run that goes on from it makes later ones again.
    fn thin_champions(&self) -> Result<(), RunFolderError> {
        if self.run.keep.champions == 0 {
            return Ok(());
        }
        let mut champions = self.numbered_champions()?;
        champions.retain(|(generation, _)| *generation <= self.last_checkpoint.1);
        champions.sort();
        let surplus = champions.len().saturating_sub(self.run.keep.champions);
        remove(champions.into_iter().take(surplus))
    }

    /// Removes champions of generations that a resume makes again.
    fn drop_champions_after(&self, generation: u64) -> Result<(), RunFolderError> {
        let champions = self.numbered_champions()?.into_iter();
        remove(champions.filter(|(number, _)| *number > generation))
    }

    /// Every champion with its generation, in no order.
    fn numbered_champions(&self) -> Result<Vec<(u64, PathBuf)>, RunFolderError> {
        let folder = self.champions();
        let entries = fs::read_dir(&folder).map_err(unwritable(&folder))?;
        let numbered = entries.flatten().filter_map(|entry| {
            let path = entry.path();
            let generation = path.file_stem()?.to_str()?.parse().ok()?;
            Some((generation, path))
        });
        Ok(numbered.collect())
    }
}

/// Name of a generation's champion in `champions/`.
fn file_name(generation: u64) -> String {
    format!("{generation:06}.tpg")
}

fn remove(mut champions: impl Iterator<Item = (u64, PathBuf)>) -> Result<(), RunFolderError> {
    champions.try_for_each(|(_, path)| fs::remove_file(&path).map_err(unwritable(&path)))
}

/// A file with a name that a run uses, in a folder that is no run's.
fn foreign(path: &Path) -> Option<PathBuf> {
    let run = path.join("run.toml");
    if run.exists() {
        return from_toml::<RunFile>(&run).is_err().then_some(run);
    }
    let lock = path.join("lock");
    if lock.exists() && !lock::is_ours(&lock) {
        return Some(lock);
    }
    let mut files = FILES.iter().map(|name| path.join(name));
    files.find(|file| file.exists())
}

/// Serialises what always can be: structs of plain values.
fn as_toml(value: &impl Serialize) -> String {
    toml::to_string(value).expect("plain values are valid TOML")
}

fn from_toml<T: for<'de> Deserialize<'de>>(path: &Path) -> Result<T, RunFolderError> {
    toml::from_str(&read(path)?).map_err(|why| malformed(path, &why.to_string()))
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), RunFolderError> {
    files::replace_durably(path, &[bytes]).map_err(unwritable(path))
}
