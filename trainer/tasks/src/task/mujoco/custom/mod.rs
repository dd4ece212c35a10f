//! Tasks that a user describes: a MuJoCo model, and a TOML file with observations, actuators, rewards and ends.
//!
//! | file | what it holds |
//! |---|---|
//! | `description` | the keys of the TOML file |
//! | `source` | the values of a model that the file can name |
//! | `terms` | rewards and ends made of such values |
//! | `drive` | the actuators that a policy sets |
//! | `plant` | the task itself |

mod description;
mod drive;
mod plant;
mod source;
mod terms;

pub(in crate::task) use plant::{digest, load};

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
        None => format!("no {kind} is called {name:?}; the model has no named {kind}"),
    }
}
