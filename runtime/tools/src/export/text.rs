//! Text that both languages share.

use std::fmt::Write as _;

use tpg_runtime::isa::Op;
use tpg_runtime::tables::{Range, Section, Target, TeamId};

use super::plan::{Function, Plan};

/// The letter for a kind of register or slot. The disassembly uses the same letters.
pub(super) const fn letter(section: Section) -> char {
    match section {
        Section::Scalar => 's',
        Section::Vector => 'v',
        Section::Matrix => 'm',
    }
}

/// The name of a program's function.
pub(super) fn function_name(function: Function) -> String {
    match function.team {
        Some(team) => format!("program_{}_in_team_{team}", function.program),
        None => format!("program_{}", function.program),
    }
}

/// The mnemonic as an identifier.
pub(super) fn identifier(op: Op) -> String {
    op.mnemonic().replace('-', "_")
}

/// Lines that tell what the module is and what created it. They have no comment signs.
pub(super) fn preamble(plan: &Plan<'_>, command: &str) -> Vec<String> {
    let (header, tables) = (plan.policy.header(), plan.policy.tables());
    let provenance = header
        .provenance
        .iter()
        .fold(String::new(), |mut text, byte| {
            let _ = write!(text, "{byte:02x}");
            text
        });
    let line = |text: &str| text.chars().filter(|c| !c.is_control()).collect::<String>();
    let channel = |(k, ((name, unit), range)): (usize, ((&str, &str), Range))| {
        format!("  {k}: {} [{}]{}", line(name), line(unit), bounds(range))
    };
    let mut lines = vec![
        format!("A policy for {} ({}), compiled.", line(tables.task), line(tables.observability)),
        String::new(),
        format!("Made by: {}", line(command)),
        format!("Provenance: {provenance}"),
        format!(
            "Registers {}, reset {}, memory {}, W = {}; a decision every {} us.",
            header.register_mode.name(),
            header.reset_scope.name(),
            header.memory_model.name(),
            header.width,
            header.control_period_us
        ),
        "Decides as tpg-runtime does with the policy's file, bit for bit. Do not edit: export it again.".to_owned(),
        String::new(),
        "Inputs:".to_owned(),
    ];
    let inputs = plan.policy.inputs().zip(plan.policy.input_ranges());
    lines.extend(inputs.enumerate().map(channel));
    if plan.outputs > 0 {
        let (low, high) = (header.action_low, header.action_high);
        lines.push(format!("Outputs, {low} to {high}:"));
        // A range that all outputs have stands in the title alone.
        let common = plan.has_one_range();
        let ranges = plan.policy.output_ranges();
        let ranges = ranges.map(|range| if common { Range::ALL } else { range });
        lines.extend(plan.policy.outputs().zip(ranges).enumerate().map(channel));
    }
    lines
}

/// The bounds of a channel, as text that follows its unit. Nothing if it has none.
fn bounds(range: Range) -> String {
    let Range { low, high } = range;
    match (low.is_finite(), high.is_finite()) {
        (true, true) => format!(", {low} to {high}"),
        (true, false) => format!(", {low} or more"),
        (false, true) => format!(", {high} or less"),
        (false, false) => String::new(),
    }
}

/// A program's target, in words.
pub(super) fn target(plan: &Plan<'_>, program: u16) -> String {
    match plan.program(program).target {
        Target::Team(TeamId(team)) => format!("team {team}"),
        Target::Atomic(output) if plan.each => format!("output {output}"),
        Target::Atomic(_) if plan.outputs > 0 => "its action".to_owned(),
        Target::Atomic(action) => format!("action {action}"),
    }
}
