//! The header of a C module.

use std::fmt::{self, Write as _};

use tpg_runtime::front_end::action_variables;
use tpg_runtime::tables::Section;

use super::super::plan::Plan;
use super::super::text::letter;
use super::super::values::sections;
use super::perception::write_fields;
use super::program::C;
use super::stack::stack_bytes;
use super::text::{comment, signature};

/// What a caller has to know, apart from names and units.
fn contract(plan: &Plan<'_>) -> Vec<String> {
    let perceives = plan.policy.front_end().is_some();
    let missing = if perceives && plan.policy.header().has_missing_values() {
        "An element of an observation that is not finite (NaN or infinite) is missing: the policy's front end fills it in."
    } else {
        "An element of an observation that is not finite (NaN or infinite) counts as 0."
    };
    let mut lines = vec![String::new(), missing.to_owned()];
    if perceives && !plan.policy.header().has_missing_values() {
        lines.push("An observation of nothing but zeros counts as missing.".to_owned());
    }
    lines.extend(
        [
            "All state is in the structure that the caller passes: no global variables, no heap, no recursion, no locks.",
            "Several threads or interrupt handlers may decide at once, each with a structure of its own.",
            "The stack that a decision takes depends on the compiler: -fstack-usage shows it, below is an estimate.",
        ]
        .map(str::to_owned),
    );
    lines
}

/// The size of the state's structure in bytes, on machines that align 64-bit numbers to at most 8 bytes.
fn state_bytes(c: &C<'_, '_>) -> usize {
    let plan = c.plan;
    let mut bytes = 0;
    if plan.is_indexed() {
        bytes += (16 + 4 * plan.cells.len()).next_multiple_of(8);
    }
    for (_, team) in plan.remembering() {
        let streams = 16 * sections(team).count();
        bytes += (streams + 4 * team.memory_words(plan.width)).next_multiple_of(8);
    }
    let registers = c.kept().values().flatten();
    bytes += 4 * registers.map(|r| r.values.len()).sum::<usize>();
    bytes += 4 * plan.earlier();
    if plan.policy.front_end().is_some() {
        bytes += 4 * (plan.inputs + action_variables(plan.policy.header()));
    }
    // Instructions, winner and teams of the last decision.
    bytes += 8;
    let aligned = plan.is_indexed() || plan.remembering().next().is_some();
    bytes.next_multiple_of(if aligned { 8 } else { 4 })
}

pub(super) fn write_header(
    out: &mut String,
    plan: &Plan<'_>,
    name: &str,
    command: &str,
) -> fmt::Result {
    let upper = name.to_uppercase();
    let c = C::new(plan, name);
    out.push_str(&comment(plan, command, &contract(plan)));
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
        "/* Words of shared memory. */\n#define {upper}_MEMORY {}",
        plan.memory_words()
    )?;
    writeln!(
        out,
        "/* Most instructions of the policy that a decision can execute. */\n#define {upper}_WORST_INSTRUCTIONS {}",
        plan.policy.bounds().instructions
    )?;
    writeln!(
        out,
        "/* Most bytes that the state takes. */\n#define {upper}_STATE_BYTES {}",
        state_bytes(&c)
    )?;
    writeln!(
        out,
        "/* Stack of a decision in bytes, estimated: what the text declares, and some more. GCC for Cortex-M takes less with -Os. */\n#define {upper}_STACK_BYTES {}\n",
        stack_bytes(&c)
    )?;
    for (program, registers) in c.kept() {
        writeln!(out, "typedef struct {{")?;
        for register in registers {
            writeln!(
                out,
                "    float {}{}{};",
                letter(register.section),
                register.number,
                size(plan, register.section)
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
        for slot in plan.slots(team) {
            writeln!(
                out,
                "    float {}m{}{};",
                letter(slot.section),
                slot.number,
                size(plan, slot.section)
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
    for program in c.kept().keys() {
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
        "/* Compiles only where the state is as small as stated. */\ntypedef char {name}_state_fits[sizeof({name}) <= {upper}_STATE_BYTES ? 1 : -1];\n"
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
    writeln!(out, "/* Decides and {returns}. */")?;
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
