//! Recordings of a loop: one row a step, as CSV or MCAP.
//!
//! Rows are kept in memory that is taken before the loop starts, and written between episodes, when the clock rests.

mod csv;
mod mcap;
mod path;

use std::fmt;
use std::io;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use tpg_runtime::{Action, Reset};
use tpg_tasks::eval::{Controller, Reply};

use crate::error::BridgeError;
use crate::step::{Source, Step, Stepping};
use csv::CsvSink;
use mcap::McapSink;
pub use path::{Format, RecordPath};

/// What a recording is about.
#[derive(Debug, Clone, Default)]
pub struct Subject {
    /// Name and unit of each input.
    pub inputs: Vec<(String, String)>,
    /// Name and unit of each output; of a discrete policy the one index.
    pub outputs: Vec<(String, String)>,
    /// Control period, in microseconds.
    pub period_us: u32,
    /// Most steps of an episode.
    pub max_steps: u32,
    /// What else belongs to it, such as the task, by name.
    pub notes: Vec<(String, String)>,
}

/// A step as it is kept until the episode has ended.
#[derive(Debug, Clone, Copy)]
struct Row {
    /// Number of the episode, from 0.
    episode: u32,
    /// Number of the step in its episode, from 0.
    step: u32,
    /// When the observation was sent, in nanoseconds since the recording began.
    sent_ns: u64,
    /// Round trip, in nanoseconds; none on a miss.
    latency_ns: Option<u64>,
    source: Source,
    /// Instructions executed for the decision; 0 on a miss.
    instructions: u32,
}

impl Row {
    /// Simulated time since the episode began, in seconds.
    fn time_s(&self, subject: &Subject) -> f64 {
        f64::from(self.step) * f64::from(subject.period_us) / 1e6
    }
}

enum Sink {
    Csv(Box<CsvSink>),
    Mcap(Box<McapSink>),
}

/// Keeps the steps of an episode and writes them after it.
pub struct Recorder {
    path: String,
    sink: Sink,
    subject: Subject,
    /// The clock's zero.
    began: Instant,
    /// The same in nanoseconds since 1970.
    began_unix_ns: u64,
    rows: Vec<Row>,
    /// Observation and action of each row.
    values: Vec<f32>,
    episode: u32,
    /// Whether an episode has begun.
    running: bool,
}

impl fmt::Debug for Recorder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Recorder")
            .field("path", &self.path)
            .field("rows", &self.rows.len())
            .finish_non_exhaustive()
    }
}

impl Recorder {
    /// Creates the file, and takes the memory for an episode.
    ///
    /// # Errors
    /// [`BridgeError::Record`] if the file cannot be created or there is not enough memory.
    pub fn create(place: &RecordPath, subject: Subject) -> Result<Self, BridgeError> {
        let path = place.path.display().to_string();
        let failed = |source: io::Error| BridgeError::Record {
            path: path.clone(),
            source,
        };
        let (mut rows, mut values) = (Vec::new(), Vec::new());
        let steps = subject.max_steps as usize;
        let width = subject.inputs.len() + subject.outputs.len();
        let memory = rows.try_reserve_exact(steps);
        let memory = memory.and_then(|()| values.try_reserve_exact(steps.saturating_mul(width)));
        memory.map_err(|_| {
            failed(io::Error::new(
                io::ErrorKind::OutOfMemory,
                format!("no memory for episodes of {steps} steps"),
            ))
        })?;
        let began_unix_ns = (SystemTime::now().duration_since(UNIX_EPOCH))
            .map_or(0, |time| u64::try_from(time.as_nanos()).unwrap_or(u64::MAX));
        let sink = match place.format {
            Format::Csv => {
                CsvSink::create(&place.path, &subject).map(|sink| Sink::Csv(Box::new(sink)))
            }
            Format::Mcap => {
                McapSink::create(&place.path, &subject).map(|s| Sink::Mcap(Box::new(s)))
            }
        };
        Ok(Recorder {
            sink: sink.map_err(failed)?,
            path,
            subject,
            began: Instant::now(),
            began_unix_ns,
            rows,
            values,
            episode: 0,
            running: false,
        })
    }

    /// Writes the episode that has ended, and begins the next one.
    ///
    /// # Errors
    /// [`BridgeError::Record`].
    pub fn begin_episode(&mut self) -> Result<(), BridgeError> {
        if self.running {
            self.write()?;
            self.episode += 1;
        }
        self.running = true;
        Ok(())
    }

    /// Keeps a step. Allocates and writes nothing; steps beyond the most of an episode are left out.
    pub fn keep(&mut self, observation: &[f32], action: Action<'_>, instructions: u32, step: Step) {
        let width = self.width();
        let inputs = self.subject.inputs.len();
        if self.rows.len() >= self.subject.max_steps as usize {
            return;
        }
        let ns = |time: std::time::Duration| u64::try_from(time.as_nanos()).unwrap_or(u64::MAX);
        let begin = self.values.len();
        self.values.resize(begin + width, f32::NAN);
        let (seen, done) = self.values[begin..].split_at_mut(inputs);
        copy(observation, seen);
        match action {
            Action::Discrete(index) => copy(&[f32::from(index)], done),
            Action::Continuous(values) => copy(values, done),
        }
        self.rows.push(Row {
            episode: self.episode,
            step: u32::try_from(self.rows.len()).unwrap_or(u32::MAX),
            sent_ns: ns(step.sent.saturating_duration_since(self.began)),
            latency_ns: step.latency.map(ns),
            source: step.source,
            instructions,
        });
    }

    /// Writes what is left and completes the file.
    ///
    /// # Errors
    /// [`BridgeError::Record`].
    pub fn finish(&mut self) -> Result<(), BridgeError> {
        self.write()?;
        let finished = match &mut self.sink {
            Sink::Csv(sink) => sink.finish(),
            Sink::Mcap(sink) => sink.finish(),
        };
        finished.map_err(|source| self.failed(source))
    }

    fn width(&self) -> usize {
        self.subject.inputs.len() + self.subject.outputs.len()
    }

    fn write(&mut self) -> Result<(), BridgeError> {
        let (width, inputs) = (self.width(), self.subject.inputs.len());
        let mut written = Ok(());
        for (row, values) in self.rows.iter().zip(self.values.chunks(width.max(1))) {
            let (seen, done) = values.split_at(inputs.min(values.len()));
            let unix_ns = self.began_unix_ns.saturating_add(row.sent_ns);
            written = match &mut self.sink {
                Sink::Csv(sink) => sink.write(&self.subject, row, unix_ns, seen, done),
                Sink::Mcap(sink) => sink.write(&self.subject, row, unix_ns, seen, done),
            };
            if written.is_err() {
                break;
            }
        }
        self.rows.clear();
        self.values.clear();
        written.map_err(|source| self.failed(source))
    }

    fn failed(&self, source: io::Error) -> BridgeError {
        BridgeError::Record {
            path: self.path.clone(),
            source,
        }
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        // A loop that broke off leaves what it came to; that error is already told.
        let _ = self.finish();
    }
}

/// Copies what both have.
fn copy(from: &[f32], to: &mut [f32]) {
    for (place, value) in to.iter_mut().zip(from) {
        *place = *value;
    }
}

/// A controller whose steps are recorded, if there is a recorder.
#[derive(Debug)]
pub struct Recorded<C> {
    inner: C,
    recorder: Option<Recorder>,
}

impl<C> Recorded<C> {
    /// Puts a recorder between the disturbances and a controller.
    pub const fn new(inner: C, recorder: Option<Recorder>) -> Self {
        Recorded { inner, recorder }
    }

    /// Completes the recording and gives the controller back.
    ///
    /// # Errors
    /// [`BridgeError::Record`].
    pub fn finish(self) -> Result<C, BridgeError> {
        if let Some(mut recorder) = self.recorder {
            recorder.finish()?;
        }
        Ok(self.inner)
    }
}

impl<C: Controller<Error = BridgeError> + Stepping> Controller for Recorded<C> {
    type Error = BridgeError;

    fn seed_wrappers(&mut self, wrapper_seed: u64) {
        self.inner.seed_wrappers(wrapper_seed);
    }

    fn reset(&mut self, what: Reset, agent_seed: u64) -> Result<(), BridgeError> {
        if let Some(recorder) = &mut self.recorder {
            recorder.begin_episode()?;
        }
        self.inner.reset(what, agent_seed)
    }

    fn decide(&mut self, observation: &[f32]) -> Result<Reply<'_>, BridgeError> {
        let Some(recorder) = &mut self.recorder else {
            return self.inner.decide(observation);
        };
        self.inner.decide(observation)?;
        let (reply, step) = self.inner.last()?;
        recorder.keep(observation, reply.action, reply.instructions, step);
        Ok(reply)
    }
}
