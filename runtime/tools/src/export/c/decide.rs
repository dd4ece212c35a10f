//! The walk over teams in C.

use std::collections::BTreeSet;
use std::fmt::{self, Write as _};

use tpg_runtime::math::centred;
use tpg_runtime::tables::{Target, TeamId};

use super::super::plan::{Member, Plan, TeamPlan};
use super::program::{arguments, name, number_text};
use super::signature;

pub(super) fn write_decide(out: &mut String, plan: &Plan<'_>, name: &str) -> fmt::Result {
    let header = plan.policy.header();
    writeln!(
        out,
        "\n{}\n{{\n    float x[{}];",
        signature(plan, name),
        plan.window
    )?;
    let wrap = if plan.window == plan.inputs {
        String::new()
    } else {
        format!(" % {}", plan.inputs)
    };
    let perceives = plan.policy.front_end().is_some();
    if perceives {
        writeln!(
            out,
            "    uint32_t instructions = perceive(self, observation);\n    for (int k = 0; k < {}; k++) x[k] = self->perceived[k{wrap}];",
            plan.window
        )?;
    } else {
        writeln!(
            out,
            "    uint32_t instructions = 0;\n    for (int k = 0; k < {}; k++) x[k] = or_zero(observation[k{wrap}]);",
            plan.window
        )?;
    }
    for team in &plan.marked {
        writeln!(out, "    bool visited_{team} = false;")?;
    }
    for program in &plan.cached {
        writeln!(
            out,
            "    bool ran_{program} = false;\n    float bid_{program} = 0.0f;"
        )?;
        if plan.acts(*program) {
            writeln!(out, "    float output_{program}[{}];", plan.values())?;
        }
    }
    if plan.outputs > 0 {
        writeln!(out, "    float output[{}] = {{ 0.0f }};", plan.outputs)?;
    }
    if plan.each {
        writeln!(
            out,
            "    bool given[{0}] = {{ false }};\n    float bests[{0}] = {{ 0.0f }};",
            plan.outputs
        )?;
    }
    writeln!(out, "    uint16_t team = 0, winner = 0, teams = 0;")?;
    writeln!(
        out,
        "    while (teams < {}) {{\n        bool any = false;\n        float best = 0.0f;",
        plan.reached().count()
    )?;
    writeln!(out, "        teams++;\n        switch (team) {{")?;
    for (number, team) in plan.reached() {
        write_team(out, plan, number, team)?;
    }
    writeln!(
        out,
        "        default: goto decided;\n        }}\n    }}\ndecided:"
    )?;
    writeln!(
        out,
        "    self->instructions = instructions;\n    self->winner = winner;\n    self->teams = teams;"
    )?;
    if plan.outputs > 0 {
        let (low, high) = (
            number_text(header.action_low),
            number_text(header.action_high),
        );
        writeln!(
            out,
            "    for (int k = 0; k < {}; k++) action[k] = clamp(output[k], {low}, {high});",
            plan.outputs
        )?;
        if perceives {
            writeln!(
                out,
                "    for (int k = 0; k < {}; k++) self->decided[k] = action[k];",
                plan.outputs
            )?;
        }
        return writeln!(out, "}}");
    }
    let actions =
        plan.functions()
            .into_iter()
            .filter_map(|f| match plan.program(f.program).target {
                Target::Atomic(action) if action != 0 => Some((f.program, action)),
                _ => None,
            });
    let decide = |action: u16| {
        let decided = number_text(centred(action, header.actions));
        let remember = format!("self->decided[0] = {decided}; ");
        format!(
            "{}return {action};",
            if perceives { remember } else { String::new() }
        )
    };
    writeln!(out, "    switch (winner) {{")?;
    for (program, action) in actions.collect::<BTreeSet<_>>() {
        writeln!(out, "    case {program}: {}", decide(action))?;
    }
    writeln!(out, "    default: {}\n    }}\n}}", decide(0))
}

fn write_team(out: &mut String, plan: &Plan<'_>, number: u16, team: &TeamPlan) -> fmt::Result {
    let pad = " ".repeat(12);
    writeln!(out, "        case {number}: {{")?;
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
    let next = |m: &Member| match plan.program(m.program).target {
        Target::Team(TeamId(next)) => Some((m.program, next)),
        Target::Atomic(_) => None,
    };
    let next: Vec<(u16, u16)> = team.members.iter().filter_map(next).collect();
    if next.is_empty() {
        return writeln!(out, "{pad}goto decided;\n        }}");
    }
    writeln!(out, "{pad}switch (winner) {{")?;
    for (program, next) in next {
        writeln!(out, "{pad}case {program}: team = {next}; break;")?;
    }
    writeln!(
        out,
        "{pad}default: goto decided;\n{pad}}}\n{pad}break;\n        }}"
    )
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
    if acts && !cached {
        lines.push(format!("float output_{program}[{}];", plan.values()));
    }
    if !cached && unless_visited.is_some() {
        lines.push(format!("instructions += {length};"));
    }
    if cached {
        lines.push(format!("if (!ran_{program}) {{"));
        lines.push(format!("    ran_{program} = true;"));
        lines.push(format!("    instructions += {length};"));
        lines.push(format!(
            "    bid_{program} = {call};\n{}}}",
            " ".repeat(if unless_visited.is_some() { 16 } else { 12 })
        ));
    } else {
        lines.push(format!("const float bid_{program} = {call};"));
    }
    let own = plan.own_output(program);
    if let Some(k) = own {
        lines.push(format!(
            "if (!given[{k}] || bid_{program} > bests[{k}]) {{ given[{k}] = true; bests[{k}] = bid_{program}; output[{k}] = output_{program}[0]; }}"
        ));
    }
    let take = if acts && own.is_none() {
        format!(
            " for (int k = 0; k < {}; k++) output[k] = output_{program}[k];",
            plan.outputs
        )
    } else {
        String::new()
    };
    lines.push(format!(
        "if (!any || bid_{program} > best) {{ any = true; best = bid_{program}; winner = {program};{take} }}"
    ));
    let pad = " ".repeat(12);
    if let Some(next) = unless_visited {
        writeln!(out, "{pad}if (!visited_{next}) {{")?;
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
