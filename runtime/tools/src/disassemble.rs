//! Shows policies in readable form: programs as text, the graph in DOT or SVG.

mod cards;
mod constants;
mod graph;
mod memory;
mod names;
mod notation;

use std::fmt::{self, Write as _};

use tpg_runtime::Policy;
use tpg_runtime::blob::ActionKind;
use tpg_runtime::isa::Operand;
use tpg_runtime::tables::{Instruction, Program, ProgramId, Target, TeamId};

pub use cards::{Wins, svg};
pub use graph::dot;
pub use names::inputs_used;

use names::{Names, output_name};
use notation::notation;

/// Returns every team and program of a policy as text, with its constants.
#[must_use]
pub fn disassemble(policy: &Policy<'_>) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write_policy(&mut text, policy);
    text
}

fn write_policy(out: &mut String, policy: &Policy<'_>) -> fmt::Result {
    let tables = policy.tables();
    if let Some(front_end) = policy.front_end() {
        let missing = front_end.fallback.name();
        writeln!(
            out,
            "obs is standardised by the front end; missing elements: {missing}\n"
        )?;
    }
    for (number, team) in
        (0..policy.header().teams).filter_map(|k| Some((k, tables.team(TeamId(k))?)))
    {
        let root = if number == 0 { " (root)" } else { "" };
        let members: Vec<String> = tables.members(&team).map(|p| p.0.to_string()).collect();
        writeln!(out, "team {number}{root}: programs {}", members.join(", "))?;
        memory::write(out, policy, &team)?;
    }
    for number in 0..policy.header().programs {
        writeln!(out)?;
        write_program(out, policy, number)?;
    }
    Ok(())
}

/// One program as [`disassemble`] writes it.
fn program_text(policy: &Policy<'_>, number: u16) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write_program(&mut text, policy, number);
    text
}

fn write_program(out: &mut String, policy: &Policy<'_>, number: u16) -> fmt::Result {
    let tables = policy.tables();
    let Some(program) = tables.program(ProgramId(number)) else {
        return Ok(());
    };
    let names = Names::new(policy, &program);
    let target = target(policy, &program, &names);
    writeln!(out, "program {number} -> {target}")?;
    let used = inputs_used(policy, tables.code(&program));
    if !used.is_empty() {
        writeln!(out, "  ; inputs {}", used.join(", "))?;
    }
    constants::write(out, policy, &program, &names)?;
    let code = tables.code(&program).iter();
    for instruction in code.filter_map(Instruction::from_bytes) {
        writeln!(out, "  {}", notation(&instruction, &names))?;
    }
    writeln!(out, "  bid s0")
}

/// The program's target, with the registers that hold a continuous action.
fn target(policy: &Policy<'_>, program: &Program, names: &Names<'_>) -> String {
    match program.target {
        Target::Team(TeamId(team)) => format!("team {team}"),
        Target::Atomic(action) => {
            let register = |kind| names.operand(kind, program.output);
            match policy.header().action_kind {
                ActionKind::Discrete => format!("action {action}"),
                ActionKind::Continuous if policy.header().actions == 1 => {
                    format!("action {}", register(Operand::S))
                }
                ActionKind::Continuous => format!("action {}", register(Operand::V)),
                _ => {
                    format!("{} {}", output_name(policy, action), register(Operand::S))
                }
            }
        }
    }
}
