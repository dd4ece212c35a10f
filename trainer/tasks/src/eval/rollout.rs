//! Episodes of a task under a controller, in this process or behind a bridge.

use serde::{Deserialize, Serialize};
use tpg_runtime::{Action, Reset};

use super::{Controller, EpisodeSeeds, Line, Shaping};
use crate::task::{Rng, Task, Wrappers};

/// The result of one episode.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Episode {
    /// Sum of the rewards, in f64 and in step order.
    pub total: f64,
    /// The same of the shaped rewards, which steer training; the total where nothing is shaped.
    pub shaped: f64,
    /// Control steps.
    pub steps: u32,
    /// Instructions that the controller executed.
    pub instructions: u64,
    /// Whether the simulation became unstable, which ended the episode.
    pub unstable: bool,
}

impl Episode {
    /// An episode before its first step.
    pub(super) const BEGUN: Self = Episode {
        total: 0.0,
        shaped: 0.0,
        steps: 0,
        instructions: 0,
        unstable: false,
    };
}

/// How training episodes may be easier than the task. The default is the task as it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Conditions {
    /// Blackouts are `stage`/`stages` times as probable as the task says.
    pub stage: u32,
    /// See `stage`; at least 1.
    pub stages: u32,
    /// Control steps after which an episode ends; 0 stands for the task's own limit, which always holds too.
    pub max_steps: u32,
}

impl Default for Conditions {
    fn default() -> Self {
        Conditions {
            stage: 1,
            stages: 1,
            max_steps: 0,
        }
    }
}

/// A task behind its observability wrappers, with the buffers that an episode needs.
pub struct Arena {
    task: Box<dyn Task>,
    wrappers: Wrappers,
    shaping: Shaping,
    /// What lies between the wrappers and the controller, if it is disturbed.
    line: Option<Line>,
    full: Vec<f32>,
    seen: Vec<f32>,
    /// Control steps after which an episode ends at the latest.
    max_steps: u32,
}

impl Arena {
    /// Puts a task behind wrappers made for its specification.
    #[must_use]
    pub fn new(task: Box<dyn Task>, wrappers: Wrappers) -> Self {
        let full = vec![0.0; task.spec().inputs.len()];
        let seen = vec![0.0; wrappers.inputs().len()];
        let max_steps = task.spec().max_steps;
        Arena {
            max_steps,
            task,
            wrappers,
            shaping: Shaping::default(),
            line: None,
            full,
            seen,
        }
    }

    /// The same with shaped rewards beside the task's own.
    #[must_use]
    pub fn with_shaping(self, shaping: Shaping) -> Self {
        Arena { shaping, ..self }
    }

    /// The same with a disturbed link to the controller.
    #[must_use]
    pub fn with_line(self, line: Line) -> Self {
        let line = Some(line).filter(|line| !line.is_undisturbed());
        Arena { line, ..self }
    }

    /// Runs the episodes that follow under these conditions.
    pub fn impose(&mut self, conditions: Conditions) {
        let Conditions {
            stage,
            stages,
            max_steps,
        } = conditions;
        self.wrappers.ease(stage, stages);
        let all = self.task.spec().max_steps;
        self.max_steps = if max_steps == 0 {
            all
        } else {
            max_steps.min(all)
        };
    }

    /// Another arena like this one, for an episode beside its own; `None` if the task has no [`twin`](Task::twin).
    pub(super) fn twin(&self) -> Option<Self> {
        let twin = Arena::new(self.task.twin()?, self.wrappers.clone());
        let line = self.line.clone();
        Some(Arena { line, ..twin }.with_shaping(self.shaping))
    }

    /// Starts an episode. Returns its seeds.
    pub(super) fn begin(&mut self, episode_seed: u64) -> EpisodeSeeds {
        let mut seeds = EpisodeSeeds::new(episode_seed);
        self.task.reset(&mut seeds.initial_state);
        if let Some(line) = &mut self.line {
            line.seed(seeds.wrappers);
        }
        seeds
    }

    /// Control steps after which an episode ends at the latest.
    pub(super) const fn max_steps(&self) -> u32 {
        self.max_steps
    }

    /// The task.
    #[must_use]
    pub fn task(&self) -> &dyn Task {
        &*self.task
    }

    /// The wrappers, which know what a policy sees.
    #[must_use]
    pub fn wrappers(&self) -> &Wrappers {
        &self.wrappers
    }

    /// Runs one episode; allocates nothing.
    ///
    /// # Errors
    /// The controller's.
    pub fn episode<C: Controller>(
        &mut self,
        controller: &mut C,
        what: Reset,
        episode_seed: u64,
    ) -> Result<Episode, C::Error> {
        let mut seeds = self.begin(episode_seed);
        controller.seed_wrappers(seeds.wrappers);
        controller.reset(what, seeds.agent)?;
        let mut episode = Episode::BEGUN;
        while episode.steps < self.max_steps {
            let seen = self.see(&mut seeds.mask);
            let reply = controller.decide(seen)?;
            episode.instructions += u64::from(reply.instructions);
            if self.act(reply.action, &mut episode) {
                break;
            }
        }
        Ok(episode)
    }

    /// What the controller sees now.
    #[inline]
    pub(super) fn see(&mut self, mask: &mut Rng) -> &[f32] {
        self.task.observe(&mut self.full);
        self.wrappers.apply(&self.full, &mut self.seen, mask);
        match &mut self.line {
            Some(line) => line.observe(&self.seen),
            None => &self.seen,
        }
    }

    /// Advances the task and its episode by one step. Returns whether the task ended the episode.
    #[inline]
    pub(super) fn act(&mut self, action: Action<'_>, episode: &mut Episode) -> bool {
        let action = match &mut self.line {
            Some(line) => line.act(action),
            None => action,
        };
        let step = self.task.step(action);
        episode.total += step.reward;
        episode.shaped += self.shaping.apply(&step);
        episode.steps += 1;
        episode.unstable |= step.unstable;
        step.terminated
    }
}

/// The episodes with these seeds, in order, as one agent's evaluation.
///
/// # Errors
/// The controller's, with the episode that it ended.
pub fn evaluate<C: Controller>(
    arena: &mut Arena,
    controller: &mut C,
    episode_seeds: impl IntoIterator<Item = u64>,
) -> Result<Vec<Episode>, EvaluationError<C::Error>> {
    let mut episodes = Vec::new();
    for (k, seed) in episode_seeds.into_iter().enumerate() {
        let what = if k == 0 { Reset::Agent } else { Reset::Episode };
        let episode = arena
            .episode(controller, what, seed)
            .map_err(|source| EvaluationError { episode: k, source })?;
        episodes.push(episode);
    }
    Ok(episodes)
}

/// A controller that failed during an evaluation.
#[derive(Debug, thiserror::Error)]
#[error("episode {episode} was cut short")]
pub struct EvaluationError<E> {
    /// Number of the episode, from 0.
    pub episode: usize,
    /// What the controller reported.
    pub source: E,
}
