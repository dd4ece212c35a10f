//! Front ends in C, and what of earlier observations is kept.

use std::fmt::{self, Write as _};

use tpg_runtime::front_end::{Fallback, FrontEnd, action_variables};
use tpg_runtime::math::LIMIT;

use super::super::plan::Plan;
use super::super::values::floats;
use super::library::Snippet;
use super::program::{list, number_text};

/// Writes the fields in the policy's structure that hold observations.
pub(super) fn write_fields(out: &mut String, plan: &Plan<'_>) -> fmt::Result {
    if plan.earlier() > 0 {
        writeln!(out, "    float earlier[{}];", plan.earlier())?;
    }
    if plan.policy.front_end().is_none() {
        return Ok(());
    }
    let actions = action_variables(plan.policy.header());
    writeln!(
        out,
        "    float perceived[{}];\n    float decided[{actions}];",
        plan.inputs
    )
}

/// Writes the statements that reset these fields.
pub(super) fn write_reset(out: &mut String, plan: &Plan<'_>) -> fmt::Result {
    if plan.earlier() > 0 {
        writeln!(
            out,
            "    for (int k = 0; k < {}; k++) self->earlier[k] = 0.0f;",
            plan.earlier()
        )?;
    }
    if plan.policy.front_end().is_none() {
        return Ok(());
    }
    let actions = action_variables(plan.policy.header());
    writeln!(
        out,
        "    for (int k = 0; k < {}; k++) self->perceived[k] = 0.0f;\n    for (int k = 0; k < {actions}; k++) self->decided[k] = 0.0f;",
        plan.inputs
    )
}

/// The functions that perceive an observation; the last one returns the instructions that it counts as.
pub(super) fn perceive(plan: &Plan<'_>, name: &str) -> Result<Vec<Snippet>, fmt::Error> {
    let Some(front_end) = plan.policy.front_end() else {
        return Ok(Vec::new());
    };
    let limit = number_text(LIMIT);
    let perceptible = format!(
        "static inline float perceptible(float x) {{ return clamp(or_zero(x), -{limit}, {limit}); }}\n"
    );
    // By its bits, so that no option of a compiler can assume that there is no NaN.
    let seen = "/* NaN and infinities stand for elements that are missing. */\nstatic inline bool is_seen(float x) { return op_abs(x) <= FLT_MAX; }\n";
    let mut text = String::new();
    write_perceive(&mut text, plan, name, &front_end)?;
    Ok([seen.to_owned(), perceptible, text]
        .map(Snippet::new)
        .to_vec())
}

fn write_perceive(
    out: &mut String,
    plan: &Plan<'_>,
    name: &str,
    front_end: &FrontEnd<'_>,
) -> fmt::Result {
    let (header, n) = (plan.policy.header(), plan.inputs);
    writeln!(
        out,
        "static uint32_t perceive({name} *self, const float *observation)\n{{"
    )?;
    writeln!(
        out,
        "    static const float means[{n}] = {};\n    static const float scales[{n}] = {};",
        list(&floats(front_end.means)),
        list(&floats(front_end.scales))
    )?;
    if header.has_missing_values() {
        write_each(out, plan, front_end)
    } else {
        write_whole(out, plan, front_end)
    }
}

/// The body for policies in which each element can be missing by itself.
fn write_each(out: &mut String, plan: &Plan<'_>, front_end: &FrontEnd<'_>) -> fmt::Result {
    let (header, n) = (plan.policy.header(), plan.inputs);
    writeln!(out, "    uint32_t counted = 0;")?;
    if front_end.fallback == Fallback::Model {
        let c = front_end.columns.len();
        write_model_tables(out, plan, front_end)?;
        writeln!(
            out,
            "    bool believing = false;\n    for (int k = 0; k < {c}; k++) believing = believing || !is_seen(observation[believed[k]]);"
        )?;
        writeln!(out, "    if (believing) {{")?;
        let mut text = String::new();
        write_sums(&mut text, plan, front_end)?;
        writeln!(
            text,
            "    for (int q = 0; q < {c}; q++) {{\n        float *x = &self->perceived[believed[q]];\n        if (!is_seen(observation[believed[q]])) *x = perceptible(*x + sums[q]);\n    }}"
        )?;
        writeln!(
            text,
            "    counted = {};",
            front_end.model_instructions(header)
        )?;
        for line in text.lines() {
            writeln!(out, "    {line}")?;
        }
        writeln!(out, "    }}")?;
    }
    let missing = match front_end.fallback {
        Fallback::Zero => " else {\n            self->perceived[k] = 0.0f;\n        }",
        _ => "",
    };
    writeln!(
        out,
        "    for (int k = 0; k < {n}; k++) {{\n        if (is_seen(observation[k])) {{\n            self->perceived[k] = perceptible((observation[k] - means[k]) * scales[k]);\n            counted++;\n        }}{missing}\n    }}\n    return counted;\n}}"
    )
}

/// The body for policies of versions 1 and 2: all elements are missing, or none is.
fn write_whole(out: &mut String, plan: &Plan<'_>, front_end: &FrontEnd<'_>) -> fmt::Result {
    let (header, n) = (plan.policy.header(), plan.inputs);
    writeln!(
        out,
        "    bool blank = true;\n    for (int k = 0; k < {n}; k++) blank = blank && or_zero(observation[k]) == 0.0f;"
    )?;
    writeln!(
        out,
        "    if (!blank) {{\n        for (int k = 0; k < {n}; k++)\n            self->perceived[k] = perceptible((or_zero(observation[k]) - means[k]) * scales[k]);\n        return {};\n    }}",
        front_end.visible_instructions()
    )?;
    match front_end.fallback {
        Fallback::Hold => {}
        Fallback::Zero => writeln!(
            out,
            "    for (int k = 0; k < {n}; k++) self->perceived[k] = 0.0f;"
        )?,
        Fallback::Model => write_belief(out, plan, front_end)?,
        // The exporter handles every fallback of the runtime that it is built with.
        _ => return Err(fmt::Error),
    }
    writeln!(
        out,
        "    return {};\n}}",
        front_end.model_instructions(header)
    )
}

/// The statements that add what the model predicts to all believed columns.
fn write_belief(out: &mut String, plan: &Plan<'_>, front_end: &FrontEnd<'_>) -> fmt::Result {
    write_model_tables(out, plan, front_end)?;
    write_sums(out, plan, front_end)?;
    writeln!(
        out,
        "    for (int q = 0; q < {}; q++) {{\n        float *x = &self->perceived[believed[q]];\n        *x = perceptible(*x + sums[q]);\n    }}",
        front_end.columns.len()
    )
}

/// The believed columns and the model's coefficients.
fn write_model_tables(out: &mut String, plan: &Plan<'_>, front_end: &FrontEnd<'_>) -> fmt::Result {
    let columns = plan.believed();
    let numbers: Vec<String> = columns.iter().map(u16::to_string).collect();
    let coefficients = floats(front_end.coefficients);
    writeln!(
        out,
        "    static const uint16_t believed[{}] = {{ {} }};\n    static const float coefficients[{}] = {};",
        columns.len(),
        numbers.join(", "),
        coefficients.len(),
        list(&coefficients)
    )
}

/// The statements that compute the model's sums.
fn write_sums(out: &mut String, plan: &Plan<'_>, front_end: &FrontEnd<'_>) -> fmt::Result {
    let actions = action_variables(plan.policy.header());
    let (c, v) = (front_end.columns.len(), front_end.columns.len() + actions);
    writeln!(
        out,
        "    float v[{v}], sums[{c}];\n    const float *row = coefficients;"
    )?;
    writeln!(
        out,
        "    for (int k = 0; k < {c}; k++) v[k] = self->perceived[believed[k]];\n    for (int k = 0; k < {actions}; k++) v[{c} + k] = self->decided[k];"
    )?;
    writeln!(
        out,
        "    for (int q = 0; q < {c}; q++) sums[q] = 0.0f + 1.0f * row[q];"
    )?;
    let add = |monomial: &str| {
        format!("row += {c}; for (int q = 0; q < {c}; q++) sums[q] += {monomial} * row[q];")
    };
    writeln!(
        out,
        "    for (int i = 0; i < {v}; i++) {{\n        {}",
        add("v[i]")
    )?;
    if front_end.degree > 1 {
        writeln!(
            out,
            "        for (int j = i; j < {v}; j++) {{\n            const float product = v[i] * v[j];\n            {}",
            add("product")
        )?;
        if front_end.degree > 2 {
            writeln!(
                out,
                "            for (int k = j; k < {v}; k++) {{\n                const float cube = product * v[k];\n                {}\n            }}",
                add("cube")
            )?;
        }
        writeln!(out, "        }}")?;
    }
    writeln!(out, "    }}")
}
