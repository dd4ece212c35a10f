//! How champions use team memory: T Fig 3.6 and 3.7.

use std::collections::BTreeMap;

use super::figure::{Figure, Look, Mark, Panel, Ticks};
use super::load::{Group, Results, Run, of_kind};
use crate::row::{Access, AccessKind, MemorySection};

/// Slots of each section of team memory.
const SLOTS: usize = tpg_runtime::isa::SLOTS;

/// The sections of team memory, in the order of their numbers.
const SECTIONS: [(MemorySection, &str); 3] = [
    (MemorySection::Scalar, "scalar"),
    (MemorySection::Vector, "vector"),
    (MemorySection::Matrix, "matrix"),
];

const KINDS: [(AccessKind, &str); 2] = [(AccessKind::Write, "writes"), (AccessKind::Read, "reads")];

/// The figures of memory use, for each variant with team memory, with their names.
pub(super) fn figures(results: &Results) -> Vec<(String, Figure)> {
    if results.experiment.chapter != Some(3) {
        return Vec::new();
    }
    let mut figures = Vec::new();
    for variant in &results.experiment.variants {
        let groups = results.groups.iter();
        let champions: Vec<(&Group, &Run, &[Access])> = groups
            .filter(|group| group.variant == *variant)
            .filter_map(|group| {
                let run = group.best_trained()?;
                Some((group, run, run.accesses.as_deref()?))
            })
            .collect();
        if champions.is_empty() {
            continue;
        }
        figures.push((
            format!("figure-3.6-{variant}"),
            by_slot(variant, &champions),
        ));
        figures.push((
            format!("figure-3.7-{variant}"),
            by_program(variant, &champions),
        ));
    }
    figures
}

/// T Fig 3.6: writes above, reads below, by section and slot.
fn by_slot(variant: &str, champions: &[(&Group, &Run, &[Access])]) -> Figure {
    let rows = KINDS.map(|(kind, what)| {
        let panels = champions.iter().map(|(group, run, accesses)| Panel {
            y: None,
            note: of_kind(accesses, kind)
                .next()
                .is_none()
                .then(|| format!("no {what}")),
            title: format!("{}, repeat {}", group.task, run.row.repeat),
            x_label: "slot of each section".to_owned(),
            y_label: format!("{what} per episode"),
            x: -0.8..(SECTIONS.len() * SLOTS) as f64 - 0.2,
            x_ticks: Ticks::Modulo(SLOTS),
            marks: slot_bars(run, accesses, kind),
        });
        panels.collect()
    });
    let sections = SECTIONS.iter().enumerate();
    Figure {
        title: format!(
            "Shared memory by slot, {variant} (as T Fig 3.6): best champion in training"
        ),
        rows: rows.into(),
        legend: sections
            .map(|(i, (_, name))| ((*name).to_owned(), Look::new(i)))
            .collect(),
    }
}

fn slot_bars(run: &Run, accesses: &[Access], kind: AccessKind) -> Vec<Mark> {
    let mut counts = [[0u64; SLOTS]; SECTIONS.len()];
    for access in of_kind(accesses, kind) {
        let section = SECTIONS
            .iter()
            .position(|(section, _)| *section == access.section);
        let slot = section.and_then(|section| counts[section].get_mut(usize::from(access.slot)));
        if let Some(count) = slot {
            *count += access.count;
        }
    }
    let bars = counts.iter().enumerate().flat_map(|(section, slots)| {
        slots.iter().enumerate().map(move |(slot, &count)| {
            let x = (section * SLOTS + slot) as f64;
            let height = per_episode(count, run);
            Mark::Bar(Look::new(section), [x - 0.4, x + 0.4, 0.0, height])
        })
    });
    bars.collect()
}

/// T Fig 3.7: writes and reads of each program.
fn by_program(variant: &str, champions: &[(&Group, &Run, &[Access])]) -> Figure {
    let panels = champions.iter().map(|(group, run, accesses)| {
        let mut counts: BTreeMap<u16, [u64; 2]> = BTreeMap::new();
        for (i, (kind, _)) in KINDS.iter().enumerate() {
            for access in of_kind(accesses, *kind) {
                counts.entry(access.program).or_default()[i] += access.count;
            }
        }
        let last = counts.keys().last().map_or(0, |program| program + 1);
        let programs = last.max(run.row.champion_programs);
        let bars = counts.iter().flat_map(|(&program, &[writes, reads])| {
            let x = f64::from(program);
            let writes = per_episode(writes, run);
            let top = writes + per_episode(reads, run);
            [
                Mark::Bar(Look::new(0), [x - 0.4, x + 0.4, 0.0, writes]),
                Mark::Bar(Look::new(1), [x - 0.4, x + 0.4, writes, top]),
            ]
        });
        let read = of_kind(accesses, AccessKind::Read).next().is_some();
        let written = of_kind(accesses, AccessKind::Write).next().is_some();
        Panel {
            y: None,
            note: match (written, read) {
                (true, true) => None,
                (true, false) => Some("no reads".to_owned()),
                (false, true) => Some("no writes".to_owned()),
                (false, false) => Some("neither reads nor writes".to_owned()),
            },
            title: format!("{}, repeat {}", group.task, run.row.repeat),
            x_label: format!(
                "program (of {programs}, {} team{})",
                run.row.champion_teams,
                if run.row.champion_teams == 1 { "" } else { "s" }
            ),
            y_label: "accesses per episode".to_owned(),
            x: -0.8..f64::from(programs.max(1)) - 0.2,
            x_ticks: Ticks::Whole,
            marks: bars.collect(),
        }
    });
    let kinds = KINDS.iter().enumerate();
    Figure {
        title: format!(
            "Shared memory by program, {variant} (as T Fig 3.7): best champion in training"
        ),
        rows: vec![panels.collect()],
        legend: kinds
            .map(|(i, (_, name))| ((*name).to_owned(), Look::new(i)))
            .collect(),
    }
}

/// Mean over the test episodes.
fn per_episode(count: u64, run: &Run) -> f64 {
    count as f64 / f64::from(run.row.test_episodes.max(1))
}
