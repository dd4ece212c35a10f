//! Tasks that a user describes: a MuJoCo model, and a TOML file with observations, actuators, rewards and ends.
//!
//! | file | what it holds |
//! |---|---|
//! | `description` | what the TOML file says |
//! | `keys` | which keys it may have, and those that it takes over from another file |
//! | `names` | the objects of a model, by name or number |
//! | `arrays`, `source` | the values of a model that the file can name |
//! | `input` | the elements of the observation |
//! | `pairwise` | sums as NumPy rounds them |
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

mod arrays;
mod builtin;
mod description;
mod drive;
mod expression;
mod files;
mod input;
mod keys;
mod load;
mod measure;
pub(super) mod names;
mod pairwise;
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
