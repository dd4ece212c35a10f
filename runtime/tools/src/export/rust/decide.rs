//! Writes a decision in Rust.

use std::fmt::{self, Write as _};

use super::super::decision::{Bidder, WriteDecision, write_teams};
use super::super::plan::Plan;
use super::super::text::function_name;
use super::program::{Rust, arguments, number};

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

/// Fills the start of a window with the observation and those before it, and keeps them for the next decision.
const HISTORY: &str =
    "        let newest = observation.iter().map(|element| math::finite(*element));
        for (x, element) in x.iter_mut().zip(newest.chain(self.earlier)) {
            *x = element;
        }
        for (earlier, element) in self.earlier.iter_mut().zip(&x) {
            *earlier = *element;
        }
";

/// Passes the observation through the front end before it reaches the window.
const PERCEIVE: &str = "        let perceived = self.perception.perceive(observation);
        let observation = &self.perception.x;
";

pub(super) fn write_decide(out: &mut String, plan: &Plan<'_>) -> fmt::Result {
    let header = plan.policy.header();
    let filled = plan.policy.front_end().is_some() && header.has_missing_values();
    writeln!(
        out,
        "\n    /// Chooses the action for an observation; {}.",
        if filled {
            "elements that are not finite are missing, and the front end fills them in"
        } else {
            "its non-finite elements count as 0"
        }
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
    if plan.earlier() > 0 {
        out.push_str(HISTORY);
        if plan.window > plan.observed {
            let observed = plan.observed;
            writeln!(
                out,
                "        let (first, rest) = x.split_at_mut({observed});\n        for again in rest.chunks_mut({observed}) {{\n            \
                 for (x, element) in again.iter_mut().zip(&*first) {{\n                *x = *element;\n            }}\n        }}"
            )?;
        }
    } else if plan.window == plan.inputs {
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
    write_teams(out, plan, &Rust(plan));
    writeln!(
        out,
        "                _ => break,\n            }};\n        }}"
    )?;
    let action = if plan.outputs > 0 {
        if plan.has_one_range() {
            let (low, high) = (number(header.action_low), number(header.action_high));
            format!("math::map(&output, |x| math::clamp(x, {low}, {high}))")
        } else {
            let clamped = plan.policy.output_ranges().enumerate().map(|(k, range)| {
                let (low, high) = (number(range.low), number(range.high));
                format!("math::clamp(output[{k}], {low}, {high})")
            });
            format!("[{}]", clamped.collect::<Vec<_>>().join(", "))
        }
    } else {
        let actions = plan.actions().into_iter();
        let mut arms: Vec<String> = actions
            .map(|(program, action)| format!("{program} => {action}"))
            .collect();
        // Sort by text, to keep the order of modules exported earlier.
        arms.sort_unstable();
        arms.push("_ => 0".to_owned());
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

impl WriteDecision for Rust<'_, '_> {
    const INDENT: usize = 20;

    fn open_team(&self, team: u16) -> String {
        format!("                {team} => {{\n")
    }

    fn unless_visited(&self, team: u16) -> String {
        format!("if !visited_{team} {{")
    }

    fn run(&self, bidder: &Bidder, count: bool) -> Vec<String> {
        let program = bidder.program;
        let call = format!(
            "{}({})",
            function_name(bidder.function),
            arguments(self.0, bidder.function).join(", ")
        );
        let results = if bidder.acts {
            format!("(bid_{program}, output_{program})")
        } else {
            format!("bid_{program}")
        };
        let counted = format!("instructions += {};", bidder.instructions);
        if bidder.cached {
            return vec![
                format!("if bid_{program}.is_nan() {{"),
                format!("    {counted}"),
                format!("    {results} = {call};"),
                "}".to_owned(),
            ];
        }
        let counted = count.then_some(counted);
        let run = format!("let {results} = {call};");
        counted.into_iter().chain([run]).collect()
    }

    fn compare(&self, bidder: &Bidder) -> Vec<String> {
        let program = bidder.program;
        let own = bidder.own_output.map(|k| {
            format!(
                "if bid_{program} > bests[{k}] {{ bests[{k}] = bid_{program}; output[{k}] = output_{program}[0]; }}"
            )
        });
        let take = if bidder.acts && own.is_none() {
            format!(" output = output_{program};")
        } else {
            String::new()
        };
        let best = format!(
            "if bid_{program} > best {{ best = bid_{program}; winner = {program};{take} }}"
        );
        own.into_iter().chain([best]).collect()
    }

    fn close_team(&self, next: &[(u16, u16)]) -> String {
        let pad = " ".repeat(Self::INDENT);
        if next.is_empty() {
            return format!("{pad}break\n                }}\n");
        }
        let arms = next
            .iter()
            .map(|(winner, team)| format!("{winner} => {team}"));
        let arms: Vec<String> = arms.collect();
        format!(
            "{pad}match winner {{ {}, _ => break }}\n                }}\n",
            arms.join(", ")
        )
    }
}
