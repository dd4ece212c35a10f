//! An episode as states of the simulator, taken while it runs.
//!
//! The arena's loop stays as it is: the task in it is wrapped, and the wrapper keeps the states that will be drawn.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use mujoco_rs::prelude::MjtState;
use tpg_runtime::Action;

use crate::task::{Rng, Spec, Step, Task};

/// Simulated time from picture to picture, in microseconds: what a picture of 4 hundredths of a second takes in a GIF.
const PICTURE_US: u64 = 40_000;
/// What a picture depends on, in MuJoCo's words.
pub(super) const DRAWN: u32 = MjtState::mjSTATE_QPOS as u32
    | MjtState::mjSTATE_ACT as u32
    | MjtState::mjSTATE_MOCAP_POS as u32
    | MjtState::mjSTATE_MOCAP_QUAT as u32;

/// The pictures to be drawn.
#[derive(Debug, Default)]
pub(super) struct Film {
    pub(super) pictures: Vec<Moment>,
}

/// One moment of an episode.
#[derive(Debug)]
pub(super) struct Moment {
    /// Since the episode began.
    pub(super) hundredths: u64,
    /// What the picture depends on.
    pub(super) state: Box<[f64]>,
}

/// A film for one of the two that have it. A poisoned one is as good as any: it is only added to.
pub(super) fn lock(film: &Mutex<Film>) -> MutexGuard<'_, Film> {
    film.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A task that is filmed.
pub(super) struct FilmedTask {
    task: Box<dyn Task>,
    steps: u64,
    film: Arc<Mutex<Film>>,
}

impl FilmedTask {
    pub(super) fn new(task: Box<dyn Task>, film: Arc<Mutex<Film>>) -> Self {
        FilmedTask {
            task,
            steps: 0,
            film,
        }
    }

    /// Keeps the state that the task is in, at the first step of each picture's time.
    fn note(&self) {
        let period = u64::from(self.task.spec().period_us);
        if !is_due(self.steps, period) {
            return;
        }
        if let Some(simulation) = self.task.simulation() {
            lock(&self.film).pictures.push(Moment {
                hundredths: (self.steps * period + 5_000) / 10_000,
                state: simulation.state(DRAWN),
            });
        }
    }
}

/// Whether the time of a picture came in the last step, of this many so far.
fn is_due(steps: u64, period_us: u64) -> bool {
    let pictures = |steps: u64| steps * period_us / PICTURE_US;
    steps == 0 || pictures(steps) > pictures(steps - 1)
}

impl Task for FilmedTask {
    fn spec(&self) -> &Spec {
        self.task.spec()
    }

    fn reset(&mut self, rng: &mut Rng) {
        self.task.reset(rng);
        self.steps = 0;
        self.note();
    }

    fn observe(&self, observation: &mut [f32]) {
        self.task.observe(observation);
    }

    fn step(&mut self, action: Action<'_>) -> Step {
        let step = self.task.step(action);
        self.steps += 1;
        // A state that the simulator lost cannot be drawn.
        if !step.unstable {
            self.note();
        }
        step
    }

    fn instability(&self) -> Option<String> {
        self.task.instability()
    }
}
