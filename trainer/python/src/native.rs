//! Scores on the built-in tasks: whole episodes run without Python, and other threads of it go on meanwhile.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{self, RecvTimeoutError};

use numpy::{IntoPyArray as _, PyArray1};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use tpg_runtime::HostAgent;
use tpg_tasks::eval::{Conditions, Episode};
use tpg_tasks::exit_status::Failure;
use tpg_tasks::score::{ScoreArgs, Setup};
use tpg_tasks::task::{Randomization, names};
use tpg_trainer::evaluator::{Batch, Evaluator as _, EvaluatorError, Split};
use tpg_trainer::monitor::Monitor;
use tpg_trainer::pool::Pool;

use crate::convert::{bad_value, text};
use crate::evolution::LOOK_EVERY;
use crate::policy::Policy;

/// Returns, lengths and executed instructions of each episode.
type Scores<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray1<i64>>,
);

/// Full names of the built-in tasks.
#[pyfunction]
pub(crate) fn task_names() -> Vec<&'static str> {
    names().to_vec()
}

/// Runs test episodes of a policy on a built-in task.
#[pyfunction]
#[pyo3(signature = (policy, task, *, observability, disturb, episodes, seed, threads))]
#[allow(clippy::too_many_arguments)]
pub(crate) fn score_native<'py>(
    py: Python<'py>,
    policy: &Policy,
    task: Option<String>,
    observability: Vec<String>,
    disturb: Vec<String>,
    episodes: u32,
    seed: u64,
    threads: usize,
) -> PyResult<Scores<'py>> {
    if episodes == 0 || threads == 0 {
        let what = if episodes == 0 { "episodes" } else { "threads" };
        return Err(PyValueError::new_err(format!("{what} must be at least 1")));
    }
    let parsed = disturb.iter().map(|text| text.parse());
    let disturb = parsed.collect::<Result<_, _>>();
    let arguments = ScoreArgs {
        file: PathBuf::from("the policy"),
        task,
        observability,
        disturb: disturb.map_err(|error| bad_value(&error))?,
        randomize: Randomization::On,
        episodes,
        seed,
        json: false,
    };
    // The pool's agents have a fixed size; the policy's own, which Python uses otherwise, have the size that it needs.
    HostAgent::new(*policy.loaded().policy()).map_err(|error| bad_value(&error))?;
    let setup = arguments.resolve_bytes(policy.loaded().blob().to_vec());
    let setup = setup.map_err(wrong)?;
    let workers = threads.min(episodes as usize);
    let arenas = (0..workers).map(|_| setup.disturbed_arena());
    let arenas = arenas.collect::<Result<_, _>>().map_err(wrong)?;
    let monitor = Arc::new(Monitor::default());
    let pool = Pool::new(arenas).with_monitor(monitor.clone());
    let all = wait(py, pool, &monitor, setup, policy.split())?;
    let each = |of: fn(&Episode) -> i64| all.iter().map(of).collect::<Vec<_>>().into_pyarray(py);
    let returns: Vec<f64> = all.iter().map(|episode| episode.total).collect();
    Ok((
        returns.into_pyarray(py),
        each(|episode| i64::from(episode.steps)),
        each(|episode| episode.instructions as i64),
    ))
}

fn wrong(failure: Failure) -> PyErr {
    PyValueError::new_err(text(&*failure.error))
}

/// Runs the episodes in a thread of their own, so that this one can look whether Python was interrupted.
fn wait(
    py: Python<'_>,
    mut pool: Pool,
    monitor: &Monitor,
    setup: Setup,
    split: Split,
) -> PyResult<Vec<Episode>> {
    let (sender, mut scored) = mpsc::channel();
    let thread = std::thread::Builder::new().name("tpg-scores".into());
    let thread = thread.spawn(move || {
        let seeds: Vec<u64> = setup.episode_seeds().collect();
        let batch = Batch {
            expected: &[0.0],
            make: &|_| Some(setup.blob.clone()),
            episodes: seeds.len(),
            episode_seeds: &seeds,
            split,
            conditions: Conditions::default(),
            record: false,
        };
        // Nobody waits any more if Python was interrupted.
        let _ = sender.send(pool.score(&batch));
    })?;
    let result = loop {
        let scored = &mut scored;
        match py.detach(move || scored.recv_timeout(LOOK_EVERY)) {
            Ok(result) => break result,
            Err(RecvTimeoutError::Timeout) => {
                if let Err(interrupted) = py.check_signals() {
                    monitor.interrupt();
                    // It ends at the next decision, and has nothing to say.
                    let _ = py.detach(move || thread.join());
                    return Err(interrupted);
                }
            }
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err("the thread that scores panicked"));
            }
        }
    };
    let scored = result.map_err(|error: EvaluatorError| PyRuntimeError::new_err(text(&error)))?;
    let episodes = scored.into_iter().flatten().next();
    episodes.ok_or_else(|| PyRuntimeError::new_err("the policy cannot be scored"))
}
