//! In which line of an experiment's file a mistake stands.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use tpg_trainer::config::ConfigError;

use super::error::ExperimentError;

/// What of a file a message is about.
enum Subject<'a> {
    /// A key, perhaps without the tables around it.
    Key(&'a str),
    /// A text that is the value of some key, or one of a list.
    Text(&'a str),
}

/// The line of the first key or text that the error is about, from 1; `None` where the file does not show it.
pub(crate) fn line_of(text: &str, error: &ExperimentError) -> Option<usize> {
    let subject = match error {
        ExperimentError::Value { key, .. } => Subject::Key(key),
        ExperimentError::UnknownTask { name, .. }
        | ExperimentError::UnknownVariant { name, .. } => Subject::Text(name),
        ExperimentError::Config(source) | ExperimentError::Preset { source, .. } => match source {
            ConfigError::UnknownKey { key, .. } | ConfigError::Value { key, .. } => {
                Subject::Key(key)
            }
            ConfigError::UnknownPreset { name, .. } => Subject::Text(name),
            _ => return None,
        },
        ExperimentError::At { .. } => return None,
    };
    let table = DeTable::parse(text).ok()?;
    let offset = in_table(table.get_ref(), "", &subject)?;
    Some(text.get(..offset)?.matches('\n').count() + 1)
}

fn in_table(table: &DeTable<'_>, path: &str, subject: &Subject<'_>) -> Option<usize> {
    // A map sorts its keys; the first in the file is meant.
    let places = table.iter().filter_map(|(key, value)| {
        let name = key.get_ref();
        let full = match path {
            "" => name.to_string(),
            path => format!("{path}.{name}"),
        };
        let is_meant = matches!(subject, Subject::Key(key) if ends_with(&full, key));
        if is_meant {
            return Some(key.span().start);
        }
        in_value(value, &full, subject)
    });
    places.min()
}

fn in_value(value: &Spanned<DeValue<'_>>, path: &str, subject: &Subject<'_>) -> Option<usize> {
    match (value.get_ref(), subject) {
        (DeValue::Table(table), _) => in_table(table, path, subject),
        (DeValue::Array(list), _) => {
            let mut places = list.iter().map(|value| in_value(value, path, subject));
            places.find_map(|place| place)
        }
        (DeValue::String(found), Subject::Text(text)) if found == text => Some(value.span().start),
        _ => None,
    }
}

/// Whether a path ends in a key, which may itself be a path.
fn ends_with(path: &str, key: &str) -> bool {
    path.strip_suffix(key)
        .is_some_and(|before| before.is_empty() || before.ends_with('.'))
}
