//! What a team's memory holds after a reset.

use std::fmt::{self, Write as _};

use tpg_runtime::Policy;
use tpg_runtime::blob::InitialValues;
use tpg_runtime::tables::{Section, Team};

use super::constants::list;

/// Writes the evolved start values of a team's slots, a line each. Memory that the file carries as it was left, and memory that
/// begins at zero, has none.
pub(super) fn write(out: &mut String, policy: &Policy<'_>, team: &Team) -> fmt::Result {
    let (header, tables) = (policy.header(), policy.tables());
    if header.initial_values == InitialValues::Zero || !tables.memory.is_empty() {
        return Ok(());
    }
    let width = usize::from(header.width);
    let constants = tables.constants.iter();
    let constants = constants.skip(team.constants_start as usize);
    let mut values = constants.map(|x| f32::from_le_bytes(*x));
    for (section, name) in Section::ALL.into_iter().zip(["sm", "vm", "mm"]) {
        for slot in (0..u8::BITS).filter(|slot| team.kept(section) >> slot & 1 == 1) {
            let slot_values: Vec<f32> = values.by_ref().take(section.slot_words(width)).collect();
            let value = match section {
                Section::Scalar => list(&slot_values),
                _ => format!("({})", list(&slot_values)),
            };
            writeln!(out, "  {name}{slot} = {value} at reset")?;
        }
    }
    Ok(())
}
