//! What evolution asks to be scored.

use std::sync::Arc;

use numpy::{IntoPyArray as _, PyArray2, PyArrayMethods as _};
use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use tpg_tasks::eval::{Conditions, Domain, Episode, EpisodeSeeds, episode_seed};
use tpg_tasks::task::{Spec, Wrappers, parse_stack};
use tpg_trainer::evaluator::{Job, Split, job_seeds};
use tpg_trainer::front_end::Recording;
use tpg_trainer::monitor::Monitor;

use crate::agent::Loaded;
use crate::convert::{Numbers, bad_value, check_shape};
use crate::policy::Policy;
use crate::rollout::Rollout;
use crate::task::{Described, spec};

/// Seeds of environments are below this, which all of them take.
const ENV_SEED_BITS: u32 = 31;

/// Policies that evolution asks to be scored, with all that their episodes depend on.
pub(crate) struct Asked {
    pub(crate) policies: Vec<Arc<Loaded>>,
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
    pub(crate) fn seeds(&self, job: &Job) -> &[u64] {
        let policy = self.numbers[job.policy];
        job_seeds(&Job { policy, ..*job }, &self.episode_seeds, self.episodes)
    }

    /// Control steps after which an episode ends.
    pub(crate) fn max_steps(&self) -> u32 {
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

pub(crate) fn env_seed(seeds: &mut EpisodeSeeds) -> i64 {
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
        let asked = Asked {
            policies: vec![policy.loaded().clone()],
            expected: vec![0.0],
            episodes,
            episode_seeds: seeds.collect(),
            numbers: vec![0],
            split: policy.split(),
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
        self.asked.policies.len()
    }

    /// The bytes of a policy.
    fn _blob<'py>(&self, py: Python<'py>, number: usize) -> PyResult<Bound<'py, PyBytes>> {
        let policy = self.asked.policies.get(number).ok_or_else(|| {
            let count = self.asked.policies.len();
            PyIndexError::new_err(format!(
                "there is no policy {number}: the batch has {count}"
            ))
        })?;
        Ok(PyBytes::new(py, policy.blob()))
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
        [self.asked.policies.len(), self.asked.episodes]
    }

    fn each_episode<T>(&self, of: impl Fn(&mut EpisodeSeeds) -> T) -> Vec<T> {
        let mut all = Vec::new();
        for policy in 0..self.asked.policies.len() {
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

pub(crate) fn episode(total: f64, steps: u32, instructions: u64) -> Episode {
    Episode {
        total,
        shaped: total,
        steps,
        instructions,
        unstable: false,
    }
}
