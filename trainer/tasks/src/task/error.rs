//! Why a task cannot be made.

use std::path::PathBuf;

/// A name that stands for no task, or for none that this build can make.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum UnknownTask {
    /// No task has this name.
    #[error("no task is called {name:?}{}; tasks: {}, the path of a .toml file that describes one, or series:FILE.csv:COLUMN",
        hint(*nearest), known.join(", "))]
    NoSuchName {
        /// The name that was asked for.
        name: String,
        /// The name that differs least, if one is near.
        nearest: Option<&'static str>,
        /// Full names of the tasks that this build can make.
        known: &'static [&'static str],
    },
    /// The task is simulated by MuJoCo, which this build lacks.
    #[error(
        "the task {name} needs MuJoCo, which this build lacks: build with the feature `mujoco`; tasks without it: {}",
        known.join(", ")
    )]
    NeedsMujoco {
        /// Full name of the task.
        name: &'static str,
        /// Full names of the tasks that this build can make.
        known: &'static [&'static str],
    },
    /// A family of tasks has none with this parameter.
    #[error("{family} has no task {given:?}; its tasks are {wanted}")]
    BadParameter {
        /// Name of the family.
        family: &'static str,
        /// The parameter that was asked for.
        given: String,
        /// The names that its tasks can have.
        wanted: String,
    },
    /// The file that describes a task, its model, or the file of a series cannot be used.
    #[error("{}: {why}", path.display())]
    BadFile {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
}

fn hint(nearest: Option<&str>) -> String {
    nearest.map_or_else(String::new, |name| format!(", did you mean {name:?}?"))
}
