//! The header of a C module.

use std::fmt::{self, Write as _};

use tpg_runtime::tables::Section;

use super::super::plan::Plan;
use super::super::text::letter;
use super::perception::write_fields;
use super::{sections, signature, write_comment};

pub(super) fn write_header(
    out: &mut String,
    plan: &Plan<'_>,
    name: &str,
    command: &str,
) -> fmt::Result {
    let upper = name.to_uppercase();
    write_comment(out, plan, command)?;
    writeln!(
        out,
        "#ifndef {upper}_H\n#define {upper}_H\n\n#include <stdint.h>\n\n#ifdef __cplusplus\nextern \"C\" {{\n#endif\n"
    )?;
    let header = plan.policy.header();
    writeln!(
        out,
        "/* Length of an observation. */\n#define {upper}_INPUTS {}",
        plan.inputs
    )?;
    if plan.outputs > 0 {
        writeln!(
            out,
            "/* Number of outputs. */\n#define {upper}_OUTPUTS {}",
            plan.outputs
        )?;
    } else {
        writeln!(
            out,
            "/* Number of actions. */\n#define {upper}_ACTIONS {}",
            header.actions
        )?;
    }
    writeln!(out, "/* Time between two decisions, in microseconds. */")?;
    writeln!(
        out,
        "#define {upper}_CONTROL_PERIOD_US {}",
        header.control_period_us
    )?;
    writeln!(
        out,
        "/* Words of shared memory. */\n#define {upper}_MEMORY {}\n",
        plan.memory_words()
    )?;
    for program in plan.stateful_programs() {
        writeln!(out, "typedef struct {{")?;
        for (section, number, _) in plan.registers(plan.program(program)) {
            writeln!(
                out,
                "    float {}{number}{};",
                letter(section),
                size(plan, section)
            )?;
        }
        writeln!(out, "}} {name}_registers_{program};\n")?;
    }
    if plan.remembering().next().is_some() {
        writeln!(
            out,
            "typedef struct {{\n    uint64_t state, increment;\n}} {name}_stream;\n"
        )?;
    }
    for (number, team) in plan.remembering() {
        writeln!(out, "typedef struct {{")?;
        for section in sections(team) {
            writeln!(out, "    {name}_stream {}_stream;", letter(section))?;
        }
        for (section, slot, _) in plan.slots(team) {
            writeln!(
                out,
                "    float {}m{slot}{};",
                letter(section),
                size(plan, section)
            )?;
        }
        writeln!(out, "}} {name}_memory_{number};\n")?;
    }
    if plan.is_indexed() {
        writeln!(
            out,
            "typedef struct {{\n    uint64_t stream, writes;\n    float cells[{}];",
            plan.cells.len()
        )?;
        writeln!(out, "}} {name}_indexed;\n")?;
    }
    writeln!(
        out,
        "/* The policy's state; the caller owns it. */\ntypedef struct {{"
    )?;
    if plan.is_indexed() {
        writeln!(out, "    {name}_indexed indexed;")?;
    }
    for (number, _) in plan.remembering() {
        writeln!(out, "    {name}_memory_{number} team_{number};")?;
    }
    for program in plan.stateful_programs() {
        writeln!(out, "    {name}_registers_{program} program_{program};")?;
    }
    write_fields(out, plan)?;
    writeln!(
        out,
        "    uint32_t instructions; /* Executed in the last decision. */"
    )?;
    writeln!(
        out,
        "    uint16_t winner;       /* Number of the program that won at its last team. */"
    )?;
    writeln!(
        out,
        "    uint16_t teams;        /* Teams that it visited. */\n}} {name};\n"
    )?;
    writeln!(
        out,
        "typedef enum {{\n    {upper}_AGENT,   /* The agent starts: its first episode of an evaluation. */"
    )?;
    writeln!(
        out,
        "    {upper}_EPISODE, /* A further episode of the same agent. */\n}} {name}_reset_kind;\n"
    )?;
    writeln!(
        out,
        "/* Makes the state as loaded: everything reset, with seed 0. */\nvoid {name}_init({name} *self);\n"
    )?;
    writeln!(
        out,
        "/* Begins an agent or an episode of it; the reset scope is {}. */",
        header.reset_scope.name()
    )?;
    writeln!(
        out,
        "void {name}_reset({name} *self, {name}_reset_kind what, uint64_t agent_seed);\n"
    )?;
    let returns = if plan.outputs > 0 {
        "writes one value for each output"
    } else {
        "returns the action's index"
    };
    writeln!(
        out,
        "/* Decides and {returns}; non-finite elements of the observation count as 0. */"
    )?;
    writeln!(out, "{};", signature(plan, name))?;
    if plan.memory_words() > 0 {
        writeln!(
            out,
            "\n/* Copies the memory that programs share: the teams' slots, then the kept cells. */"
        )?;
        writeln!(
            out,
            "void {name}_memory(const {name} *self, float memory[{upper}_MEMORY]);\n"
        )?;
        writeln!(
            out,
            "/* Overwrites it, for scopes in which it outlives the agent. */"
        )?;
        writeln!(
            out,
            "void {name}_set_memory({name} *self, const float memory[{upper}_MEMORY]);"
        )?;
    }
    writeln!(out, "\n#ifdef __cplusplus\n}}\n#endif\n\n#endif")
}

fn size(plan: &Plan<'_>, section: Section) -> String {
    match section {
        Section::Scalar => String::new(),
        _ => format!("[{}]", section.slot_words(plan.width)),
    }
}
