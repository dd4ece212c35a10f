//! Exported policies.

use std::path::PathBuf;
use std::sync::Arc;

use numpy::{IntoPyArray as _, PyArray1, PyArrayMethods as _};
use pyo3::exceptions::{PyOSError, PyRuntimeError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use tpg_runtime::tables::Range;
use tpg_runtime::{Action, Capacities, HostAgent, Reset};
use tpg_tasks::score::header_actions;
use tpg_tasks::task::{ActionSpace, Spec};
use tpg_tools::export;
use tpg_trainer::evaluator::Split;

use crate::agent::{Agent, Loaded};
use crate::convert::{Numbers, check_shape, flags};

/// What an action looks like to Python.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Kind {
    /// An index below the number.
    Discrete(usize),
    /// So many values.
    Continuous(usize),
}

impl Kind {
    pub(crate) fn of(actions: ActionSpace) -> Self {
        match actions {
            ActionSpace::Discrete(count) => Kind::Discrete(usize::from(count)),
            ActionSpace::Continuous { len, .. } => Kind::Continuous(usize::from(len)),
        }
    }
}

/// Actions of several agents, one after another.
pub(crate) enum Actions {
    Discrete(Vec<i64>),
    Continuous(Vec<f32>, usize),
}

impl Actions {
    pub(crate) fn new(kind: Kind, rows: usize) -> Self {
        match kind {
            Kind::Discrete(_) => Actions::Discrete(vec![0; rows]),
            Kind::Continuous(len) => Actions::Continuous(vec![0.0; rows * len], len),
        }
    }

    pub(crate) fn set(&mut self, row: usize, action: Action<'_>) {
        match (self, action) {
            (Actions::Discrete(all), Action::Discrete(k)) => all[row] = i64::from(k),
            (Actions::Continuous(all, len), Action::Continuous(values)) => {
                all[row * *len..][..*len].copy_from_slice(values);
            }
            // A policy's actions are all of one kind.
            _ => {}
        }
    }

    pub(crate) fn into_python(self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        Ok(match self {
            Actions::Discrete(all) => all.into_pyarray(py).into_any().unbind(),
            Actions::Continuous(all, len) => {
                let rows = all.len() / len;
                let flat = all.into_pyarray(py);
                flat.reshape([rows, len])?.into_any().unbind()
            }
        })
    }
}

/// An exported policy, and agents that execute it.
#[pyclass(subclass, module = "tpg._tpg", name = "Policy")]
pub(crate) struct Policy {
    agent: Agent,
    /// Agents of a batch, one for each row.
    rows: Vec<Agent>,
    observation_len: usize,
    kind: Kind,
    instructions: u32,
    buffer: Vec<f32>,
}

impl Policy {
    fn of(blob: Arc<[u8]>) -> Result<Self, String> {
        let agent = Agent::new(Loaded::check(blob)?)?;
        let header = agent.policy().header();
        Ok(Policy {
            observation_len: usize::from(header.observation_len),
            kind: Kind::of(header_actions(header)),
            agent,
            rows: Vec::new(),
            instructions: 0,
            buffer: Vec::new(),
        })
    }

    pub(crate) fn loaded(&self) -> &Arc<Loaded> {
        self.agent.loaded()
    }

    /// How far its episodes can be split: into single ones if each starts from a full reset.
    pub(crate) fn split(&self) -> Split {
        match self.agent.policy().header().reset_scope.at_episode() {
            (true, true) => Split::Episodes,
            _ => Split::Agents,
        }
    }

    /// Refuses a task that offers other inputs or takes other actions.
    pub(crate) fn check_fit(&self, inputs: usize, spec: &Spec) -> PyResult<()> {
        let own = header_actions(self.agent.policy().header());
        let misfit = |policy: String, task: String| {
            Err(PyValueError::new_err(format!(
                "the policy does not fit {}: it {policy}, the environment {task}",
                spec.name
            )))
        };
        if inputs != self.observation_len {
            let own = format!("has {} inputs", self.observation_len);
            return misfit(own, format!("offers {inputs}"));
        }
        if own != spec.actions {
            return misfit(format!("chooses {own}"), format!("takes {}", spec.actions));
        }
        let ranges = self.agent.policy().output_ranges().enumerate();
        for ((k, own), output) in ranges.zip(&spec.outputs) {
            if let Some(range) = output.range.filter(|range| *range != own) {
                let from = |range: Range| format!("from {} to {}", range.low, range.high);
                return misfit(
                    format!("chooses value {k} {}", from(own)),
                    format!("takes it {}", from(range)),
                );
            }
        }
        Ok(())
    }

    fn channels(&self) -> Vec<(String, String)> {
        let lines = self.agent.policy().tables().labels.lines();
        let channel = |line: &str| {
            let (name, unit) = line.split_once('\t').unwrap_or((line, ""));
            (name.to_owned(), unit.to_owned())
        };
        lines.map(channel).collect()
    }
}

#[pymethods]
impl Policy {
    #[new]
    fn new(source: &Bound<'_, PyAny>) -> PyResult<Self> {
        if let Ok(bytes) = source.cast::<PyBytes>() {
            let wrong = |why| PyValueError::new_err(format!("cannot use these bytes: {why}"));
            return Policy::of(bytes.as_bytes().into()).map_err(wrong);
        }
        let path: PathBuf = source.extract().map_err(|_| {
            PyTypeError::new_err("a policy is made of a path or of the bytes of a .tpg file")
        })?;
        let shown = path.display();
        let bytes = std::fs::read(&path).map_err(|error| {
            let number = error.raw_os_error().unwrap_or_default();
            // With an error number Python chooses the class, such as FileNotFoundError.
            PyOSError::new_err((number, error.to_string(), path.clone()))
        })?;
        Policy::of(bytes.into())
            .map_err(|why| PyValueError::new_err(format!("cannot use {shown}: {why}")))
    }

    #[pyo3(signature = (seed=0, *, agent=true))]
    fn reset(&mut self, seed: u64, agent: bool) {
        let what = if agent { Reset::Agent } else { Reset::Episode };
        self.agent.reset(what, seed);
    }

    fn act(&mut self, py: Python<'_>, observation: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        let numbers = Numbers::new(observation, "the observation")?;
        check_shape("the observation", numbers.shape(), &[self.observation_len])?;
        numbers.rounded_into(&mut self.buffer);
        let instructions = &mut self.instructions;
        let decided = self.agent.decide(&self.buffer, |decision| {
            *instructions = decision.instructions;
            match decision.action {
                Action::Discrete(k) => Ok(k.into_pyobject(py)?.into_any().unbind()),
                Action::Continuous(values) => {
                    Ok(PyArray1::from_slice(py, values).into_any().unbind())
                }
            }
        });
        decided.map_err(|error| PyValueError::new_err(error.to_string()))?
    }

    #[pyo3(signature = (seeds, mask=None, *, agent=true))]
    fn reset_batch(
        &mut self,
        seeds: Vec<u64>,
        mask: Option<&Bound<'_, PyAny>>,
        agent: bool,
    ) -> PyResult<()> {
        let mask = flags(mask, "mask", seeds.len())?;
        if self.rows.len() != seeds.len() {
            if mask.contains(&false) {
                return Err(PyValueError::new_err(format!(
                    "there are {} rows, so a mask cannot choose among {}: reset all of them first",
                    self.rows.len(),
                    seeds.len()
                )));
            }
            let loaded = self.agent.loaded();
            let made = seeds.iter().map(|_| Agent::new(loaded.clone())).collect();
            self.rows = Result::map_err(made, PyRuntimeError::new_err)?;
        }
        let what = if agent { Reset::Agent } else { Reset::Episode };
        for ((row, seed), chosen) in self.rows.iter_mut().zip(seeds).zip(mask) {
            if chosen {
                row.reset(what, seed);
            }
        }
        Ok(())
    }

    fn act_batch(
        &mut self,
        py: Python<'_>,
        observations: &Bound<'_, PyAny>,
    ) -> PyResult<Py<PyAny>> {
        let numbers = Numbers::new(observations, "observations")?;
        let rows = numbers.shape().first().copied().unwrap_or(0);
        check_shape(
            "observations",
            numbers.shape(),
            &[rows, self.observation_len],
        )?;
        if rows != self.rows.len() {
            return Err(PyValueError::new_err(format!(
                "there are {rows} rows of observations, but {} agents: call reset_batch with a seed for each row first",
                self.rows.len()
            )));
        }
        numbers.rounded_into(&mut self.buffer);
        drop(numbers);
        let mut actions = Actions::new(self.kind, rows);
        let (agents, buffer, len) = (&mut self.rows, &self.buffer, self.observation_len);
        let decided = py.detach(|| {
            let observations = buffer.chunks_exact(len);
            for (row, (agent, observation)) in agents.iter_mut().zip(observations).enumerate() {
                agent.decide(observation, |decision| actions.set(row, decision.action))?;
            }
            Ok::<_, tpg_runtime::ObservationError>(())
        });
        decided.map_err(|error| PyValueError::new_err(error.to_string()))?;
        actions.into_python(py)
    }

    /// A copy in the same state, agents of a batch included.
    fn _copy_state_of(&mut self, other: &Policy) -> PyResult<()> {
        let copy = |agent: &Agent| agent.copy().map_err(PyRuntimeError::new_err);
        self.agent = copy(&other.agent)?;
        self.rows = other.rows.iter().map(copy).collect::<PyResult<_>>()?;
        self.instructions = other.instructions;
        Ok(())
    }

    /// What an agent of the kind that the trainer scores with decides on rows of observations, one after another: for tests.
    fn _replay(
        &self,
        py: Python<'_>,
        observations: &Bound<'_, PyAny>,
        seed: u64,
    ) -> PyResult<Py<PyAny>> {
        let wrong = |error: &dyn std::error::Error| PyValueError::new_err(error.to_string());
        let agent = HostAgent::new(*self.agent.policy());
        let mut agent = Box::new(agent.map_err(|error| wrong(&error))?);
        agent.reset(Reset::Agent, seed);
        let mut numbers = Vec::new();
        Numbers::new(observations, "observations")?.rounded_into(&mut numbers);
        let rows = numbers.chunks_exact(self.observation_len);
        let mut actions = Actions::new(self.kind, rows.len());
        for (row, observation) in rows.enumerate() {
            let decision = agent.decide(observation).map_err(|error| wrong(&error))?;
            actions.set(row, decision.action);
        }
        actions.into_python(py)
    }

    fn to_bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, self.loaded().blob())
    }

    /// Source code: the texts of header and source in C, or of a Rust module.
    fn _export_c(&self, name: &str) -> (String, String) {
        let made_by = "tpg.Policy.export_c in Python";
        let module = export::c(self.agent.policy(), name, made_by);
        (module.header, module.source)
    }

    fn _export_rust(&self) -> String {
        export::rust(self.agent.policy(), "tpg.Policy.export_rust in Python")
    }

    fn disassemble(&self) -> String {
        tpg_tools::disassemble::disassemble(self.agent.policy())
    }

    #[getter]
    fn observation_len(&self) -> usize {
        self.observation_len
    }

    /// Number of actions, or of values of an action; the bounds of each value, none for indices.
    #[getter]
    fn _actions(&self) -> (usize, Vec<(f32, f32)>) {
        let ranges = self.agent.policy().output_ranges();
        let bounds = ranges.map(|range| (range.low, range.high)).collect();
        match self.kind {
            Kind::Discrete(count) => (count, bounds),
            Kind::Continuous(len) => (len, bounds),
        }
    }

    /// The range of each input.
    #[getter]
    fn _input_bounds(&self) -> Vec<(f32, f32)> {
        let ranges = self.agent.policy().input_ranges();
        ranges.map(|range| (range.low, range.high)).collect()
    }

    /// Name and unit of each input, then of each continuous output.
    #[getter]
    fn _channels(&self) -> Vec<(String, String)> {
        self.channels()
    }

    #[getter]
    fn task(&self) -> String {
        self.agent.policy().tables().task.to_owned()
    }

    #[getter]
    fn observability(&self) -> String {
        self.agent.policy().tables().observability.to_owned()
    }

    #[getter]
    fn period(&self) -> f64 {
        f64::from(self.agent.policy().header().control_period_us) / 1e6
    }

    #[getter]
    fn provenance(&self) -> String {
        let bytes = self.agent.policy().header().provenance;
        bytes.iter().map(|byte| format!("{byte:02x}")).collect()
    }

    #[getter]
    fn instructions(&self) -> u32 {
        self.instructions
    }

    #[getter]
    fn memory<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        self.agent.memory().into_pyarray(py)
    }

    #[getter]
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        let policy = self.agent.policy();
        let (header, bounds) = (policy.header(), policy.bounds());
        dict.set_item("instructions", bounds.instructions)?;
        dict.set_item("teams", header.teams)?;
        dict.set_item("programs", header.programs)?;
        dict.set_item("state_bytes", Capacities::needed_by(header).state_bytes())?;
        Ok(dict)
    }
}
