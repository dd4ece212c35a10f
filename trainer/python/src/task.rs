//! What an environment is to evolution.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use tpg_tasks::task::{ActionSpace, Channel, Spec};

/// An environment as `tpg/spaces.py` describes it: name, inputs, whether actions are indices, how many actions or values of an
/// action, the bounds of values, most steps of an episode, seconds between two decisions.
pub(crate) type Described = (String, usize, bool, usize, f32, f32, u32, f64);

/// What a task is to evolution, from what Python knows of an environment.
///
/// # Errors
/// `ValueError` says which part is out of its bounds.
pub(crate) fn spec(task: Described) -> PyResult<Spec> {
    let (name, inputs, discrete, actions, low, high, max_steps, period) = task;
    if max_steps == 0 {
        return Err(PyValueError::new_err("max_steps must be at least 1"));
    }
    let wrong = |what: String| Err(PyValueError::new_err(what));
    let most = usize::from(u16::MAX);
    if inputs == 0 || inputs > most {
        return wrong(format!(
            "{name} has {inputs} inputs, but a policy has 1 to {most}"
        ));
    }
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
    let channels = |stem: &str, count: usize, unit: &str| {
        let channel = |k| Channel {
            name: format!("{stem}_{k}"),
            unit: unit.into(),
            velocity: false,
        };
        (0..count).map(channel).collect()
    };
    let (outputs, actions) = match discrete {
        true => (channels("action", 1, "index"), ActionSpace::Discrete(count)),
        false => {
            let space = ActionSpace::Continuous {
                len: count,
                low,
                high,
            };
            (channels("action", actions, "1"), space)
        }
    };
    Ok(Spec {
        name,
        inputs: channels("observation", inputs, "1"),
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
