//! Checks the texts of a policy.

use super::error::VerifyError;
use crate::blob::{Header, lines};
use crate::tables::Tables;

/// Longest name and longest unit of a channel in version 3, in bytes.
const LABEL_BYTES: usize = 64;
/// Longest name of a task and of its wrappers in version 3, in bytes.
const TEXT_BYTES: usize = 255;

/// Checks that there is a line with name and unit for each input and each output.
pub(super) fn check_labels(header: &Header, tables: &Tables<'_>) -> Result<(), VerifyError> {
    let labels = usize::from(header.observation_len) + header.outputs();
    let mut lines = lines(tables.labels);
    let strict = header.has_missing_values();
    let ended = !strict || tables.labels.ends_with('\n');
    if !ended || lines.clone().count() != labels || !lines.all(|line| is_label(line, strict)) {
        return Err(VerifyError::Labels);
    }
    Ok(())
}

/// Checks the names of task and wrappers, as version 3 wants them.
pub(super) fn check_texts(tables: &Tables<'_>) -> Result<(), VerifyError> {
    let named = |text: &str| (1..=TEXT_BYTES).contains(&text.len());
    if !named(tables.task) || !named(tables.observability) {
        return Err(VerifyError::Texts);
    }
    Ok(())
}

/// The names and units of a text of labels.
pub(super) fn labels(text: &str) -> impl Iterator<Item = (&str, &str)> {
    lines(text).map(|line| line.split_once('\t').unwrap_or_default())
}

fn is_label(line: &str, strict: bool) -> bool {
    let Some((name, unit)) = line.split_once('\t') else {
        return false;
    };
    let sound = |text: &str| {
        let printed = text.bytes().all(|byte| byte >= 0x20 && byte != 0x7f);
        !strict || (text.len() <= LABEL_BYTES && printed)
    };
    !name.is_empty() && !unit.contains('\t') && sound(name) && sound(unit)
}
