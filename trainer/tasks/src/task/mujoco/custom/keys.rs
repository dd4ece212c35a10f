//! Which keys a description has, and the keys that it takes over from another file.

use super::unknown;
use crate::console::one_line;
use toml::{Table, Value};

/// The keys of each part of the file; the first part is the file itself.
const KEYS: [(&str, &[&str]); 10] = [
    (
        "",
        &[
            "name",
            "like",
            "model",
            "frame-skip",
            "max-steps",
            "period-us",
            "action-repeat",
            "leave-out",
            "observation",
            "actuator",
            "action",
            "reward",
            "termination",
            "goal",
            "reset",
            "randomize",
        ],
    ),
    (
        "observation",
        &[
            "source",
            "expression",
            "name",
            "unit",
            "velocity",
            "clip",
            "range",
            "offset",
        ],
    ),
    (
        "actuator",
        &["name", "actuator", "low", "high", "unit", "rate-limit"],
    ),
    ("action", &["name", "controls"]),
    (
        "reward",
        &[
            "kind",
            "expression",
            "source",
            "weight",
            "target",
            "precision",
            "counts-as",
        ],
    ),
    (
        "termination",
        &[
            "source",
            "expression",
            "below",
            "above",
            "at-or-below",
            "at-or-above",
        ],
    ),
    ("goal", &["name", "low", "high"]),
    (
        "randomize",
        &[
            "mass",
            "inertia",
            "friction",
            "damping",
            "actuator-gain",
            "gravity",
        ],
    ),
    (
        "reset",
        &[
            "keyframe",
            "position-noise",
            "velocity-noise",
            "orientation-noise",
            "position-distribution",
            "velocity-distribution",
            "joint",
            "redraw-until",
        ],
    ),
    (
        "joint",
        &[
            "joint",
            "position",
            "velocity",
            "position-noise",
            "velocity-noise",
        ],
    ),
];

/// Reads a further file of a task by its name, from the folder of the description.
pub(super) type Load<'a> = dyn Fn(&str) -> Result<String, String> + 'a;

/// The keys of one file, all of them known.
pub(super) fn table(text: &str) -> Result<Table, String> {
    let table: Table = text.parse().map_err(one_line)?;
    check_keys(&table, "")?;
    Ok(table)
}

/// The name of the file that a description is like, if it is like one.
pub(super) fn like(text: &str) -> Result<Option<String>, String> {
    match table(text)?.remove("like") {
        None => Ok(None),
        Some(Value::String(name)) => Ok(Some(name)),
        Some(other) => Err(format!("like = {other}: must be the name of a file")),
    }
}

/// Adds the keys of the file that a description is like, except those that it has itself.
pub(super) fn overlay(mut own: Table, load: &Load<'_>, depth: usize) -> Result<Table, String> {
    const DEEPEST: usize = 8;
    let Some(like) = own.remove("like") else {
        return Ok(own);
    };
    let name = like
        .as_str()
        .ok_or_else(|| format!("like = {like}: must be the name of a file"))?;
    if depth == DEEPEST {
        return Err(format!(
            "like = {name:?}: more than {DEEPEST} files follow each other"
        ));
    }
    let named = |why| format!("like = {name:?}: {why}");
    let base = table(&load(name).map_err(named)?).map_err(named)?;
    let mut base = overlay(base, load, depth + 1)?;
    base.extend(own);
    Ok(base)
}

/// Refuses keys that do not exist; values of the wrong type are left to serde.
fn check_keys(table: &Table, part: &str) -> Result<(), String> {
    let known = KEYS
        .iter()
        .find(|(name, _)| *name == part)
        .map_or(&[][..], |(_, keys)| *keys);
    for (key, value) in table {
        if !known.contains(&key.as_str()) {
            let kind = if part.is_empty() {
                "key".to_owned()
            } else {
                format!("key of {part}")
            };
            return Err(unknown(&kind, key, known));
        }
        match value {
            Value::Table(inner) => check_keys(inner, key)?,
            Value::Array(list) => {
                for inner in list.iter().filter_map(Value::as_table) {
                    check_keys(inner, key)?;
                }
            }
            _ => {}
        }
    }
    Ok(())
}
