//! Where the constants of a compact blob come from, and how to replace them.

use tpg_runtime::blob::{self, Blob, InitialValues, RegisterMode};
use tpg_runtime::tables::Section;

use super::emit::selected;
use super::mode::Mode;
use super::policy_spec::PolicySpec;
use crate::evolve::{
    Constants, Demand, Population, ProgramId, Registers, TeamId, initial_registers, members,
};

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
}

/// The site of each entry of the constants table of an agent's compact blob, in the order of the table. `None` where no decision
/// depends on the entry.
///
/// Empty if initial values are zero, because such blobs have no constants.
#[must_use]
pub fn constant_sites(
    population: &Population,
    root: TeamId,
    policy_spec: &PolicySpec,
) -> Vec<Option<ConstantSite>> {
    let selected = selected(population, root, policy_spec, Mode::Compact);
    let width = policy_spec.shape.width;
    let mut sites = Vec::new();
    if policy_spec.initial_values == InitialValues::Zero {
        return sites;
    }
    let programs = selected.graph.programs.iter().zip(&selected.results);
    let kept = selected.kept.code.iter().zip(&selected.registers);
    for (((id, program), results), (code, registers)) in programs.zip(kept) {
        // All code that is left is effective, so every section and column that it writes counts as read.
        let stateful = policy_spec.register_mode == RegisterMode::Stateful;
        let read = initial_registers(code, &Demand::all(*results, stateful));
        let (owner, constants) = (Owner::Program(*id), &program.constants);
        push(&mut sites, owner, constants, *registers, read, width);
    }
    for ((id, team), slots) in selected.graph.teams.iter().zip(&selected.kept.slots) {
        let (owner, slots) = (Owner::Team(*id), Registers(*slots));
        push(&mut sites, owner, &team.memory, slots, slots, width);
    }
    sites
}

/// Names the constants of the kept registers or slots, in the order in which they are emitted.
fn push(
    sites: &mut Vec<Option<ConstantSite>>,
    owner: Owner,
    constants: &Constants,
    kept: Registers,
    read: Registers,
    width: u16,
) {
    for section in Section::ALL {
        for k in members(kept, section) {
            let start = constants.start(section, k, width);
            let start = start.filter(|_| read.contains(section, k));
            let site = |word| {
                start.map(|start| ConstantSite {
                    owner,
                    index: start + word,
                })
            };
            sites.extend((0..section.slot_words(usize::from(width))).map(site));
        }
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
