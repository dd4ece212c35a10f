//! What an evaluator tells others while it scores, and what stops it.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

use tpg_runtime::{ObservationError, Reset};
use tpg_tasks::eval::{Controller, Reply};

/// Watches the scoring of a generation, and stops it, from any thread.
#[derive(Debug, Default)]
pub struct Monitor {
    /// Set from outside, such as by a signal; several runs may share it.
    stop: Arc<AtomicBool>,
    /// The time that the run may take is over.
    expired: AtomicBool,
    /// How the first simulation that became unstable did so.
    instability: OnceLock<String>,
    counters: Counters,
}

/// On cache lines of their own: each episode writes them, and each decision reads what stands beside them.
#[derive(Debug, Default)]
#[repr(align(128))]
struct Counters {
    planned: AtomicU64,
    episodes: AtomicU64,
    steps: AtomicU64,
}

/// How far the scoring of a generation is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Episodes that the generation is known to need; a race adds its own when it begins.
    pub planned: u64,
    /// Episodes done in this generation.
    pub episodes: u64,
    /// Control steps of all episodes done since the evaluator was made.
    pub steps: u64,
}

impl Monitor {
    /// A monitor that this flag stops, too.
    #[must_use]
    pub fn new(stop: Arc<AtomicBool>) -> Self {
        Monitor {
            stop,
            ..Monitor::default()
        }
    }

    /// Whether scoring is to end at once.
    #[must_use]
    pub fn stopped(&self) -> bool {
        self.interrupted() || self.expired.load(Ordering::Relaxed)
    }

    /// Whether somebody asked the run to stop, rather than a limit of time.
    #[must_use]
    pub fn interrupted(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Asks the run to stop.
    pub fn interrupt(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// Why the first episode that an unstable simulation ended was ended; `None` if there was none, or if its task does not
    /// say.
    #[must_use]
    pub fn instability(&self) -> Option<&str> {
        self.instability.get().map(String::as_str)
    }

    /// How far the scoring of the generation is.
    #[must_use]
    pub fn progress(&self) -> Progress {
        Progress {
            planned: self.counters.planned.load(Ordering::Relaxed),
            episodes: self.counters.episodes.load(Ordering::Relaxed),
            steps: self.counters.steps.load(Ordering::Relaxed),
        }
    }

    /// Ends scoring because the time is over.
    pub(crate) fn expire(&self) {
        self.expired.store(true, Ordering::Relaxed);
    }

    /// Begins a generation of so many episodes.
    pub fn begin(&self, episodes: u64) {
        self.counters.planned.store(episodes, Ordering::Relaxed);
        self.counters.episodes.store(0, Ordering::Relaxed);
    }

    /// Adds episodes that the generation turns out to need.
    pub fn plan(&self, episodes: u64) {
        self.counters.planned.fetch_add(episodes, Ordering::Relaxed);
    }

    /// Keeps the first reason why a simulation became unstable.
    pub fn note_instability(&self, reason: impl FnOnce() -> Option<String>) {
        if self.instability.get().is_none()
            && let Some(reason) = reason()
        {
            // Another thread may have been first.
            let _ = self.instability.set(reason);
        }
    }

    /// Counts an episode that is done.
    pub fn count(&self, steps: u32) {
        self.counters.episodes.fetch_add(1, Ordering::Relaxed);
        let steps = u64::from(steps);
        self.counters.steps.fetch_add(steps, Ordering::Relaxed);
    }
}

/// A controller that gives up as soon as its monitor says so, in the middle of an episode too.
pub(crate) struct Stoppable<'m, C> {
    pub(crate) inner: C,
    pub(crate) monitor: &'m Monitor,
}

/// Why an episode ended before the task did.
pub(crate) enum EndedEarly {
    /// The monitor stopped it.
    Stopped,
    /// The observation has another length than the policy's.
    Unfit,
}

impl<C: Controller<Error = ObservationError>> Controller for Stoppable<'_, C> {
    type Error = EndedEarly;

    fn seed_wrappers(&mut self, wrapper_seed: u64) {
        self.inner.seed_wrappers(wrapper_seed);
    }

    fn reset(&mut self, what: Reset, agent_seed: u64) -> Result<(), EndedEarly> {
        let reset = self.inner.reset(what, agent_seed);
        reset.map_err(|_| EndedEarly::Unfit)
    }

    fn decide(&mut self, observation: &[f32]) -> Result<Reply<'_>, EndedEarly> {
        if self.monitor.stopped() {
            return Err(EndedEarly::Stopped);
        }
        let reply = self.inner.decide(observation);
        reply.map_err(|_| EndedEarly::Unfit)
    }
}
