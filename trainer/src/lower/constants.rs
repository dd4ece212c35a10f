//! Where the constants of a compact blob come from, and how to replace them.

use tpg_runtime::blob::{self, Blob, RegisterMode};
use tpg_runtime::isa::REGISTERS;
use tpg_runtime::tables::Section;

use super::emit::selected;
use super::liveness::{Demand, Registers, constants_read};
use super::mode::Mode;
use super::policy_spec::PolicySpec;
use crate::evolve::{Population, ProgramId, TeamId};

/// Whose constant it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Owner {
    /// The initial value of a program's register.
    Program(ProgramId),
    /// The initial value of a slot of a team's memory.
    Team(TeamId),
}

/// Where in the genome an entry of a blob's constants table comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConstantSite {
    /// Whose constant it is.
    pub owner: Owner,
    /// Its index among all constants of its owner.
    pub index: usize,
    /// Whether decisions can depend on it.
    pub read: bool,
}

/// The site of each entry of the constants table of an agent's compact blob, in the order of the table.
///
/// Empty if initial values are zero, because such blobs have no constants.
#[must_use]
pub fn constant_sites(
    population: &Population,
    root: TeamId,
    policy_spec: &PolicySpec,
) -> Vec<ConstantSite> {
    let selected = selected(population, root, policy_spec, Mode::Compact);
    let width = usize::from(policy_spec.shape.width);
    let mut sites = Vec::new();
    let programs = selected.graph.programs.iter().zip(&selected.results);
    let kept = selected.kept.code.iter().zip(&selected.registers);
    for (((id, program), results), (code, registers)) in programs.zip(kept) {
        // All code that is left is effective, so every section and column that it writes counts as read.
        let demand = Demand {
            results: *results,
            stateful: policy_spec.register_mode == RegisterMode::Stateful,
            sections: [true; 3],
            columns: u8::MAX,
        };
        let read = constants_read(code, &demand);
        if !program.constants.is_empty() {
            push(&mut sites, Owner::Program(*id), *registers, read, width);
        }
    }
    for ((id, team), slots) in selected.graph.teams.iter().zip(&selected.kept.slots) {
        if !team.memory.is_empty() {
            let slots = Registers(*slots);
            push(&mut sites, Owner::Team(*id), slots, slots, width);
        }
    }
    sites
}

/// Names the constants of the kept registers or slots, in the order in which they are emitted.
fn push(
    sites: &mut Vec<ConstantSite>,
    owner: Owner,
    kept: Registers,
    read: Registers,
    width: usize,
) {
    let mut section_start = 0;
    for section in Section::ALL {
        let words = section.slot_words(width);
        for k in (0..REGISTERS).filter(|k| kept.contains(section, *k as u8)) {
            let from = section_start + k * words;
            sites.extend((from..from + words).map(|index| ConstantSite {
                owner,
                index,
                read: read.contains(section, k as u8),
            }));
        }
        section_start += REGISTERS * words;
    }
}

/// A copy of a blob with other constants, made without lowering again.
///
/// `None` if the template is no blob, or has another number of constants.
#[must_use]
pub fn with_constants(template: &[u8], constants: &[f32]) -> Option<Vec<u8>> {
    let blob = Blob::decode(template).ok()?;
    if constants.len() != blob.tables().constants.len() {
        return None;
    }
    let constants: Vec<[u8; 4]> = constants.iter().map(|x| x.to_le_bytes()).collect();
    let mut tables = *blob.tables();
    tables.constants = &constants;
    let mut buffer = vec![0; blob::encoded_bound(&tables)];
    let len = blob::encode(blob.header(), &tables, &mut buffer).ok()?;
    buffer.truncate(len);
    Some(buffer)
}
