//! The episodes of a batch, side by side in environments that step together.

use std::sync::Arc;

use numpy::{IntoPyArray as _, PyArray1, PyArray2, PyArrayMethods as _};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use tpg_runtime::Reset;
use tpg_tasks::eval::{Episode, EpisodeSeeds};
use tpg_tasks::task::Wrappers;
use tpg_trainer::evaluator::{Job, jobs};
use tpg_trainer::front_end::{Recorder, Recording};

use crate::agent::Agent;
use crate::batch::{Answer, Asked, env_seed, episode};
use crate::convert::{Numbers, check_shape, flags};
use crate::policy::{Actions, Kind};

/// What one environment is busy with.
struct Lane {
    agent: Agent,
    job: Job,
    /// Episodes of the job that are done.
    done: Vec<Episode>,
    recordings: Vec<Recording>,
    recorder: Option<Recorder>,
    seeds: EpisodeSeeds,
    total: f64,
    steps: u32,
    instructions: u64,
}

/// The episodes of a batch, side by side in environments that step together.
#[pyclass(module = "tpg._tpg", name = "Rollout")]
pub(crate) struct Rollout {
    asked: Arc<Asked>,
    wrappers: Wrappers,
    jobs: std::vec::IntoIter<Job>,
    lanes: Vec<Option<Lane>>,
    /// Environments that begin an episode, with its seed.
    beginning: Vec<(usize, i64)>,
    finished: Vec<(Job, Vec<Episode>, Vec<Recording>)>,
    memory: Vec<f32>,
    kind: Kind,
    full: Vec<f32>,
    seen: Vec<f32>,
}

impl Rollout {
    pub(crate) fn new(asked: Arc<Asked>, num_envs: usize) -> PyResult<Self> {
        if num_envs == 0 {
            return Err(PyValueError::new_err("num_envs must be at least 1"));
        }
        let jobs = jobs(&asked.expected, asked.episodes, asked.split, num_envs);
        let mut wrappers = asked.wrappers.clone();
        wrappers.ease(asked.conditions.stage, asked.conditions.stages);
        let kind = Kind::of(asked.spec.actions);
        let seen = vec![0.0; wrappers.inputs().len()];
        let mut rollout = Rollout {
            wrappers,
            jobs: jobs.into_iter(),
            lanes: (0..num_envs).map(|_| None).collect(),
            beginning: Vec::new(),
            finished: Vec::new(),
            memory: Vec::new(),
            kind,
            full: Vec::new(),
            seen,
            asked,
        };
        for lane in 0..num_envs {
            rollout.next_job(lane)?;
        }
        Ok(rollout)
    }

    /// Gives an environment the next job, if there is one.
    fn next_job(&mut self, lane: usize) -> PyResult<()> {
        let before = self.lanes[lane].take().map(|lane| lane.agent);
        let Some(job) = self.jobs.next() else {
            return Ok(());
        };
        let asked = &self.asked;
        let policy = &asked.policies[job.policy];
        // Single episodes of one policy often follow on one another. Each resets the agent.
        let agent = match before {
            Some(agent) if Arc::ptr_eq(agent.loaded(), policy) => agent,
            _ => Agent::new(policy.clone()).map_err(PyRuntimeError::new_err)?,
        };
        let recorder = || {
            let inputs = self.wrappers.inputs().len();
            Recorder::new(inputs, asked.spec.actions, asked.max_steps())
        };
        let next = Lane {
            agent,
            job,
            done: Vec::new(),
            recordings: Vec::new(),
            recorder: asked.record.then(recorder),
            seeds: EpisodeSeeds::new(0),
            total: 0.0,
            steps: 0,
            instructions: 0,
        };
        self.lanes[lane] = Some(next);
        self.begin(lane);
        Ok(())
    }

    /// Begins the next episode of an environment's job.
    fn begin(&mut self, number: usize) {
        let Some(lane) = &mut self.lanes[number] else {
            return;
        };
        let seed = self.asked.seeds(&lane.job)[lane.done.len()];
        lane.seeds = EpisodeSeeds::new(seed);
        let env_seed = env_seed(&mut lane.seeds);
        let what = match lane.done.is_empty() {
            true => Reset::Agent,
            false => Reset::Episode,
        };
        lane.agent.reset(what, lane.seeds.agent);
        if let Some(recorder) = &mut lane.recorder {
            recorder.begin();
        }
        (lane.total, lane.steps, lane.instructions) = (0.0, 0, 0);
        self.beginning.push((number, env_seed));
    }

    /// Ends an environment's episode, and begins another one.
    fn end(&mut self, number: usize) -> PyResult<()> {
        let Some(lane) = &mut self.lanes[number] else {
            return Ok(());
        };
        self.asked.monitor.count(lane.steps);
        let recording = lane.recorder.as_ref().map(Recorder::finish);
        lane.recordings.extend(recording);
        lane.done
            .push(episode(lane.total, lane.steps, lane.instructions));
        if lane.done.len() < lane.job.episodes {
            self.begin(number);
            return Ok(());
        }
        if self.asked.alone {
            self.memory = lane.agent.memory();
        }
        let done = std::mem::take(&mut lane.done);
        let recordings = std::mem::take(&mut lane.recordings);
        self.finished.push((lane.job, done, recordings));
        self.next_job(number)
    }

    /// The answer, once all episodes are done; a rollout gives it once.
    pub(crate) fn answer(&mut self, asked: &Arc<Asked>) -> PyResult<Answer> {
        if !Arc::ptr_eq(&self.asked, asked) {
            return Err(PyValueError::new_err(
                "this rollout is of another batch than the one that is asked for",
            ));
        }
        if !self.done() {
            return Err(PyValueError::new_err(
                "the rollout is not done: step it until rollout.done",
            ));
        }
        let mut finished = std::mem::take(&mut self.finished);
        finished.sort_unstable_by_key(|(job, ..)| (job.policy, job.first_episode));
        let mut answer = Answer {
            episodes: vec![Vec::new(); asked.policies.len()],
            recordings: Vec::new(),
            memory: std::mem::take(&mut self.memory),
        };
        for (job, episodes, recordings) in finished {
            answer.episodes[job.policy].extend(episodes);
            answer.recordings.extend(recordings);
        }
        Ok(answer)
    }
}

#[pymethods]
impl Rollout {
    #[getter]
    fn done(&self) -> bool {
        self.lanes.iter().all(Option::is_none)
    }

    /// Returns, lengths and executed instructions of each policy's episodes, once all are done.
    #[expect(clippy::type_complexity, reason = "three arrays")]
    fn results<'py>(
        &mut self,
        py: Python<'py>,
    ) -> PyResult<(
        Bound<'py, PyArray2<f64>>,
        Bound<'py, PyArray2<i64>>,
        Bound<'py, PyArray2<i64>>,
    )> {
        let asked = self.asked.clone();
        let shape = [asked.policies.len(), asked.episodes];
        let all = self.answer(&asked)?.episodes.concat();
        let returns: Vec<f64> = all.iter().map(|episode| episode.total).collect();
        let lengths: Vec<i64> = all.iter().map(|episode| i64::from(episode.steps)).collect();
        let instructions: Vec<i64> = all
            .iter()
            .map(|episode| episode.instructions as i64)
            .collect();
        Ok((
            returns.into_pyarray(py).reshape(shape)?,
            lengths.into_pyarray(py).reshape(shape)?,
            instructions.into_pyarray(py).reshape(shape)?,
        ))
    }

    #[getter]
    fn active<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        let active: Vec<bool> = self.lanes.iter().map(Option::is_some).collect();
        active.into_pyarray(py)
    }

    /// Environments that begin an episode, with its seed; forgotten by asking.
    fn beginning(&mut self) -> Vec<(usize, i64)> {
        std::mem::take(&mut self.beginning)
    }

    #[pyo3(signature = (observations, ready=None))]
    fn act(
        &mut self,
        py: Python<'_>,
        observations: &Bound<'_, PyAny>,
        ready: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Py<PyAny>> {
        let (rows, inputs) = (self.lanes.len(), self.asked.spec.inputs.len());
        let ready = flags(ready, "ready", rows)?;
        let numbers = Numbers::new(observations, "observations")?;
        check_shape("observations", numbers.shape(), &[rows, inputs])?;
        numbers.rounded_into(&mut self.full);
        drop(numbers);
        let mut actions = Actions::new(self.kind, rows);
        let decided = py.detach(|| {
            let observations = self.full.chunks_exact(inputs);
            for (row, ((lane, full), ready)) in self
                .lanes
                .iter_mut()
                .zip(observations)
                .zip(ready)
                .enumerate()
            {
                let Some(lane) = lane.as_mut().filter(|_| ready) else {
                    continue;
                };
                let seen = match self.asked.hides {
                    true => {
                        self.wrappers
                            .apply(full, &mut self.seen, &mut lane.seeds.mask);
                        &self.seen
                    }
                    false => full,
                };
                let (recorder, instructions) = (&mut lane.recorder, &mut lane.instructions);
                lane.agent.decide(seen, |decision| {
                    if let Some(recorder) = recorder {
                        recorder.see(seen, decision.action);
                    }
                    *instructions += u64::from(decision.instructions);
                    actions.set(row, decision.action);
                })?;
            }
            Ok::<_, tpg_runtime::ObservationError>(())
        });
        decided.map_err(|error| PyValueError::new_err(error.to_string()))?;
        actions.into_python(py)
    }

    /// Takes the outcome of a step of all environments. Returns how many episodes it ended.
    #[pyo3(signature = (rewards, done, ready=None))]
    fn step(
        &mut self,
        rewards: &Bound<'_, PyAny>,
        done: &Bound<'_, PyAny>,
        ready: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<usize> {
        let rows = self.lanes.len();
        let (ready, done) = (
            flags(ready, "ready", rows)?,
            flags(Some(done), "done", rows)?,
        );
        let numbers = Numbers::new(rewards, "rewards")?;
        check_shape("rewards", numbers.shape(), &[rows])?;
        let rewards = numbers.to_f64();
        let max_steps = self.asked.max_steps();
        let mut over = Vec::new();
        for (row, lane) in self.lanes.iter_mut().enumerate() {
            let Some(lane) = lane.as_mut().filter(|_| ready[row]) else {
                continue;
            };
            if !rewards[row].is_finite() {
                return Err(PyValueError::new_err(format!(
                    "the reward of environment {row} is {} in step {} of its episode",
                    rewards[row],
                    lane.steps + 1
                )));
            }
            lane.total += rewards[row];
            lane.steps += 1;
            if done[row] || lane.steps >= max_steps {
                over.push(row);
            }
        }
        let ended = over.len();
        over.into_iter().try_for_each(|row| self.end(row))?;
        Ok(ended)
    }
}
