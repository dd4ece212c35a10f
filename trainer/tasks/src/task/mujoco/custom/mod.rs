//! Tasks that a user describes: a MuJoCo model, and a TOML file with observations, actuators, rewards and ends.
//!
//! | file | what it holds |
//! |---|---|
//! | `description` | the keys of the TOML file |
//! | `names` | the objects of a model, by name or number |
//! | `source` | the values of a model that the file can name |
//! | `measure`, `expression` | numbers that formulas can name, and the formulas |
//! | `terms` | rewards and ends |
//! | `drive` | the actuators that a policy sets |
//! | `start` | initial states |
//! | `randomize` | models that differ from episode to episode |
//! | `sound` | whether the model's numbers can be simulated |
//! | `files` | the files that a task is made of |
//! | `load` | a description and its model, out of files |
//! | `plant` | the task at work |
//! | `builtin` | the robots that the program brings along |

mod builtin;
mod description;
mod drive;
mod expression;
mod files;
mod load;
mod measure;
mod names;
mod plant;
mod randomize;
mod sound;
mod source;
mod start;
mod terms;
#[cfg(test)]
mod tests;

pub(in crate::task) use files::{digest, sources};
pub(in crate::task) use load::load;
pub use plant::Robot;

/// Says that a name does not exist, which one is most like it, and which there are.
fn unknown(kind: &str, name: &str, known: &[&str]) -> String {
    let likeness = |known: &&str| strsim::jaro_winkler(name, known);
    let nearest = known
        .iter()
        .max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
    match nearest {
        Some(nearest) => format!(
            "no {kind} is called {name:?}, did you mean {nearest:?}?; there are {}",
            known.join(", ")
        ),
        None => format!("no {kind} is called {name:?}"),
    }
}
