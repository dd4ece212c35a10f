//! A run that asks for scores and is told them.
//!
//! Evolution calls whoever evaluates, and Python calls evolution: so the run has a thread of its own, which sends each batch
//! out and sleeps until the answer comes. The thread never needs Python.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use pyo3::exceptions::{PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use tpg_tasks::task::{Spec, Wrappers};
use tpg_trainer::config::{Preset, presets, resolve};
use tpg_trainer::evaluator::Evaluator as _;
use tpg_trainer::monitor::Monitor;
use tpg_trainer::run_folder::{Keep, Origin, RunFolder, RunFolderError};
use tpg_trainer::session::{
    Budget, GenerationReport, LogMark, Session, SessionError, Snapshot, load_external,
};

use crate::batch::{Answer, Asked, Batch};
use crate::convert::{bad_value, failed, text};
use crate::evaluator::{Asking, Event};
use crate::rollout::Rollout;
use crate::task::{Described, in_words, spec};

/// How often a wait looks whether Python was interrupted.
pub(crate) const LOOK_EVERY: Duration = Duration::from_millis(100);

/// What is known of the run since its last complete generation.
struct Latest {
    snapshot: Snapshot,
    champion: Option<Vec<u8>>,
    generation: u64,
    steps: u64,
    seconds: f64,
}

impl Latest {
    fn of(session: &Session) -> Self {
        Latest {
            snapshot: Snapshot::new(session),
            champion: session.export_champion().ok(),
            generation: session.generation(),
            steps: session.steps(),
            seconds: session.seconds(),
        }
    }
}

/// A run, evolved by a thread of its own.
#[pyclass(subclass, module = "tpg._tpg", name = "Evolution")]
pub(crate) struct Evolution {
    latest: Arc<Mutex<Latest>>,
    monitor: Arc<Monitor>,
    /// Dropped to end the thread.
    answers: Option<Sender<Answer>>,
    /// Behind a lock only because Python's objects are shared between threads.
    events: Mutex<Receiver<Event>>,
    asked: Option<Arc<Asked>>,
    thread: Option<JoinHandle<()>>,
    spec: Arc<Spec>,
    config: String,
    seed: u64,
}

/// An exception of the class that Python's own would have.
fn folder_error(error: &RunFolderError) -> PyErr {
    match error {
        RunFolderError::Write { .. } => PyOSError::new_err(text(error)),
        _ => bad_value(error),
    }
}

fn budget(kind: &str, amount: f64) -> Budget {
    match kind {
        "steps" => Budget::Steps(amount as u64),
        "minutes" => Budget::Minutes(amount),
        _ => Budget::Generations(amount as u64),
    }
}

#[pymethods]
impl Evolution {
    /// `source` is a preset's name, and begins a run; or None, and goes on with the run of `folder` or of `checkpoint`.
    #[new]
    #[pyo3(signature = (source, task, *, file=None, settings=vec![], seed=0, folder=None, checkpoint=None, keep=(1, 0, 20),
        budget=("generations", 100.0), command=vec![]))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        py: Python<'_>,
        source: Option<&str>,
        task: Described,
        file: Option<&str>,
        settings: Vec<String>,
        seed: u64,
        folder: Option<PathBuf>,
        checkpoint: Option<PathBuf>,
        keep: (u64, usize, u64),
        budget: (&str, f64),
        command: Vec<String>,
    ) -> PyResult<Self> {
        let spec = spec(task)?;
        let budget = self::budget(budget.0, budget.1);
        let session = match (source, &checkpoint) {
            (Some(preset), _) => {
                let found = Preset::find(preset).map_err(|error| bad_value(&error))?;
                let config = resolve(&found, file, &settings).map_err(|error| bad_value(&error))?;
                let session = Session::external(config, seed, &spec);
                session.map_err(|error| bad_value(&error))?
            }
            (None, Some(path)) => load_checkpoint(path, &spec)?,
            (None, None) => {
                let path = folder.as_deref().unwrap_or(Path::new(""));
                let opened = RunFolder::open_external(path, false, &spec);
                let (folder, session, _) = opened.map_err(|error| folder_error(&error))?;
                return Evolution::begin(py, session, Some(folder), spec);
            }
        };
        let folder = match folder {
            None => None,
            Some(path) => {
                let origin = Origin {
                    preset: source.unwrap_or("").into(),
                    budget,
                    command,
                    keep: Keep {
                        log_every: keep.0,
                        champions: keep.1,
                        checkpoint_every: keep.2,
                    },
                    // Episodes are run by Python.
                    threads: 1,
                    commit: option_env!("TPG_COMMIT").map(str::to_owned),
                };
                let made = RunFolder::create(&path, &session, origin);
                Some(made.map_err(|error| folder_error(&error))?)
            }
        };
        Evolution::begin(py, session, folder, spec)
    }

    /// The batch that waits for an answer; waits until there is one.
    fn ask(&mut self, py: Python<'_>) -> PyResult<Option<Batch>> {
        while self.asked.is_none() {
            // Reports were taken by who told.
            self.wait(py)?;
        }
        Ok(self.asked.clone().map(|asked| Batch { asked }))
    }

    /// Answers the batch; the report of the generation if that completes it.
    #[pyo3(signature = (answer, lengths=None))]
    fn tell<'py>(
        &mut self,
        py: Python<'py>,
        answer: &Bound<'py, PyAny>,
        lengths: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(asked) = self.asked.clone() else {
            return Err(PyRuntimeError::new_err(
                "nothing was asked, so there is nothing to tell: call ask first",
            ));
        };
        let answer = match (answer.cast::<Rollout>(), lengths) {
            (Ok(rollout), None) => rollout.borrow_mut().answer(&asked)?,
            (_, Some(lengths)) => Batch { asked }.answer(answer, lengths)?,
            (Err(_), None) => {
                return Err(PyValueError::new_err(
                    "tell a rollout that is done, or two arrays: returns and lengths",
                ));
            }
        };
        let sent = self.answers.as_ref().map(|answers| answers.send(answer));
        if !matches!(sent, Some(Ok(()))) {
            return Err(closed());
        }
        self.asked = None;
        let report = self.wait(py)?;
        report.map(|report| report_dict(py, &report)).transpose()
    }

    /// Ends the run: a generation that is not complete counts for nothing. Writes the folder's last checkpoint.
    fn close(&mut self, py: Python<'_>) -> PyResult<()> {
        self.monitor.interrupt();
        self.answers = None;
        self.asked = None;
        let Some(thread) = self.thread.take() else {
            return Ok(());
        };
        py.detach(|| thread.join())
            .map_err(|_| PyRuntimeError::new_err("the thread that evolves panicked"))?;
        let events = self.events.lock().unwrap_or_else(PoisonError::into_inner);
        let failed = events.try_iter().find_map(|event| match event {
            Event::Ended(Some(why)) => Some(why),
            _ => None,
        });
        failed.map_or(Ok(()), |why| Err(PyRuntimeError::new_err(why)))
    }

    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let snapshot = self.latest(|latest| latest.snapshot.clone());
        let task = ("the spaces".to_owned(), in_words(&self.spec));
        py.detach(|| snapshot.save(&path, vec![task], LogMark::default()))
            .map_err(|error| PyOSError::new_err(text(&error)))
    }

    fn _champion<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyBytes>> {
        let blob = self.latest(|latest| latest.champion.clone());
        blob.map(|blob| PyBytes::new(py, &blob))
    }

    #[getter]
    fn generation(&self) -> u64 {
        self.latest(|latest| latest.generation)
    }

    #[getter]
    fn steps(&self) -> u64 {
        self.latest(|latest| latest.steps)
    }

    #[getter]
    fn seconds(&self) -> f64 {
        self.latest(|latest| latest.seconds)
    }

    #[getter]
    const fn seed(&self) -> u64 {
        self.seed
    }

    #[getter]
    fn config(&self) -> &str {
        &self.config
    }

    /// Episodes done in this generation, and those it is known to need.
    #[getter]
    fn progress(&self) -> (u64, u64) {
        let progress = self.monitor.progress();
        (progress.episodes, progress.planned)
    }
}

impl Evolution {
    fn begin(
        py: Python<'_>,
        session: Session,
        folder: Option<RunFolder>,
        spec: Spec,
    ) -> PyResult<Self> {
        let settings = session.settings();
        let wrappers = Wrappers::new(&settings.observability, &spec);
        let (answers, receiver) = mpsc::channel();
        let (sender, events) = mpsc::channel();
        let spec = Arc::new(spec);
        let monitor = Arc::new(Monitor::default());
        let asking = Asking {
            monitor: monitor.clone(),
            events: sender,
            answers: receiver,
            spec: spec.clone(),
            wrappers: wrappers.map_err(|error| bad_value(&error))?,
            hides: !settings.observability.is_empty(),
            recordings: Vec::new(),
        };
        let config = toml::to_string(session.config()).map_err(|error| failed(&error))?;
        let seed = session.seed();
        let latest = Arc::new(Mutex::new(py.detach(|| Latest::of(&session))));
        let shared = latest.clone();
        let thread = std::thread::Builder::new()
            .name("tpg-evolution".into())
            .spawn(move || evolve(session, folder, asking, &shared))?;
        Ok(Evolution {
            latest,
            monitor,
            answers: Some(answers),
            events: Mutex::new(events),
            asked: None,
            thread: Some(thread),
            spec,
            config,
            seed,
        })
    }

    fn latest<T>(&self, look: impl FnOnce(&Latest) -> T) -> T {
        look(&self.latest.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Waits for what the thread says next: a batch, which is kept, or a generation's report.
    fn wait(&mut self, py: Python<'_>) -> PyResult<Option<GenerationReport>> {
        loop {
            let events = self
                .events
                .get_mut()
                .unwrap_or_else(PoisonError::into_inner);
            match py.detach(move || events.recv_timeout(LOOK_EVERY)) {
                Ok(Event::Asked(asked)) => {
                    self.asked = Some(asked);
                    return Ok(None);
                }
                Ok(Event::Generation(report)) => return Ok(Some(*report)),
                Ok(Event::Ended(Some(why))) => return Err(PyRuntimeError::new_err(why)),
                Ok(Event::Ended(None)) | Err(RecvTimeoutError::Disconnected) => {
                    return Err(closed());
                }
                Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            }
        }
    }
}

impl Drop for Evolution {
    fn drop(&mut self) {
        // The thread ends by itself as soon as it notices.
        self.monitor.interrupt();
    }
}

fn closed() -> PyErr {
    PyRuntimeError::new_err("the evolution is closed")
}

fn load_checkpoint(path: &Path, spec: &Spec) -> PyResult<Session> {
    let loaded = load_external(path, spec).map_err(|error| bad_value(&error))?;
    let now = in_words(spec);
    match loaded.task_files.first() {
        Some((_, before)) if *before != now => Err(PyValueError::new_err(format!(
            "{} was written for another environment: {before}, not {now}",
            path.display()
        ))),
        _ => Ok(loaded.session),
    }
}

/// Evolves until the evaluator is stopped.
fn evolve(
    mut session: Session,
    mut folder: Option<RunFolder>,
    mut asking: Asking,
    latest: &Mutex<Latest>,
) {
    let events = asking.events.clone();
    let why = loop {
        if asking.monitor().stopped() {
            break None;
        }
        match session.advance(&mut asking) {
            Ok(report) => {
                let now = Latest::of(&session);
                *latest.lock().unwrap_or_else(PoisonError::into_inner) = now;
                let recorded = folder
                    .as_mut()
                    .map(|folder| folder.record(&session, &report));
                // Nobody listens any more if the run was closed.
                let _ = events.send(Event::Generation(Box::new(report)));
                if let Some(Err(error)) = recorded {
                    break Some(text(&error));
                }
            }
            Err(SessionError::Stopped) => break None,
            Err(error) => break Some(text(&error)),
        }
    };
    let finished = folder.as_mut().map(|folder| folder.finish(&session));
    let why = why.or_else(|| finished.and_then(Result::err).map(|error| text(&error)));
    let _ = events.send(Event::Ended(why));
}

/// A report with its columns as keys.
fn report_dict<'py>(py: Python<'py>, report: &GenerationReport) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let table = toml::Table::try_from(report).map_err(|error| failed(&error))?;
    for (key, value) in &table {
        match value {
            toml::Value::Integer(n) => dict.set_item(key, n)?,
            toml::Value::Float(x) => dict.set_item(key, x)?,
            other => dict.set_item(key, other.to_string())?,
        }
    }
    if report.select.is_none() {
        dict.set_item("select", f64::NAN)?;
    }
    dict.set_item("episodes", report.episodes)?;
    Ok(dict)
}

/// Names of all presets that name a task, then of those that do not.
#[pyfunction]
pub(crate) fn preset_names() -> PyResult<Vec<String>> {
    let all = presets().map_err(|error| failed(&error))?;
    let mut names: Vec<String> = all.iter().map(|preset| preset.name.clone()).collect();
    for preset in &all {
        let bare = preset
            .name
            .strip_prefix(preset.task)
            .and_then(|rest| rest.strip_prefix('-'));
        if let Some(bare) = bare.filter(|bare| Preset::find(bare).is_ok())
            && !names.iter().any(|name| name == bare)
        {
            names.push(bare.to_owned());
        }
    }
    Ok(names)
}
