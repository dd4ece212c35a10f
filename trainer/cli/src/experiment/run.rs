//! `tpg experiment run`

use std::collections::VecDeque;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::ScopedJoinHandle;
use std::time::{Duration, Instant};

use super::claim::Claim;
use super::progress::Progress;
use crate::interrupt::stop_on_signal;
use crate::version::COMMIT;
use tpg_experiments::cell;
use tpg_experiments::file::{Cell, Experiment};
use tpg_experiments::folder::{Folder, FolderError, Found, Manifest, default_folder};
use tpg_experiments::report::{ReportError, write_page};
use tpg_experiments::row::Row;
use tpg_tasks::console::note;
use tpg_tasks::exit_status::{Failure, Fault as _, Status};

/// Least time between two pages of the experiment.
const PAGE_EVERY: Duration = Duration::from_secs(5);

/// Arguments of `tpg experiment run`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    tpg experiment run docs/experiments/chapter-2-reduced.toml\n  \
    tpg experiment run docs/experiments/chapter-2-reduced.toml --only cartpole.per-agent --out runs/some")]
pub(crate) struct Args {
    /// The file that describes the experiment.
    #[arg(value_name = "FILE.toml")]
    file: PathBuf,
    /// Folder of the results; by default the file's path without .toml.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Runs at a time; by default one for each core, and one alone where a run has several threads.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Only runs with this in their name, TASK.VARIANT.REPEAT.
    #[arg(long, value_name = "SUBSTRING")]
    only: Option<String>,
}

impl Args {
    fn jobs(&self, threads: usize) -> Result<usize, Failure> {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        match self.jobs.map(usize::from) {
            None if threads > 1 => Ok(1),
            None => Ok(cores),
            Some(jobs) if jobs > 1 && threads > 1 => Err(Failure::usage(anyhow::anyhow!(
                "--jobs {jobs}: this experiment's runs have {threads} threads each, whose CPU time can be told only \
                 one run at a time; leave --jobs out"
            ))),
            Some(jobs) => Ok(jobs),
        }
    }

    /// The runs that are asked for.
    fn cells(&self, experiment: &Experiment) -> Result<Vec<Cell>, Failure> {
        let all = experiment.cells().or_usage(self.file.display())?;
        let Some(part) = &self.only else {
            return Ok(all);
        };
        let nearest = tpg_trainer::config::nearest(part, all.iter().map(|cell| cell.name.as_str()));
        let mut some = all;
        some.retain(|cell| cell.name.contains(part.as_str()));
        if some.is_empty() {
            return Err(Failure::usage(anyhow::anyhow!(
                "--only {part:?} is in no run's name; the nearest is {nearest:?}"
            )));
        }
        Ok(some)
    }
}

/// The failure of a folder's error, with the status of its cause.
fn folder_failure(error: FolderError) -> Failure {
    match error {
        FolderError::Differs { .. } | FolderError::Write(_) => Failure::usage(error),
        FolderError::Unreadable { .. } => Failure::bad_input(error),
        error => error.into(),
    }
}

pub(crate) fn run(args: &Args) -> Result<Status, Failure> {
    let shown = args.file.display();
    let text = std::fs::read_to_string(&args.file).or_bad_input(format!("cannot read {shown}"))?;
    let experiment = Experiment::parse(&text).or_usage(&shown)?;
    let cells = args.cells(&experiment)?;
    let jobs = args.jobs(experiment.threads)?;
    let out = args.out.clone();
    let out = out.unwrap_or_else(|| default_folder(&args.file));
    let manifest = Manifest::new(&experiment, &experiment.cells().or_usage(&shown)?);
    let folder = open(&out, &manifest)?;
    let missing = missing(&folder, &manifest, &cells)?;
    note(format_args!(
        "{}: {} of {} runs are to be done, {} at a time; other processes that run this command share them",
        folder.path().display(),
        missing.len(),
        cells.len(),
        jobs.min(missing.len())
    ));
    let stop = stop_on_signal()?;
    let work = Work {
        experiment: &experiment,
        manifest: &manifest,
        folder: &folder,
        progress: Progress::new(cells.len() - missing.len(), cells.len()),
        queue: Mutex::new(missing.into_iter().map(|cell| (cell, false)).collect()),
        all: cells.len(),
        page: Mutex::new(None),
        stop: &stop,
    };
    work.finish(jobs)
}

/// Opens the folder, or makes it: one process after another.
fn open(path: &Path, manifest: &Manifest) -> Result<Folder, Failure> {
    let work = path.join("work");
    std::fs::create_dir_all(&work).or_unwritable(&work)?;
    let lock = work.join("lock");
    let file = File::create(&lock).or_unwritable(&lock)?;
    // Where the file system knows no locks, it goes without: all write the same.
    let _ = file.lock();
    Folder::open(path, manifest).map_err(folder_failure)
}

/// The runs that are not finished.
fn missing<'a>(
    folder: &Folder,
    manifest: &Manifest,
    cells: &'a [Cell],
) -> Result<Vec<&'a Cell>, Failure> {
    let mut missing = Vec::new();
    for cell in cells {
        match folder.find(manifest, cell).map_err(folder_failure)? {
            Found::Finished => {}
            Found::Nothing | Found::Damaged(_) => missing.push(cell),
        }
    }
    Ok(missing)
}

/// The queue of runs, and what its workers share.
struct Work<'a> {
    experiment: &'a Experiment,
    manifest: &'a Manifest,
    folder: &'a Folder,
    /// Runs to be done; `true` for one that another process did when it was looked at first.
    queue: Mutex<VecDeque<(&'a Cell, bool)>>,
    progress: Progress,
    all: usize,
    /// When this process last wrote the experiment's page.
    page: Mutex<Option<Instant>>,
    stop: &'a Arc<AtomicBool>,
}

/// What came of a run.
enum Outcome {
    /// It was done.
    Done,
    /// It was finished already, or stopped before its end.
    NothingToDo,
    /// Another process does it.
    Taken,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Work<'_> {
    /// Does all runs, `jobs` at a time. A run that fails does not stop the others.
    fn finish(&self, jobs: usize) -> Result<Status, Failure> {
        let failures = std::thread::scope(|scope| {
            let workers: Vec<_> = (0..jobs.min(locked(&self.queue).len()))
                .map(|_| scope.spawn(|| self.work()))
                .collect();
            let ticker = scope.spawn(|| self.progress.tick());
            let ended: Vec<_> = workers.into_iter().map(ScopedJoinHandle::join).collect();
            // Before a panic goes on: the scope waits for this thread, too.
            self.progress.finish();
            let _ = ticker.join();
            let failures = ended.into_iter().flat_map(|failures| match failures {
                Ok(failures) => failures,
                Err(panic) => std::panic::resume_unwind(panic),
            });
            failures.collect::<Vec<Failure>>()
        });
        self.write_page(true);
        let failed = failures.len();
        if let Some(first) = failures.into_iter().next() {
            let error = first.error.context(format!("{failed} runs failed"));
            return Err(Failure::new(first.status, error));
        }
        if self.stop.load(Ordering::Relaxed) {
            note("interrupted; the same command goes on");
            return Ok(Status::Interrupted);
        }
        Ok(Status::Fine)
    }

    /// Does runs until there are none left that nobody else does, or until it is told to stop.
    fn work(&self) -> Vec<Failure> {
        let mut failures = Vec::new();
        while !self.stop.load(Ordering::Relaxed) {
            let Some((cell, again)) = locked(&self.queue).pop_front() else {
                break;
            };
            match self.one(cell) {
                Ok(Outcome::Done) => self.write_page(false),
                // Once more at the end: the other process may have been killed by then.
                Ok(Outcome::Taken) if !again => locked(&self.queue).push_back((cell, true)),
                Ok(Outcome::Taken) => {
                    self.progress
                        .say(format_args!("{}: another process does it", cell.name));
                }
                Ok(Outcome::NothingToDo) => {}
                Err(failure) => {
                    self.progress
                        .say(format_args!("{}: {:#}", cell.name, failure.error));
                    failures.push(failure);
                }
            }
        }
        failures
    }

    /// Does a run, unless it is finished or another process does it.
    fn one(&self, cell: &Cell) -> Result<Outcome, Failure> {
        let path = self.folder.claim(cell);
        let Some(claim) = Claim::take(&path).or_unwritable(&path)? else {
            return Ok(Outcome::Taken);
        };
        let found = self.folder.find(self.manifest, cell);
        match found.map_err(folder_failure)? {
            Found::Finished => {
                claim.finish().or_unwritable(&path)?;
                return Ok(Outcome::NothingToDo);
            }
            Found::Nothing => {}
            Found::Damaged(damage) => {
                self.progress.say(format_args!(
                    "{damage:#}; it is removed and {} done again",
                    cell.name
                ));
                self.folder.remove(cell).map_err(folder_failure)?;
            }
        }
        let name = &cell.name;
        let progress = |used| self.progress.at(name, used);
        let row = cell::run(
            self.experiment,
            self.folder,
            cell,
            COMMIT,
            self.stop,
            &progress,
        );
        let done = self.progress.end(name, matches!(row, Ok(Some(_))));
        let Some(row) = row? else {
            return Ok(Outcome::NothingToDo);
        };
        self.show(done, &row);
        claim.finish().or_unwritable(&path)?;
        Ok(Outcome::Done)
    }

    /// Writes the page of the runs so far, if the last one is old or this is the end. Results do not depend on it, so that it
    /// stops no run.
    fn write_page(&self, end: bool) {
        let mut last = locked(&self.page);
        let due = last.is_none_or(|last| last.elapsed() >= PAGE_EVERY);
        if !due && !end {
            return;
        }
        match write_page(self.folder.path()) {
            // Without a finished run there is nothing to show.
            Ok(_) | Err(ReportError::Empty { .. }) => {}
            Err(error) => self.progress.say(format_args!(
                "warning: no report.html: {:#}",
                anyhow::Error::from(error)
            )),
        }
        *last = Some(Instant::now());
    }

    fn show(&self, done: usize, row: &Row) {
        self.progress.say(format_args!(
            "[{done:>3}/{}] {:<40} test {:>9.2}  training {:>9.2}  {:>4} generations  {:>6.1} s",
            self.all,
            row.cell(),
            row.test_mean,
            row.train_best,
            row.generations,
            row.cpu_seconds
        ));
    }
}
