//! The evaluator that hands out its batches and waits for somebody else's answers.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender};

use tpg_tasks::eval::Episode;
use tpg_tasks::task::{Spec, Wrappers};
use tpg_trainer::evaluator::{Alone, AloneScore, Batch, Evaluator, EvaluatorError, Split};
use tpg_trainer::front_end::Recording;
use tpg_trainer::monitor::Monitor;
use tpg_trainer::session::GenerationReport;

use crate::agent::Loaded;
use crate::batch::{Answer, Asked};

/// What the thread that evolves says.
pub(crate) enum Event {
    /// It waits for the answer to this.
    Asked(Arc<Asked>),
    /// A generation is complete.
    Generation(Box<GenerationReport>),
    /// It ended, because this failed if anything did.
    Ended(Option<String>),
}

/// Asks others for scores.
pub(crate) struct Asking {
    pub(crate) monitor: Arc<Monitor>,
    pub(crate) events: Sender<Event>,
    pub(crate) answers: Receiver<Answer>,
    pub(crate) spec: Arc<Spec>,
    pub(crate) wrappers: Wrappers,
    /// Whether the run hides parts of the observation.
    pub(crate) hides: bool,
    pub(crate) recordings: Vec<Recording>,
}

impl Asking {
    fn ask(&mut self, asked: Asked) -> Result<Answer, EvaluatorError> {
        let asked = Event::Asked(Arc::new(asked));
        // Who asks for no more batches has closed the run.
        self.events
            .send(asked)
            .map_err(|_| EvaluatorError::Stopped)?;
        let mut answer = self.answers.recv().map_err(|_| EvaluatorError::Stopped)?;
        self.recordings.append(&mut answer.recordings);
        Ok(answer)
    }
}

impl Evaluator for Asking {
    fn monitor(&self) -> &Arc<Monitor> {
        &self.monitor
    }

    fn score(&mut self, batch: &Batch<'_>) -> Result<Vec<Option<Vec<Episode>>>, EvaluatorError> {
        let policies = batch.expected.len();
        let (mut asked_for, mut numbers) = (Vec::new(), Vec::new());
        for number in 0..policies {
            if self.monitor.stopped() {
                return Err(EvaluatorError::Stopped);
            }
            let blob = (batch.make)(number);
            if let Some(policy) = blob.and_then(|blob| Loaded::check(blob.into()).ok()) {
                asked_for.push(policy);
                numbers.push(number);
            }
        }
        let mut scored = vec![None; policies];
        if asked_for.is_empty() {
            return Ok(scored);
        }
        let answer = self.ask(Asked {
            policies: asked_for,
            expected: numbers.iter().map(|k| batch.expected[*k]).collect(),
            episodes: batch.episodes,
            episode_seeds: batch.episode_seeds.to_vec(),
            numbers: numbers.clone(),
            split: batch.split,
            conditions: batch.conditions,
            record: batch.record,
            alone: false,
            spec: self.spec.clone(),
            wrappers: self.wrappers.clone(),
            hides: self.hides,
            monitor: self.monitor.clone(),
        })?;
        for (number, episodes) in numbers.into_iter().zip(answer.episodes) {
            scored[number] = Some(episodes);
        }
        Ok(scored)
    }

    fn score_alone(&mut self, alone: &Alone<'_>) -> Result<Option<AloneScore>, EvaluatorError> {
        if self.monitor.stopped() {
            return Err(EvaluatorError::Stopped);
        }
        let Ok(policy) = Loaded::check(alone.blob.into()) else {
            return Ok(None);
        };
        let answer = self.ask(Asked {
            policies: vec![policy],
            expected: vec![0.0],
            episodes: alone.episode_seeds.len(),
            episode_seeds: alone.episode_seeds.to_vec(),
            numbers: vec![0],
            split: Split::Agents,
            conditions: alone.conditions,
            record: alone.record,
            alone: true,
            spec: self.spec.clone(),
            wrappers: self.wrappers.clone(),
            hides: self.hides,
            monitor: self.monitor.clone(),
        })?;
        let episodes = answer.episodes.into_iter().next();
        Ok(episodes.map(|episodes| (episodes, answer.memory)))
    }

    fn take_recordings(&mut self) -> Vec<Recording> {
        std::mem::take(&mut self.recordings)
    }
}
