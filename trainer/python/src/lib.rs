//! The compiled part of the Python package `tpg`; `tpg/_tpg.pyi` beside it describes what Python sees.
//!
//! Everything that decides or evolves lies in the crates below: here are only conversions.

mod agent;
mod batch;
mod convert;
mod evaluator;
mod evolution;
mod native;
mod policy;
mod rollout;
mod statistics;
mod task;

use pyo3::prelude::*;

#[pymodule]
fn _tpg(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<policy::Policy>()?;
    module.add_class::<batch::Batch>()?;
    module.add_class::<rollout::Rollout>()?;
    module.add_class::<evolution::Evolution>()?;
    module.add_function(wrap_pyfunction!(evolution::preset_names, module)?)?;
    module.add_function(wrap_pyfunction!(native::score_native, module)?)?;
    module.add_function(wrap_pyfunction!(native::task_names, module)?)?;
    module.add_function(wrap_pyfunction!(statistics::bootstrap_mean, module)?)
}
