//! Front ends in Rust.

use std::fmt::{self, Write as _};

use tpg_runtime::front_end::{Fallback, FrontEnd, action_variables};

use super::super::plan::Plan;
use super::super::values::floats;
use super::program::list;

/// Writes the tables of a front end, and the type that holds what it perceived last.
pub(super) fn write_perception(out: &mut String, plan: &Plan<'_>) -> fmt::Result {
    let Some(front_end) = plan.policy.front_end() else {
        return Ok(());
    };
    let header = plan.policy.header();
    let columns: Vec<String> = plan.believed().iter().map(u16::to_string).collect();
    let actions = action_variables(header);
    writeln!(
        out,
        "\nconst MEANS: [f32; INPUTS] = {};\nconst SCALES: [f32; INPUTS] = {};",
        list(&floats(front_end.means)),
        list(&floats(front_end.scales))
    )?;
    if front_end.fallback == Fallback::Model {
        let coefficients: Vec<String> = (front_end.coefficients.iter())
            .map(|bytes| format!("{bytes:?}"))
            .collect();
        writeln!(
            out,
            "const BELIEVED: [usize; {}] = [{}];",
            columns.len(),
            columns.join(", ")
        )?;
        writeln!(
            out,
            "static COEFFICIENTS: [[u8; 4]; {}] = [{}];",
            coefficients.len(),
            coefficients.join(", ")
        )?;
    }
    writeln!(
        out,
        "\n#[derive(Debug, Clone)]\nstruct Perception {{\n    x: [f32; INPUTS],\n    action: [f32; {actions}],\n}}"
    )?;
    writeln!(
        out,
        "\nimpl Perception {{\n    const START: Self = Perception {{ x: [0.0; INPUTS], action: [0.0; {actions}] }};"
    )?;
    writeln!(
        out,
        "\n    /// Perceives an observation and returns the instructions that it counts as."
    )?;
    writeln!(
        out,
        "    fn perceive(&mut self, observation: &[f32; INPUTS]) -> u32 {{"
    )?;
    if header.has_missing_values() {
        write_each(out, plan, &front_end)?;
    } else {
        write_whole(out, plan, &front_end)?;
    }
    writeln!(out, "    }}\n}}")
}

/// The body for policies in which each element can be missing by itself.
fn write_each(out: &mut String, plan: &Plan<'_>, front_end: &FrontEnd<'_>) -> fmt::Result {
    writeln!(out, "        let mut instructions = 0;")?;
    if front_end.fallback == Fallback::Model {
        out.push_str(
            "        let seen = |k: &usize| observation.get(*k).is_some_and(|o| o.is_finite());\n",
        );
        writeln!(out, "        if !BELIEVED.iter().all(seen) {{")?;
        let mut text = String::new();
        write_changes(&mut text, plan, front_end)?;
        text.push_str(
            "        for (k, change) in BELIEVED.iter().zip(sums).filter(|(k, _)| !seen(k)) {
            if let Some(x) = self.x.get_mut(*k) {
                *x = math::predict(*x, change);
            }
        }
",
        );
        for line in text.lines() {
            writeln!(out, "    {line}")?;
        }
        writeln!(
            out,
            "            instructions += {};\n        }}",
            front_end.model_instructions(plan.policy.header())
        )?;
    }
    out.push_str(
        "        let scaling = MEANS.iter().zip(&SCALES);
        for ((x, o), (mean, scale)) in self.x.iter_mut().zip(observation).zip(scaling) {
            if o.is_finite() {
                *x = math::standardise(*o, *mean, *scale);
                instructions += 1;
",
    );
    if front_end.fallback == Fallback::Zero {
        writeln!(
            out,
            "            }} else {{\n                *x = 0.0;\n            }}"
        )?;
    } else {
        writeln!(out, "            }}")?;
    }
    writeln!(out, "        }}\n        instructions")
}

/// The body for policies of versions 1 and 2: all elements are missing, or none is.
fn write_whole(out: &mut String, plan: &Plan<'_>, front_end: &FrontEnd<'_>) -> fmt::Result {
    writeln!(
        out,
        "        if !math::is_blank(observation) {{\n            let scaling = MEANS.iter().zip(&SCALES);"
    )?;
    writeln!(
        out,
        "            for ((x, o), (mean, scale)) in self.x.iter_mut().zip(observation).zip(scaling) {{"
    )?;
    writeln!(
        out,
        "                *x = math::standardise(*o, *mean, *scale);\n            }}\n            return {};\n        }}",
        front_end.visible_instructions()
    )?;
    write_blank(out, plan, front_end)?;
    writeln!(
        out,
        "        {}",
        front_end.model_instructions(plan.policy.header())
    )
}

fn write_blank(out: &mut String, plan: &Plan<'_>, front_end: &FrontEnd<'_>) -> fmt::Result {
    match front_end.fallback {
        Fallback::Hold => Ok(()),
        Fallback::Zero => writeln!(out, "        self.x = [0.0; INPUTS];"),
        Fallback::Model => {
            write_changes(out, plan, front_end)?;
            out.push_str(ADD);
            Ok(())
        }
        // The exporter handles every fallback of the runtime that it is built with.
        _ => Err(fmt::Error),
    }
}

/// The statements that compute the model's sums.
fn write_changes(out: &mut String, plan: &Plan<'_>, front_end: &FrontEnd<'_>) -> fmt::Result {
    let variables = front_end.columns.len() + action_variables(plan.policy.header());
    writeln!(out, "        let mut variables = [0.0; {variables}];")?;
    out.push_str(BELIEVE);
    writeln!(
        out,
        "        math::changes(&mut sums, &variables, {}, &COEFFICIENTS);",
        front_end.degree
    )
}

const BELIEVE: &str =
    "        let believed = BELIEVED.iter().map(|k| self.x.get(*k).copied().unwrap_or(0.0));
        for (variable, x) in variables.iter_mut().zip(believed.chain(self.action)) {
            *variable = x;
        }
        let mut sums = [0.0; BELIEVED.len()];
";

const ADD: &str = "        for (k, change) in BELIEVED.iter().zip(sums) {
            if let Some(x) = self.x.get_mut(*k) {
                *x = math::predict(*x, change);
            }
        }
";
