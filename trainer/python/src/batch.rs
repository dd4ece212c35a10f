//! What evolution asks to be scored, and episodes of it side by side.

use std::sync::Arc;

use numpy::{IntoPyArray as _, PyArray1, PyArray2, PyArrayMethods as _};
use pyo3::exceptions::{PyIndexError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use tpg_runtime::Reset;
use tpg_tasks::eval::{Conditions, Domain, Episode, EpisodeSeeds, episode_seed};
use tpg_tasks::task::{Spec, Wrappers, parse_stack};
use tpg_trainer::evaluator::{Job, Split, job_seeds, jobs};
use tpg_trainer::front_end::{Recorder, Recording};
use tpg_trainer::monitor::Monitor;

use crate::agent::Agent;
use crate::convert::{Numbers, bad_value, check_shape, flags};
use crate::policy::{Actions, Kind, Policy};
use crate::task::{Described, spec};

/// Seeds of environments are below this, which all of them take.
const ENV_SEED_BITS: u32 = 31;

/// Policies that evolution asks to be scored, with all that their episodes depend on.
pub(crate) struct Asked {
    /// Sound policies.
    pub(crate) blobs: Vec<Arc<[u8]>>,
    /// For each, how long its episodes may be expected to last.
    pub(crate) expected: Vec<f64>,
    /// Episodes of each.
    pub(crate) episodes: usize,
    /// Seeds of the episodes: one list, or several that the policies take in turn.
    pub(crate) episode_seeds: Vec<u64>,
    /// For each policy, its number among those that were asked, which chooses its list.
    pub(crate) numbers: Vec<usize>,
    pub(crate) split: Split,
    pub(crate) conditions: Conditions,
    pub(crate) record: bool,
    /// Whether the memory that the only policy leaves is asked for.
    pub(crate) alone: bool,
    pub(crate) spec: Arc<Spec>,
    /// What hides parts of the observation, and whether anything does.
    pub(crate) wrappers: Wrappers,
    pub(crate) hides: bool,
    pub(crate) monitor: Arc<Monitor>,
}

/// The answer to what was asked, for the same policies.
pub(crate) struct Answer {
    pub(crate) episodes: Vec<Vec<Episode>>,
    pub(crate) recordings: Vec<Recording>,
    pub(crate) memory: Vec<f32>,
}

impl Asked {
    fn seeds(&self, job: &Job) -> &[u64] {
        let policy = self.numbers[job.policy];
        job_seeds(&Job { policy, ..*job }, &self.episode_seeds, self.episodes)
    }

    /// Control steps after which an episode ends.
    fn max_steps(&self) -> u32 {
        let all = self.spec.max_steps;
        match self.conditions.max_steps {
            0 => all,
            steps => steps.min(all),
        }
    }

    /// Why returns are no answer that somebody else found, in words; `None` if they are one.
    fn needs_rollout(&self) -> Option<&'static str> {
        if self.record {
            return Some("the front end learns from what its policies observe");
        }
        if self.alone {
            return Some("each policy passes the memory that it leaves to the next");
        }
        self.hides
            .then_some("the run hides parts of the observation")
    }
}

fn env_seed(seeds: &mut EpisodeSeeds) -> i64 {
    (seeds.initial_state.word() >> (u64::BITS - ENV_SEED_BITS)) as i64
}

/// Policies that evolution asks to be scored.
#[pyclass(module = "tpg._tpg", name = "Batch", frozen)]
pub(crate) struct Batch {
    pub(crate) asked: Arc<Asked>,
}

#[pymethods]
impl Batch {
    /// Test episodes of one policy, the same seeds for every policy.
    #[staticmethod]
    fn _of_policy(
        policy: &Policy,
        task: Described,
        observability: &str,
        episodes: usize,
        seed: u64,
    ) -> PyResult<Self> {
        let spec = spec(task)?;
        let stack = parse_stack(observability).map_err(|error| bad_value(&error))?;
        let wrappers = Wrappers::new(&stack, &spec).map_err(|error| bad_value(&error))?;
        policy.check_fit(wrappers.inputs().len(), &spec)?;
        if episodes == 0 {
            return Err(PyValueError::new_err("episodes must be at least 1"));
        }
        let seeds = (0..episodes as u64).map(|k| episode_seed(Domain::Test, seed, 0, k));
        let split = match policy.episodes_are_independent() {
            true => Split::Episodes,
            false => Split::Agents,
        };
        let asked = Asked {
            blobs: vec![policy.blob()],
            expected: vec![0.0],
            episodes,
            episode_seeds: seeds.collect(),
            numbers: vec![0],
            split,
            conditions: Conditions::default(),
            record: false,
            alone: false,
            spec: Arc::new(spec),
            wrappers,
            hides: true,
            monitor: Arc::default(),
        };
        Ok(Batch {
            asked: Arc::new(asked),
        })
    }

    fn __len__(&self) -> usize {
        self.asked.blobs.len()
    }

    /// The bytes of a policy.
    fn _blob<'py>(&self, py: Python<'py>, number: usize) -> PyResult<Bound<'py, PyBytes>> {
        let blob = self.asked.blobs.get(number).ok_or_else(|| {
            let count = self.asked.blobs.len();
            PyIndexError::new_err(format!(
                "there is no policy {number}: the batch has {count}"
            ))
        })?;
        Ok(PyBytes::new(py, blob))
    }

    #[getter]
    fn episodes(&self) -> usize {
        self.asked.episodes
    }

    #[getter]
    fn max_steps(&self) -> u32 {
        self.asked.max_steps()
    }

    #[getter]
    fn needs_rollout(&self) -> Option<&'static str> {
        self.asked.needs_rollout()
    }

    #[getter]
    fn env_seeds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i64>>> {
        let seeds = self.each_episode(env_seed);
        seeds.into_pyarray(py).reshape(self.shape())
    }

    #[getter]
    fn policy_seeds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u64>>> {
        let seeds = self.each_episode(|seeds| seeds.agent);
        seeds.into_pyarray(py).reshape(self.shape())
    }

    fn rollout(&self, num_envs: usize) -> PyResult<Rollout> {
        Rollout::new(self.asked.clone(), num_envs)
    }
}

impl Batch {
    pub(crate) fn shape(&self) -> [usize; 2] {
        [self.asked.blobs.len(), self.asked.episodes]
    }

    fn each_episode<T>(&self, of: impl Fn(&mut EpisodeSeeds) -> T) -> Vec<T> {
        let mut all = Vec::new();
        for policy in 0..self.asked.blobs.len() {
            let job = Job {
                policy,
                first_episode: 0,
                episodes: self.asked.episodes,
            };
            let seeds = self.asked.seeds(&job).iter();
            all.extend(seeds.map(|seed| of(&mut EpisodeSeeds::new(*seed))));
        }
        all
    }

    /// The answer that an array of returns and one of lengths are.
    pub(crate) fn answer(
        &self,
        returns: &Bound<'_, PyAny>,
        lengths: &Bound<'_, PyAny>,
    ) -> PyResult<Answer> {
        if let Some(why) = self.asked.needs_rollout() {
            return Err(PyValueError::new_err(format!(
                "returns alone are no answer here, because {why}: run the episodes by batch.rollout(num_envs), and tell \
                 the rollout"
            )));
        }
        let [policies, episodes] = self.shape();
        let array = |object, what| {
            let numbers = Numbers::new(object, what)?;
            check_shape(what, numbers.shape(), &[policies, episodes])?;
            Ok::<_, PyErr>(numbers.to_f64())
        };
        let (returns, lengths) = (array(returns, "returns")?, array(lengths, "lengths")?);
        let place = |k: usize| format!("of policy {}, episode {}", k / episodes, k % episodes);
        if let Some(k) = returns.iter().position(|x| !x.is_finite()) {
            let (x, place) = (returns[k], place(k));
            return Err(PyValueError::new_err(format!("the return {place} is {x}")));
        }
        let longest = f64::from(u32::MAX);
        if let Some(k) = lengths.iter().position(|x| !(0.0..=longest).contains(x)) {
            let (x, place) = (lengths[k], place(k));
            return Err(PyValueError::new_err(format!(
                "the length {place} is {x}, but must be a number of steps"
            )));
        }
        let all: Vec<Episode> = returns
            .iter()
            .zip(&lengths)
            .map(|(total, steps)| {
                self.asked.monitor.count(*steps as u32);
                episode(*total, *steps as u32, 0)
            })
            .collect();
        Ok(Answer {
            episodes: all.chunks(episodes).map(<[Episode]>::to_vec).collect(),
            recordings: Vec::new(),
            memory: Vec::new(),
        })
    }
}

fn episode(total: f64, steps: u32, instructions: u64) -> Episode {
    Episode {
        total,
        shaped: total,
        steps,
        instructions,
        unstable: false,
    }
}

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
    fn new(asked: Arc<Asked>, num_envs: usize) -> PyResult<Self> {
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
        self.lanes[lane] = None;
        let Some(job) = self.jobs.next() else {
            return Ok(());
        };
        let asked = &self.asked;
        let blob = asked.blobs[job.policy].clone();
        let recorder = || {
            let inputs = self.wrappers.inputs().len();
            Recorder::new(inputs, asked.spec.actions, asked.max_steps())
        };
        let next = Lane {
            agent: Agent::new(blob).map_err(PyRuntimeError::new_err)?,
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
        if let Some(lane) = self.lanes[number].take() {
            if self.asked.alone {
                self.memory = lane.agent.memory();
            }
            self.finished.push((lane.job, lane.done, lane.recordings));
        }
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
            episodes: vec![Vec::new(); asked.blobs.len()],
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
        let shape = [asked.blobs.len(), asked.episodes];
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
                self.wrappers
                    .apply(full, &mut self.seen, &mut lane.seeds.mask);
                let (recorder, instructions) = (&mut lane.recorder, &mut lane.instructions);
                lane.agent.decide(&self.seen, |decision| {
                    if let Some(recorder) = recorder {
                        recorder.see(&self.seen, decision.action);
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
