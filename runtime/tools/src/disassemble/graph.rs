//! The graph of teams and programs in DOT, the language of Graphviz.

use std::collections::BTreeSet;
use std::fmt::{self, Write as _};

use tpg_runtime::Policy;
use tpg_runtime::blob::ActionKind;
use tpg_runtime::tables::{ProgramId, Target, TeamId};

use super::names::output_name;

/// Returns the graph in DOT. Teams are ellipses, programs are boxes, actions and outputs are diamonds.
///
/// The label of an edge from a team to a program is the program's position in the team's list.
#[must_use]
pub fn dot(policy: &Policy<'_>) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write_graph(&mut text, policy);
    text
}

fn write_graph(out: &mut String, policy: &Policy<'_>) -> fmt::Result {
    let (header, tables) = (policy.header(), policy.tables());
    writeln!(out, "digraph policy {{")?;
    for number in 0..header.teams {
        let root = if number == 0 { " (root)" } else { "" };
        writeln!(
            out,
            "  t{number} [shape=ellipse, label=\"team {number}{root}\"];"
        )?;
    }
    let mut actions = BTreeSet::new();
    for number in 0..header.programs {
        let Some(program) = tables.program(ProgramId(number)) else {
            continue;
        };
        let length = program.code_len;
        writeln!(
            out,
            "  p{number} [shape=box, label=\"program {number}: {length} instructions\"];"
        )?;
        if let Target::Atomic(action) = program.target {
            actions.insert(action);
        }
    }
    for action in actions {
        let label = match header.action_kind {
            ActionKind::Discrete => format!("action {action}"),
            ActionKind::Continuous => "action".to_owned(),
            _ => output_name(policy, action).replace('"', "'"),
        };
        writeln!(out, "  a{action} [shape=diamond, label=\"{label}\"];")?;
    }
    for number in 0..header.teams {
        let Some(team) = tables.team(TeamId(number)) else {
            continue;
        };
        for (order, ProgramId(program)) in tables.members(&team).enumerate() {
            writeln!(out, "  t{number} -> p{program} [label=\"{order}\"];")?;
        }
    }
    for number in 0..header.programs {
        match tables
            .program(ProgramId(number))
            .map(|program| program.target)
        {
            Some(Target::Team(TeamId(team))) => writeln!(out, "  p{number} -> t{team};")?,
            Some(Target::Atomic(action)) => writeln!(out, "  p{number} -> a{action};")?,
            None => {}
        }
    }
    writeln!(out, "}}")
}
