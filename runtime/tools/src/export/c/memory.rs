//! Shared memory, random streams and resets in C.

use std::fmt::{self, Write as _};

use tpg_runtime::memory::write_threshold;
use tpg_runtime::tables::Section;

use super::super::plan::Plan;
use super::super::text::letter;
use super::perception::write_reset;
use super::program::{list, number_text};
use super::sections;

/// What writes shared memory and makes its streams.
pub(super) fn write_memories(out: &mut String, plan: &Plan<'_>, name: &str) -> fmt::Result {
    let teams = plan.remembering().next().is_some();
    let distribution = plan.policy.header().write_distribution;
    if teams || plan.is_indexed() {
        out.push_str(include_str!("assets/random.c"));
    }
    if teams {
        let thresholds = distribution.slot_thresholds().iter();
        let thresholds: Vec<String> = thresholds.map(|t| format!("{t}u")).collect();
        let text = include_str!("assets/slots.c").replace("TPG_STREAM", &format!("{name}_stream"));
        out.push_str(&text.replace("TPG_SLOT_THRESHOLDS", &thresholds.join(", ")));
    }
    for (number, team) in plan.remembering() {
        for section in sections(team) {
            let letter = letter(section);
            let value = if section == Section::Scalar {
                "float x"
            } else {
                "const float *x"
            };
            writeln!(
                out,
                "\nstatic inline void write_{letter}_in_team_{number}({name}_memory_{number} *memory, {value})\n{{"
            )?;
            writeln!(out, "    switch (draw_slot(&memory->{letter}_stream)) {{")?;
            for (_, slot, values) in plan
                .slots(team)
                .iter()
                .filter(|(kind, ..)| *kind == section)
            {
                let store = match section {
                    Section::Scalar => format!("memory->sm{slot} = x"),
                    _ => format!("copy(memory->{letter}m{slot}, x, {})", values.len()),
                };
                writeln!(out, "    case {slot}: {store}; break;")?;
            }
            writeln!(out, "    default: break;\n    }}\n}}")?;
        }
    }
    if plan.is_indexed() {
        let join = |values: Vec<String>| values.join(", ");
        let cells = join(plan.cells.iter().map(u16::to_string).collect());
        let thresholds = join(
            plan.cells
                .iter()
                .map(|c| format!("{}u", write_threshold(*c, distribution)))
                .collect(),
        );
        let n = plan.cells.len();
        writeln!(
            out,
            "\n/* Kept cells (row * 8 + column), and the chances of 2^32 that a write reaches them. */"
        )?;
        writeln!(out, "static const uint16_t cells[{n}] = {{ {cells} }};")?;
        writeln!(
            out,
            "static const uint32_t chances[{n}] = {{ {thresholds} }};"
        )?;
        writeln!(
            out,
            "\nstatic inline void write_cells({name}_indexed *indexed, const float registers[8])\n{{\n    \
             const uint64_t write = indexed->writes++;\n    for (int k = 0; k < {n}; k++) {{\n        \
             const uint64_t words[3] = {{ indexed->stream, write, cells[k] }};\n        \
             if ((uint32_t)(mix64(words, 3) >> 32) < chances[k]) indexed->cells[k] = registers[cells[k] % 8];\n    }}\n}}"
        )?;
    }
    Ok(())
}

pub(super) fn write_resets(out: &mut String, plan: &Plan<'_>, name: &str) -> fmt::Result {
    let upper = name.to_uppercase();
    let scope = plan.policy.header().reset_scope;
    let programs = plan.stateful_programs();
    writeln!(
        out,
        "\nstatic void reset_registers({name} *self, uint64_t agent_seed)\n{{\n    (void)self;\n    (void)agent_seed;"
    )?;
    for program in programs {
        let values: Vec<String> = plan
            .registers(plan.program(program))
            .iter()
            .map(|(section, _, values)| match section {
                Section::Scalar => number_text(values[0]),
                _ => list(values),
            })
            .collect();
        writeln!(
            out,
            "    static const {name}_registers_{program} initial_{program} = {{ {} }};",
            values.join(", ")
        )?;
        writeln!(out, "    self->program_{program} = initial_{program};")?;
    }
    for (number, team) in plan.remembering() {
        for section in sections(team) {
            let (letter, key) = (letter(section), team.stream_key);
            let section = section as u8;
            writeln!(
                out,
                "    self->team_{number}.{letter}_stream = slot_stream(agent_seed, {key}u, {section});"
            )?;
        }
    }
    if plan.is_indexed() {
        writeln!(
            out,
            "    const uint64_t words[3] = {{ agent_seed, 0, {} }};",
            Section::ALL.len()
        )?;
        writeln!(
            out,
            "    self->indexed.stream = mix64(words, 3);\n    self->indexed.writes = 0;"
        )?;
    }
    writeln!(
        out,
        "}}\n\nstatic void reset_memory({name} *self)\n{{\n    (void)self;"
    )?;
    for (number, team) in plan.remembering() {
        for (section, slot, values) in plan.slots(team) {
            let place = format!("self->team_{number}.{}m{slot}", letter(section));
            write_values(out, &place, section == Section::Scalar, &values)?;
        }
    }
    if plan.is_indexed() {
        write_values(out, "self->indexed.cells", false, &plan.cell_values())?;
    }
    writeln!(
        out,
        "}}\n\nvoid {name}_init({name} *self)\n{{\n    self->instructions = 0;\n    self->winner = 0;\n    self->teams = 0;"
    )?;
    write_reset(out, plan)?;
    writeln!(
        out,
        "    reset_memory(self);\n    reset_registers(self, 0);\n}}\n"
    )?;
    writeln!(
        out,
        "void {name}_reset({name} *self, {name}_reset_kind what, uint64_t agent_seed)\n{{"
    )?;
    write_reset(out, plan)?;
    let (agent, episode) = (scope.at_agent(), scope.at_episode());
    for (call, when) in [
        ("reset_memory(self)", [agent.1, episode.1]),
        ("reset_registers(self, agent_seed)", [agent.0, episode.0]),
    ] {
        let condition = match when {
            [true, true] => String::new(),
            [true, false] => format!("if (what == {upper}_AGENT) "),
            [false, true] => format!("if (what == {upper}_EPISODE) "),
            [false, false] => continue,
        };
        writeln!(out, "    {condition}{call};")?;
    }
    writeln!(out, "    (void)what;\n}}")
}

fn write_values(out: &mut String, place: &str, scalar: bool, values: &[f32]) -> fmt::Result {
    if scalar {
        return writeln!(out, "    {place} = {};", number_text(values[0]));
    }
    let n = values.len();
    if values.iter().all(|x| x.to_bits() == 0) {
        return writeln!(out, "    for (int k = 0; k < {n}; k++) {place}[k] = 0.0f;");
    }
    let values = list(values);
    writeln!(
        out,
        "    {{\n        static const float values[{n}] = {values};"
    )?;
    writeln!(
        out,
        "        for (int k = 0; k < {n}; k++) {place}[k] = values[k];\n    }}"
    )
}

pub(super) fn write_memory_access(out: &mut String, plan: &Plan<'_>, name: &str) -> fmt::Result {
    let upper = name.to_uppercase();
    let mut places = Vec::new();
    for (number, team) in plan.remembering() {
        for (section, slot, values) in plan.slots(team) {
            let reference = if section == Section::Scalar { "&" } else { "" };
            places.push((
                format!("{reference}self->team_{number}.{}m{slot}", letter(section)),
                values.len(),
            ));
        }
    }
    if plan.is_indexed() {
        places.push(("self->indexed.cells".to_owned(), plan.cells.len()));
    }
    writeln!(
        out,
        "\nvoid {name}_memory(const {name} *self, float memory[{upper}_MEMORY])\n{{"
    )?;
    let mut at = 0;
    for (place, n) in &places {
        writeln!(
            out,
            "    for (int k = 0; k < {n}; k++) memory[{at} + k] = ({place})[k];"
        )?;
        at += n;
    }
    writeln!(
        out,
        "}}\n\nvoid {name}_set_memory({name} *self, const float memory[{upper}_MEMORY])\n{{"
    )?;
    at = 0;
    for (place, n) in &places {
        writeln!(
            out,
            "    for (int k = 0; k < {n}; k++) ({place})[k] = or_zero(memory[{at} + k]);"
        )?;
        at += n;
    }
    writeln!(out, "}}")
}
