//! One run of an experiment: trained or resumed, tested, and written down.

use std::fs::{self, OpenOptions};
use std::io::Write as _;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use cpu_time::{ProcessTime, ThreadTime};
use tpg_runtime::Policy;

use crate::file::{Cell, Experiment};
use crate::folder::{FORMAT, Folder};
use crate::row::{
    CurvePoint, Row, TableError, read_table, write_ablations, write_accesses, write_curve,
    write_row,
};
use crate::score::{forgetting, test};
use tpg_tasks::console::note;
use tpg_tasks::eval::Episode;
use tpg_tasks::exit_status::{Failure, Fault as _};
use tpg_tasks::stats;
use tpg_trainer::made_with::MadeWith;
use tpg_trainer::monitor::Monitor;
use tpg_trainer::run_folder::{Keep, Origin, RunFolder, RunFolderError};
use tpg_trainer::session::{Session, train};

/// Points of a learning curve that are kept, at most.
const CURVE_POINTS: usize = 100;

/// CPU seconds after each generation, in a run's folder: what checkpoints have no use for.
const CPU_LOG: &str = "cpu";

/// Trains a run to its end, or on from its checkpoint, and writes its results; `None` if it was stopped before its end.
///
/// `progress` is told the share of the budget that is used, at the beginning and after each generation. `commit` is the one that the
/// program was built from, where it is known.
///
/// # Errors
/// A [`Failure`] with its status: the configuration, a file that cannot be written, or the simulator.
pub fn run(
    experiment: &Experiment,
    folder: &Folder,
    cell: &Cell,
    commit: Option<&str>,
    stop: &Arc<AtomicBool>,
    progress: &dyn Fn(f64),
) -> Result<Option<Row>, Failure> {
    let work = folder.work(cell);
    let (mut session, mut run_folder) = open(&work, cell, experiment.threads, commit)?;
    let pool = session
        .pool(experiment.threads)
        .or_usage("bad configuration")?;
    let mut pool = pool.with_monitor(Arc::new(Monitor::new(stop.clone())));
    let mut cpu = CpuLog::open(&work, session.generation(), experiment.threads)?;
    let budget = cell.budget;
    progress(budget.used(&session));
    train(&mut session, &mut pool, budget, |session, report| {
        run_folder.record(session, report).map_err(Failure::of)?;
        progress(budget.used(session));
        cpu.record(report.generation)
    })?;
    run_folder.finish(&session).map_err(Failure::of)?;
    if budget.used(&session) < 1.0 && stop.load(Ordering::Relaxed) {
        return Ok(None);
    }
    let row = write(experiment, folder, cell, &session, cpu.seconds())?;
    fs::remove_dir_all(&work).or_unwritable(&work)?;
    Ok(Some(row))
}

/// The run that lies in the folder, or a new one.
fn open(
    work: &Path,
    cell: &Cell,
    threads: usize,
    commit: Option<&str>,
) -> Result<(Session, RunFolder), Failure> {
    if work.join("checkpoint").exists() {
        match RunFolder::open(work, false) {
            Ok((run_folder, session, _)) if is_of(&session, cell) => {
                return Ok((session, run_folder));
            }
            Ok(_) => note(format_args!(
                "{}: its checkpoint is of another run; it begins anew",
                cell.name
            )),
            Err(error @ RunFolderError::Locked { .. }) => return Err(Failure::of(error)),
            Err(error) => note(format_args!(
                "{}: {:#}; it begins anew",
                cell.name,
                anyhow::Error::new(error)
            )),
        }
    }
    if work.exists() {
        fs::remove_dir_all(work).or_unwritable(work)?;
    }
    let session = Session::new(cell.config.clone(), cell.seed).or_usage("bad configuration")?;
    let origin = Origin {
        preset: cell.preset.clone(),
        budget: cell.budget,
        command: std::env::args().collect(),
        keep: Keep::default(),
        threads,
        commit: commit.map(str::to_owned),
    };
    let run_folder = RunFolder::create(work, &session, origin).map_err(Failure::of)?;
    Ok((session, run_folder))
}

fn is_of(session: &Session, cell: &Cell) -> bool {
    *session.config() == cell.config && session.seed() == cell.seed
}

/// The CPU time that a run has taken over all resumes.
struct CpuLog {
    out: fs::File,
    before: f64,
    clock: Clock,
}

/// Measures what trains: this thread alone, beside others that do so, or every thread of the process.
enum Clock {
    Thread(ThreadTime),
    Process(ProcessTime),
}

impl Clock {
    fn elapsed(&self) -> Duration {
        match self {
            Clock::Thread(start) => start.elapsed(),
            Clock::Process(start) => start.elapsed(),
        }
    }
}

impl CpuLog {
    /// Goes on after `generation`.
    fn open(work: &Path, generation: u64, threads: usize) -> Result<Self, Failure> {
        let path = work.join(CPU_LOG);
        let before = fs::read_to_string(&path).unwrap_or_default();
        let recorded = before.lines().rev().find_map(|line| {
            let (number, seconds) = line.split_once(' ')?;
            let of_generation = number.parse() == Ok(generation);
            seconds.parse().ok().filter(|_: &f64| of_generation)
        });
        Ok(CpuLog {
            out: OpenOptions::new()
                .create(true)
                .append(true)
                .open(&path)
                .or_unwritable(&path)?,
            before: recorded.unwrap_or(0.0),
            clock: match threads {
                1 => Clock::Thread(ThreadTime::now()),
                _ => Clock::Process(ProcessTime::now()),
            },
        })
    }

    fn seconds(&self) -> f64 {
        self.before + self.clock.elapsed().as_secs_f64()
    }

    fn record(&mut self, generation: u64) -> Result<(), Failure> {
        Ok(writeln!(self.out, "{generation} {}", self.seconds())?)
    }
}

/// Tests the champion and writes its tables, the learning curve and last the row: a row means that all is there.
fn write(
    experiment: &Experiment,
    folder: &Folder,
    cell: &Cell,
    session: &Session,
    cpu_seconds: f64,
) -> Result<Row, Failure> {
    let files = folder.files(cell);
    let mut tested = test(session, cell.seed, experiment.test_episodes)?;
    if !tested.as_evolved {
        note(format_args!(
            "{}: the champion as evolved exceeds the format, so its executed instructions and memory accesses are \
             not counted",
            cell.name
        ));
        tested.accesses.clear();
    }
    if cell.has_memory {
        write_accesses(&files.accesses, &tested.accesses)?;
    }
    let ablations = forgetting(session, cell.seed, experiment.test_episodes)?;
    if !ablations.is_empty() {
        write_ablations(&files.ablations, &ablations)?;
    }
    write_curve(&files.curve, &curve(&folder.work(cell))?)?;
    let blob = session.export_champion()?;
    let policy = Policy::load(&blob)?;
    let champion = session.champion();
    let made_with = MadeWith::this_build(FORMAT);
    let returns: Vec<f64> = tested.episodes.iter().map(|e| e.total).collect();
    let unstable = |e: &&Episode| e.unstable;
    let row = Row {
        task: cell.task.clone(),
        variant: cell.variant.clone(),
        repeat: cell.repeat,
        seed: cell.seed,
        config: cell.config_hash.clone(),
        tpg: made_with.tpg,
        fingerprint: made_with.fingerprint,
        budget: cell.budget.to_string(),
        threads: experiment.threads,
        generations: session.generation(),
        steps: session.steps(),
        train_seconds: session.seconds(),
        cpu_seconds,
        train_best: champion.map_or(f64::NAN, |(_, record)| record.score),
        champion_id: champion.map_or(0, |(id, _)| id.0),
        champion_bytes: blob.len(),
        champion_teams: policy.header().teams,
        champion_programs: policy.header().programs,
        champion_instructions: policy.bounds().instructions,
        instructions_mean: if tested.as_evolved {
            tested.instructions_mean()
        } else {
            f64::NAN
        },
        test_episodes: experiment.test_episodes,
        test_mean: stats::mean(&returns),
        test_sd: stats::standard_deviation(&returns),
        test_median: stats::median(&returns),
        unstable: tested.episodes.iter().filter(unstable).count() as u32,
        test_returns: returns,
    };
    write_row(&files.row, &row)?;
    Ok(row)
}

/// The run's log, thinned evenly; its first and its last generation stay.
fn curve(work: &Path) -> Result<Vec<CurvePoint>, TableError> {
    let all: Vec<CurvePoint> = read_table(&work.join("log.csv"))?;
    let last = all.len().saturating_sub(1);
    if last < CURVE_POINTS {
        return Ok(all);
    }
    let kept = (0..CURVE_POINTS).map(|k| k * last / (CURVE_POINTS - 1));
    Ok(kept.map(|k| all[k]).collect())
}
