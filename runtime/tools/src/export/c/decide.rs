//! Writes a decision in C.

use std::fmt::{self, Write as _};

use tpg_runtime::math::centred;
use tpg_runtime::tables::Range;

use super::super::decision::{Bidder, WriteDecision, write_teams};
use super::super::text::function_name;
use super::program::{C, number_text};
use super::text::signature;

pub(super) fn write_decide(out: &mut String, c: &C<'_, '_>) -> fmt::Result {
    let (plan, name) = (c.plan, c.prefix);
    let header = plan.policy.header();
    writeln!(
        out,
        "\n{}\n{{\n    float x[{}];",
        signature(plan, name),
        plan.window
    )?;
    // Elements of the newest observation, which the whole window repeats where it holds no others.
    let newest = if plan.earlier() > 0 {
        plan.inputs
    } else {
        plan.window
    };
    let wrap = if newest == plan.inputs {
        String::new()
    } else {
        format!(" % {}", plan.inputs)
    };
    let perceives = plan.policy.front_end().is_some();
    if perceives {
        writeln!(
            out,
            "    uint32_t instructions = perceive(self, observation);\n    for (int k = 0; k < {newest}; k++) x[k] = self->perceived[k{wrap}];"
        )?;
    } else {
        writeln!(
            out,
            "    uint32_t instructions = 0;\n    for (int k = 0; k < {newest}; k++) x[k] = or_zero(observation[k{wrap}]);"
        )?;
    }
    if plan.earlier() > 0 {
        let (earlier, inputs) = (plan.earlier(), plan.inputs);
        writeln!(
            out,
            "    for (int k = 0; k < {earlier}; k++) x[{inputs} + k] = self->earlier[k];\n    \
             for (int k = 0; k < {earlier}; k++) self->earlier[k] = x[k];"
        )?;
        if plan.window > plan.observed {
            let (observed, window) = (plan.observed, plan.window);
            writeln!(
                out,
                "    for (int k = {observed}; k < {window}; k++) x[k] = x[k - {observed}];"
            )?;
        }
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
    write_teams(out, plan, c);
    writeln!(
        out,
        "        default: goto decided;\n        }}\n    }}\ndecided:"
    )?;
    writeln!(
        out,
        "    self->instructions = instructions;\n    self->winner = winner;\n    self->teams = teams;"
    )?;
    if plan.outputs > 0 {
        let (low, high) = if plan.has_one_range() {
            (
                number_text(header.action_low),
                number_text(header.action_high),
            )
        } else {
            let array = |name: &str, bound: fn(Range) -> f32| {
                let values = plan.policy.output_ranges().map(bound).map(number_text);
                let values = values.collect::<Vec<_>>().join(", ");
                format!(
                    "    static const float {name}[{}] = {{{values}}};\n",
                    plan.outputs
                )
            };
            out.push_str(&array("lowest", |range| range.low));
            out.push_str(&array("highest", |range| range.high));
            ("lowest[k]".to_owned(), "highest[k]".to_owned())
        };
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
    let decide = |action: u16| {
        let decided = number_text(centred(action, header.actions));
        let remember = format!("self->decided[0] = {decided}; ");
        format!(
            "{}return {action};",
            if perceives { remember } else { String::new() }
        )
    };
    writeln!(out, "    switch (winner) {{")?;
    for (program, action) in plan.actions() {
        writeln!(out, "    case {program}: {}", decide(action))?;
    }
    writeln!(out, "    default: {}\n    }}\n}}", decide(0))
}

impl WriteDecision for C<'_, '_> {
    const INDENT: usize = 12;

    fn open_team(&self, team: u16) -> String {
        format!("        case {team}: {{\n")
    }

    fn unless_visited(&self, team: u16) -> String {
        format!("if (!visited_{team}) {{")
    }

    fn run(&self, bidder: &Bidder, count: bool) -> Vec<String> {
        let program = bidder.program;
        let call = format!(
            "{}({})",
            function_name(bidder.function),
            self.arguments(bidder.function).join(", ")
        );
        let counted = format!("instructions += {};", bidder.instructions);
        if bidder.cached {
            return vec![
                format!("if (!ran_{program}) {{"),
                format!("    ran_{program} = true;"),
                format!("    {counted}"),
                format!("    bid_{program} = {call};"),
                "}".to_owned(),
            ];
        }
        let values = self.plan.values();
        let output = bidder
            .acts
            .then(|| format!("float output_{program}[{values}];"));
        let counted = count.then_some(counted);
        let run = format!("const float bid_{program} = {call};");
        output.into_iter().chain(counted).chain([run]).collect()
    }

    fn compare(&self, bidder: &Bidder) -> Vec<String> {
        let program = bidder.program;
        let own = bidder.own_output.map(|k| {
            format!(
                "if (!given[{k}] || bid_{program} > bests[{k}]) {{ given[{k}] = true; bests[{k}] = bid_{program}; output[{k}] = output_{program}[0]; }}"
            )
        });
        let take = if bidder.acts && own.is_none() {
            let outputs = self.plan.outputs;
            format!(" for (int k = 0; k < {outputs}; k++) output[k] = output_{program}[k];")
        } else {
            String::new()
        };
        let best = format!(
            "if (!any || bid_{program} > best) {{ any = true; best = bid_{program}; winner = {program};{take} }}"
        );
        own.into_iter().chain([best]).collect()
    }

    fn close_team(&self, next: &[(u16, u16)]) -> String {
        let pad = " ".repeat(Self::INDENT);
        if next.is_empty() {
            return format!("{pad}goto decided;\n        }}\n");
        }
        let case =
            |(winner, team): &(u16, u16)| format!("{pad}case {winner}: team = {team}; break;\n");
        let cases: String = next.iter().map(case).collect();
        format!(
            "{pad}switch (winner) {{\n{cases}{pad}default: goto decided;\n{pad}}}\n{pad}break;\n        }}\n"
        )
    }
}
