//! `tpg experiment run`

use std::fs::{File, TryLockError};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use crate::interrupt::stop_on_signal;
use tpg_experiments::cell;
use tpg_experiments::file::{Cell, Experiment};
use tpg_experiments::folder::{Folder, FolderError, Found, Manifest, default_folder};
use tpg_experiments::row::Row;
use tpg_tasks::console::note;
use tpg_tasks::exit_status::{Failure, Fault as _, Status};

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
    let folder = Folder::open(&out, &manifest).map_err(folder_failure)?;
    let _lock = lock(&folder)?;
    let missing = missing(&folder, &manifest, &cells)?;
    note(format_args!(
        "{}: {} of {} runs are to be done, {} at a time",
        folder.path().display(),
        missing.len(),
        cells.len(),
        jobs.min(missing.len())
    ));
    let stop = stop_on_signal()?;
    let work = Work {
        experiment: &experiment,
        folder: &folder,
        done: Mutex::new(cells.len() - missing.len()),
        missing,
        next: AtomicUsize::new(0),
        all: cells.len(),
        stop: &stop,
    };
    work.finish(jobs)
}

/// Keeps a second process out of the folder while this one lives.
fn lock(folder: &Folder) -> Result<File, Failure> {
    let path = folder.path().join("work/lock");
    let file = File::create(&path).or_unwritable(&path)?;
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err(Failure::usage(anyhow::anyhow!(
            "another process is running the experiment in {}; wait for its end",
            folder.path().display()
        ))),
        // Where the file system knows no locks, it goes without.
        Err(TryLockError::Error(_)) | Ok(()) => Ok(file),
    }
}

/// The runs that are not finished; what is half-written of one is removed.
fn missing<'a>(
    folder: &Folder,
    manifest: &Manifest,
    cells: &'a [Cell],
) -> Result<Vec<&'a Cell>, Failure> {
    let mut missing = Vec::new();
    for cell in cells {
        match folder.find(manifest, cell).map_err(folder_failure)? {
            Found::Finished => continue,
            Found::Nothing => {}
            Found::Damaged(damage) => {
                note(format_args!(
                    "{damage:#}; it is removed and {} done again",
                    cell.name
                ));
                folder.remove(cell).map_err(folder_failure)?;
            }
        }
        missing.push(cell);
    }
    Ok(missing)
}

/// The queue of runs, and what its workers share.
struct Work<'a> {
    experiment: &'a Experiment,
    folder: &'a Folder,
    missing: Vec<&'a Cell>,
    next: AtomicUsize,
    done: Mutex<usize>,
    all: usize,
    stop: &'a Arc<AtomicBool>,
}

impl Work<'_> {
    /// Does all runs, `jobs` at a time. A run that fails does not stop the others.
    fn finish(&self, jobs: usize) -> Result<Status, Failure> {
        let failures = std::thread::scope(|scope| {
            let workers: Vec<_> = (0..jobs.min(self.missing.len()))
                .map(|_| scope.spawn(|| self.work()))
                .collect();
            let join = |worker: std::thread::ScopedJoinHandle<'_, _>| match worker.join() {
                Ok(failures) => failures,
                Err(panic) => std::panic::resume_unwind(panic),
            };
            workers.into_iter().flat_map(join).collect::<Vec<Failure>>()
        });
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

    /// Does runs until there are none left, or until it is told to stop.
    fn work(&self) -> Vec<Failure> {
        let mut failures = Vec::new();
        while !self.stop.load(Ordering::Relaxed) {
            let Some(cell) = self.missing.get(self.next.fetch_add(1, Ordering::Relaxed)) else {
                break;
            };
            match cell::run(self.experiment, self.folder, cell, self.stop) {
                Ok(Some(row)) => self.show(&row),
                Ok(None) => {}
                Err(failure) => {
                    note(format_args!("{}: {:#}", cell.name, failure.error));
                    failures.push(failure);
                }
            }
        }
        failures
    }

    fn show(&self, row: &Row) {
        let mut done = match self.done.lock() {
            Ok(done) => done,
            Err(poisoned) => poisoned.into_inner(),
        };
        *done += 1;
        note(format_args!(
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
