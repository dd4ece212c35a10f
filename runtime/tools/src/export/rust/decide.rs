//! The walk over teams in Rust.

use std::collections::BTreeSet;
use std::fmt::{self, Write as _};

use tpg_runtime::tables::{Target, TeamId};

use super::super::plan::{Member, Plan, TeamPlan};
use super::program::{arguments, name, number};

/// Fills a window that is longer than the observation.
const CYCLIC_WINDOW: &str = "        let (first, rest) = x.split_at_mut(INPUTS);
        for (x, element) in first.iter_mut().zip(observation) {
            *x = math::finite(*element);
        }
        for again in rest.chunks_mut(INPUTS) {
            for (x, element) in again.iter_mut().zip(&*first) {
                *x = *element;
            }
        }
";

/// Lets the front end stand between observation and window.
const PERCEIVE: &str = "        let perceived = self.perception.perceive(observation);
        let observation = &self.perception.x;
";

pub(super) fn write_decide(out: &mut String, plan: &Plan<'_>) -> fmt::Result {
    let header = plan.policy.header();
    writeln!(
        out,
        "\n    /// Chooses the action for an observation; its non-finite elements count as 0."
    )?;
    writeln!(
        out,
        "    pub fn decide(&mut self, observation: &[f32; INPUTS]) -> Decision {{"
    )?;
    let perceives = plan.policy.front_end().is_some();
    if perceives {
        out.push_str(PERCEIVE);
    }
    writeln!(out, "        let mut x = [0.0; {}];", plan.window)?;
    if plan.window == plan.inputs {
        writeln!(
            out,
            "        for (x, element) in x.iter_mut().zip(observation) {{"
        )?;
        writeln!(out, "            *x = math::finite(*element);\n        }}")?;
    } else {
        out.push_str(CYCLIC_WINDOW);
    }
    writeln!(out, "        let x = &x;")?;
    for team in &plan.marked {
        writeln!(out, "        let mut visited_{team} = false;")?;
    }
    for program in &plan.cached {
        writeln!(out, "        let mut bid_{program} = f32::NAN;")?;
        if plan.acts(*program) {
            writeln!(
                out,
                "        let mut output_{program} = [0.0; {}];",
                plan.values()
            )?;
        }
    }
    if plan.outputs > 0 {
        writeln!(out, "        let mut output = [0.0; {}];", plan.outputs)?;
    }
    if plan.each {
        writeln!(
            out,
            "        let mut bests = [f32::NEG_INFINITY; {}];",
            plan.outputs
        )?;
    }
    writeln!(
        out,
        "        let (mut team, mut winner, mut instructions, mut teams) = (0u16, 0u16, {}, 0u16);",
        if perceives { "perceived" } else { "0u32" }
    )?;
    writeln!(
        out,
        "        for _ in 0..{} {{\n            teams += 1;",
        plan.reached().count()
    )?;
    writeln!(
        out,
        "            let mut best = f32::NEG_INFINITY;\n            team = match team {{"
    )?;
    for (number, team) in plan.reached() {
        write_team(out, plan, number, team)?;
    }
    writeln!(
        out,
        "                _ => break,\n            }};\n        }}"
    )?;
    let action = if plan.outputs > 0 {
        let (low, high) = (number(header.action_low), number(header.action_high));
        format!("math::map(&output, |x| math::clamp(x, {low}, {high}))")
    } else {
        let actions =
            plan.functions()
                .into_iter()
                .filter_map(|f| match plan.program(f.program).target {
                    Target::Atomic(action) if action != 0 => {
                        Some(format!("{} => {action}", f.program))
                    }
                    _ => None,
                });
        let distinct: BTreeSet<String> = actions.collect();
        let arms: Vec<String> = distinct.into_iter().chain(["_ => 0".to_owned()]).collect();
        format!("match winner {{ {} }}", arms.join(", "))
    };
    writeln!(out, "        let action = {action};")?;
    if perceives && plan.outputs > 0 {
        writeln!(out, "        self.perception.action = action;")?;
    } else if perceives {
        writeln!(
            out,
            "        self.perception.action = [math::centred(action, {})];",
            header.actions
        )?;
    }
    writeln!(
        out,
        "        Decision {{ action, winner, instructions, teams }}\n    }}"
    )
}

fn write_team(out: &mut String, plan: &Plan<'_>, number: u16, team: &TeamPlan) -> fmt::Result {
    let pad = " ".repeat(20);
    writeln!(out, "                {number} => {{")?;
    if plan.marked.contains(&number) {
        writeln!(out, "{pad}visited_{number} = true;")?;
    }
    let always = |m: &&Member| m.unless_visited.is_none() && !plan.cached.contains(&m.program);
    let certain: u32 = team
        .members
        .iter()
        .filter(always)
        .map(|m| u32::from(plan.program(m.program).code_len))
        .sum();
    writeln!(out, "{pad}instructions += {certain};")?;
    for member in &team.members {
        write_member(out, plan, number, *member)?;
    }
    let next: Vec<String> = team
        .members
        .iter()
        .filter_map(|m| match plan.program(m.program).target {
            Target::Team(TeamId(next)) => Some(format!("{} => {next}", m.program)),
            Target::Atomic(_) => None,
        })
        .collect();
    if next.is_empty() {
        writeln!(out, "{pad}break\n                }}")
    } else {
        writeln!(
            out,
            "{pad}match winner {{ {}, _ => break }}\n                }}",
            next.join(", ")
        )
    }
}

fn write_member(out: &mut String, plan: &Plan<'_>, team: u16, member: Member) -> fmt::Result {
    let Member {
        program,
        unless_visited,
    } = member;
    let function = plan.function(program, team);
    let call = format!(
        "{}({})",
        name(function),
        arguments(plan, function).join(", ")
    );
    let (acts, cached) = (plan.acts(program), plan.cached.contains(&program));
    let length = plan.program(program).code_len;
    let mut lines = Vec::new();
    if !cached && unless_visited.is_some() {
        lines.push(format!("instructions += {length};"));
    }
    match (cached, acts) {
        (true, _) => {
            let places = if acts {
                format!("(bid_{program}, output_{program})")
            } else {
                format!("bid_{program}")
            };
            lines.push(format!("if bid_{program}.is_nan() {{"));
            lines.push(format!(
                "    instructions += {length};\n{}    {places} = {call};",
                " ".repeat(20)
            ));
            lines.push("}".to_owned());
        }
        (false, true) => lines.push(format!("let (bid_{program}, output_{program}) = {call};")),
        (false, false) => lines.push(format!("let bid_{program} = {call};")),
    }
    let own = plan.own_output(program);
    if let Some(k) = own {
        lines.push(format!(
            "if bid_{program} > bests[{k}] {{ bests[{k}] = bid_{program}; output[{k}] = output_{program}[0]; }}"
        ));
    }
    let take = if acts && own.is_none() {
        format!(" output = output_{program};")
    } else {
        String::new()
    };
    lines.push(format!(
        "if bid_{program} > best {{ best = bid_{program}; winner = {program};{take} }}"
    ));
    let pad = " ".repeat(20);
    if let Some(next) = unless_visited {
        writeln!(out, "{pad}if !visited_{next} {{")?;
    }
    let inner = if unless_visited.is_some() { "    " } else { "" };
    for line in lines {
        writeln!(out, "{pad}{inner}{line}")?;
    }
    if unless_visited.is_some() {
        writeln!(out, "{pad}}}")?;
    }
    Ok(())
}
