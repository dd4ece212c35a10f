//! What an environment is to evolution.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use tpg_runtime::tables::Range;
use tpg_tasks::task::{ActionSpace, Channel, Spec};

/// Lowest and highest of a value.
type Bounds = (f32, f32);

/// An environment as `tpg/spaces.py` describes it: name, bounds of each input, number of actions if they are indices (else 0),
/// bounds of each value of an action, most steps of an episode, seconds between two decisions.
pub(crate) type Described = (String, Vec<Bounds>, usize, Vec<Bounds>, u32, f64);

/// What a task is to evolution, from what Python knows of an environment.
///
/// # Errors
/// `ValueError` says which part is out of its bounds.
pub(crate) fn spec(task: Described) -> PyResult<Spec> {
    let (name, inputs, indices, values, max_steps, period) = task;
    if max_steps == 0 {
        return Err(PyValueError::new_err("max_steps must be at least 1"));
    }
    let wrong = |what: String| Err(PyValueError::new_err(what));
    let most = usize::from(u16::MAX);
    if inputs.is_empty() || inputs.len() > most {
        return wrong(format!(
            "{name} has {} inputs, but a policy has 1 to {most}",
            inputs.len()
        ));
    }
    let actions = if values.is_empty() {
        indices
    } else {
        values.len()
    };
    let count = match u16::try_from(actions) {
        Ok(count) if count > 0 => count,
        _ => {
            return wrong(format!(
                "{name} has {actions} actions, but a policy has 1 to {most}"
            ));
        }
    };
    if name.is_empty() || name.chars().any(char::is_control) {
        return wrong(format!(
            "{name:?} is no name for a task: it must be a line of text"
        ));
    }
    let period_us = (period * 1e6).round();
    if !(1.0..=f64::from(u32::MAX)).contains(&period_us) {
        return wrong(format!(
            "the period of {name} is {period} s, but must be at least 1e-6 s"
        ));
    }
    let channel = |name: String, unit: &str, range| Channel {
        name,
        unit: unit.into(),
        velocity: false,
        range,
    };
    let channels = |stem: &str, bounds: &[Bounds]| -> Vec<Channel> {
        let bounds = bounds.iter().enumerate();
        let channels = bounds.map(|(k, &(low, high))| {
            channel(format!("{stem}_{k}"), "1", Some(Range { low, high }))
        });
        channels.collect()
    };
    let (outputs, actions) = if values.is_empty() {
        let index = channel("action_0".into(), "index", None);
        (vec![index], ActionSpace::Discrete(count))
    } else {
        let space = ActionSpace::Continuous {
            len: count,
            low: values
                .iter()
                .map(|(low, _)| *low)
                .fold(f32::INFINITY, f32::min),
            high: values
                .iter()
                .map(|(_, high)| *high)
                .fold(f32::NEG_INFINITY, f32::max),
        };
        (channels("action", &values), space)
    };
    Ok(Spec {
        name,
        inputs: channels("observation", &inputs),
        outputs,
        actions,
        max_steps,
        period_us: period_us as u32,
    })
}

/// All that distinguishes one environment from another, in a line.
pub(crate) fn in_words(spec: &Spec) -> String {
    let Spec {
        name,
        inputs,
        actions,
        max_steps,
        period_us,
        ..
    } = spec;
    let inputs = inputs.len();
    format!("{name} ({inputs} inputs, {actions}, at most {max_steps} steps of {period_us} us)")
}
