//! Statistics of scores, the same that the command prints.

use pyo3::prelude::*;

/// The mean and its 95 % bootstrap interval.
#[pyfunction]
pub(crate) fn bootstrap_mean(values: Vec<f64>) -> (f64, f64, f64) {
    let [low, high] = tpg_tasks::stats::bootstrap_mean_95(&values);
    (tpg_tasks::stats::mean(&values), low, high)
}
