//! Merging layers of TOML, with suggestions for keys that do not exist.

use toml::{Table, Value};

use super::error::ConfigError;
use super::preset::{DEFAULTS, Preset, parse};
use super::schema::{Config, check};
use crate::keys::nearest;

/// Merges a preset with a file's text and with `key=value` settings, of which later ones are stronger.
///
/// # Errors
/// [`ConfigError`] for unknown keys, and for values of the wrong type or outside of their bounds. Whether the settings make
/// sense together is checked by [`super::Settings::new`].
pub fn resolve(
    preset: &Preset,
    file: Option<&str>,
    sets: &[String],
) -> Result<Config, ConfigError> {
    let mut table = parse(DEFAULTS)?;
    for layer in &preset.layers {
        merge(&mut table, layer, "")?;
    }
    if let Some(text) = file {
        merge(&mut table, &parse(text)?, "")?;
    }
    for set in sets {
        merge(&mut table, &assignment(set)?, "")?;
    }
    check(&table)?;
    let mut config = Config::try_from(Value::Table(table))?;
    config.task = tpg_tasks::task::locate(&config.task);
    Ok(config)
}

impl TryFrom<Value> for Config {
    type Error = toml::de::Error;

    fn try_from(value: Value) -> Result<Self, Self::Error> {
        value.try_into()
    }
}

/// `a.b=value` as a table. A value that is no TOML is taken as text.
fn assignment(text: &str) -> Result<Table, ConfigError> {
    let not_an_assignment = || ConfigError::NotAnAssignment { text: text.into() };
    let (key, value) = text.split_once('=').ok_or_else(not_an_assignment)?;
    let (key, value) = (key.trim(), value.trim());
    if key.is_empty() {
        return Err(not_an_assignment());
    }
    let as_toml = format!("value = {value}").parse::<Table>();
    let parsed = as_toml.ok().and_then(|mut t| t.remove("value"));
    let mut value = parsed.unwrap_or_else(|| Value::String(value.to_owned()));
    for part in key.rsplit('.') {
        value = Value::Table(Table::from_iter([(part.to_owned(), value)]));
    }
    match value {
        Value::Table(table) => Ok(table),
        _ => Err(not_an_assignment()),
    }
}

/// Overrides values of `base`, in which every key exists already.
fn merge(base: &mut Table, layer: &Table, path: &str) -> Result<(), ConfigError> {
    for (key, value) in layer {
        let full = if path.is_empty() {
            key.clone()
        } else {
            format!("{path}.{key}")
        };
        match (base.get_mut(key), value) {
            (Some(Value::Table(inner)), Value::Table(layer)) => merge(inner, layer, &full)?,
            (Some(place), value) => *place = value.clone(),
            (None, _) => {
                let root = parse(DEFAULTS)?;
                let keys = leaves(&root, "").into_iter().map(|(path, _)| path);
                let keys: Vec<String> = keys.collect();
                return Err(ConfigError::UnknownKey {
                    suggestion: nearest(&full, keys.iter().map(String::as_str)),
                    key: full,
                });
            }
        }
    }
    Ok(())
}

/// The defaults, which a test holds to be well-formed.
#[must_use]
pub fn default_table() -> Table {
    parse(DEFAULTS).unwrap_or_default()
}

/// Every value of a table with the path of its key.
pub fn leaves<'a>(
    table: impl IntoIterator<Item = (&'a String, &'a Value)>,
    path: &str,
) -> Vec<(String, &'a Value)> {
    let mut all = Vec::new();
    for (key, value) in table {
        let full = if path.is_empty() {
            key.clone()
        } else {
            format!("{path}.{key}")
        };
        match value {
            Value::Table(inner) => all.extend(leaves(inner, &full)),
            leaf => all.push((full, leaf)),
        }
    }
    all
}

/// In which keys two configurations differ, with the values of both; `None` if in none.
#[must_use]
pub fn differences(here: &Config, there: &Config) -> Option<String> {
    let table = |config| Table::try_from(config).unwrap_or_default();
    let (here, there) = (table(here), table(there));
    let (here, there) = (leaves(&here, ""), leaves(&there, ""));
    let value = |values: &[(String, &Value)], key: &str| {
        let found = values.iter().find(|(name, _)| name == key);
        found.map_or_else(|| "the default".to_owned(), |(_, value)| value.to_string())
    };
    let mut keys: Vec<&String> = here.iter().chain(&there).map(|(key, _)| key).collect();
    keys.sort();
    keys.dedup();
    let differ = keys.into_iter().filter_map(|key| {
        let (here, there) = (value(&here, key), value(&there, key));
        (here != there).then(|| format!("{key} = {here} instead of {there}"))
    });
    let all: Vec<String> = differ.collect();
    (!all.is_empty()).then(|| all.join("; "))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(sets: &[&str]) -> Result<Config, ConfigError> {
        let preset = Preset::find("cartpole-sr-sm").expect("exists");
        let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
        resolve(&preset, None, &sets)
    }

    #[test]
    fn settings_override_presets_which_override_defaults() {
        let config = set(&["evolution.population=7", "policy.memory=none"]).expect("valid");
        assert_eq!(config.evolution.population, 7);
        assert_eq!(config.evolution.children, 180, "the task's");
        assert_eq!(config.evolution.tournament, 3, "the default");
        let none = tpg_runtime::blob::MemoryModel::None;
        assert_eq!(config.policy.memory, none, "text needs no quotes");
    }

    #[test]
    fn unknown_keys_are_errors_with_a_suggestion() {
        let message = set(&["evolution.populaton=7"])
            .expect_err("no such key")
            .to_string();
        assert!(message.contains("evolution.population"), "{message}");
        let message = set(&["nonsense"]).expect_err("no assignment").to_string();
        assert!(message.contains("key=value"), "{message}");
        let message = Preset::find("hoper-sr-sm")
            .expect_err("no such preset")
            .to_string();
        assert!(message.contains("hopper-sr-sm"), "{message}");
    }
}
