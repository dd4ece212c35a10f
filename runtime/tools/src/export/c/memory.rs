//! Shared memory, random streams and resets in C.

use std::fmt::{self, Write as _};

use tpg_runtime::memory::write_threshold;
use tpg_runtime::tables::Section;

use super::super::plan::Plan;
use super::super::reset::{Part, When};
use super::super::text::letter;
use super::super::values::{Register, Shared, Slot, sections};
use super::library::Snippet;
use super::perception::write_reset;
use super::program::{C, list, number_text};

/// The functions that write shared memory and make its streams.
pub(super) fn memory_functions(c: &C<'_, '_>) -> Vec<Snippet> {
    let (plan, name) = (c.plan, c.prefix);
    let distribution = plan.policy.header().write_distribution;
    let thresholds = distribution.slot_thresholds().iter();
    let thresholds: Vec<String> = thresholds.map(|t| format!("{t}u")).collect();
    let slots = include_str!("assets/slots.c")
        .replace("TPG_STREAM", &format!("{name}_stream"))
        .replace("TPG_SLOT_THRESHOLDS", &thresholds.join(", "));
    let mut functions: Vec<Snippet> = Snippet::split(include_str!("assets/random.c")).collect();
    functions.extend(Snippet::split(&slots));
    for (number, team) in plan.remembering() {
        for section in sections(team) {
            functions.push(write_slot(plan, name, number, section));
        }
    }
    if plan.is_indexed() {
        functions.push(write_cells(plan, name));
    }
    functions
}

/// The function that writes to a random slot of a section.
fn write_slot(plan: &Plan<'_>, name: &str, number: u16, section: Section) -> Snippet {
    let letter = letter(section);
    let value = match section {
        Section::Scalar => "float x",
        _ => "const float *x",
    };
    let mut text = format!(
        "static inline void write_{letter}_in_team_{number}({name}_memory_{number} *memory, {value})\n{{\n    \
         switch (draw_slot(&memory->{letter}_stream)) {{\n"
    );
    let slots = plan.slots(&plan.teams[usize::from(number)].record);
    for slot in slots.iter().filter(|slot| slot.section == section) {
        let k = slot.number;
        let store = match section {
            Section::Scalar => format!("memory->sm{k} = x"),
            _ => format!("copy(memory->{letter}m{k}, x, {})", slot.values.len()),
        };
        text.push_str(&format!("    case {k}: {store}; break;\n"));
    }
    Snippet::new(text + "    default: break;\n    }\n}\n")
}

fn write_cells(plan: &Plan<'_>, name: &str) -> Snippet {
    let distribution = plan.policy.header().write_distribution;
    let join = |values: Vec<String>| values.join(", ");
    let cells = join(plan.cells.iter().map(u16::to_string).collect());
    let chance = |cell: &u16| format!("{}u", write_threshold(*cell, distribution));
    let chances = join(plan.cells.iter().map(chance).collect());
    let n = plan.cells.len();
    Snippet::new(format!(
        "/* Writes to kept cells (row * 8 + column), each with a chance of so many in 2^32. */\n\
         static inline void write_cells({name}_indexed *indexed, const float registers[8])\n{{\n    \
         static const uint16_t cells[{n}] = {{ {cells} }};\n    \
         static const uint32_t chances[{n}] = {{ {chances} }};\n    \
         const uint64_t write = indexed->writes++;\n    for (int k = 0; k < {n}; k++) {{\n        \
         const uint64_t words[3] = {{ indexed->stream, write, cells[k] }};\n        \
         if ((uint32_t)(mix64(words, 3) >> 32) < chances[k]) indexed->cells[k] = registers[cells[k] % 8];\n    }}\n}}\n"
    ))
}

/// The functions that reset the registers and the memory.
pub(super) fn reset_functions(c: &C<'_, '_>) -> Vec<Snippet> {
    let (plan, name) = (c.plan, c.prefix);
    let [memory, registers] = plan.resets();
    let functions = [
        (
            memory,
            format!("static void reset_memory({name} *self)\n{{\n"),
        ),
        (
            registers,
            format!(
                "static void reset_registers({name} *self, uint64_t agent_seed)\n{{\n    (void)agent_seed;\n"
            ),
        ),
    ];
    functions
        .into_iter()
        .map(|(reset, head)| {
            let renewed: String = reset.parts.into_iter().map(|part| renew(c, part)).collect();
            Snippet::new(format!("{head}    (void)self;\n{renewed}}}\n"))
        })
        .collect()
}

/// The statements that reset a part of the state.
fn renew(c: &C<'_, '_>, part: Part) -> String {
    let (plan, name) = (c.plan, c.prefix);
    match part {
        Part::Registers(program) => {
            let Some(registers) = c.kept().get(&program) else {
                return String::new();
            };
            let value = |register: &Register| match register.section {
                Section::Scalar => number_text(register.values[0]),
                _ => list(&register.values),
            };
            let values: Vec<String> = registers.iter().map(value).collect();
            format!(
                "    static const {name}_registers_{program} initial_{program} = {{ {} }};\n    \
                 self->program_{program} = initial_{program};\n",
                values.join(", ")
            )
        }
        Part::Slots(team) => {
            let slots = plan.slots(&plan.teams[usize::from(team)].record);
            let assign = |slot: &Slot| {
                let place = format!("self->team_{team}.{}m{}", letter(slot.section), slot.number);
                assign(&place, slot.section == Section::Scalar, &slot.values)
            };
            slots.iter().map(assign).collect()
        }
        Part::Streams(team) => {
            let record = &plan.teams[usize::from(team)].record;
            let stream = |section: Section| {
                let (letter, key, section) = (letter(section), record.stream_key, section as u8);
                format!(
                    "    self->team_{team}.{letter}_stream = slot_stream(agent_seed, {key}u, {section});\n"
                )
            };
            sections(record).map(stream).collect()
        }
        Part::Cells => assign("self->indexed.cells", false, &plan.cell_values()),
        Part::CellStream => format!(
            "    const uint64_t words[3] = {{ agent_seed, 0, {} }};\n    \
             self->indexed.stream = mix64(words, 3);\n    self->indexed.writes = 0;\n",
            Section::ALL.len()
        ),
    }
}

/// The statement that gives a variable its values.
fn assign(variable: &str, scalar: bool, values: &[f32]) -> String {
    if scalar {
        return format!("    {variable} = {};\n", number_text(values[0]));
    }
    let n = values.len();
    if values.iter().all(|x| x.to_bits() == 0) {
        return format!("    for (int k = 0; k < {n}; k++) {variable}[k] = 0.0f;\n");
    }
    format!(
        "    {{\n        static const float values[{n}] = {};\n        \
         for (int k = 0; k < {n}; k++) {variable}[k] = values[k];\n    }}\n",
        list(values)
    )
}

/// Writes the functions that callers use to reset a policy.
pub(super) fn write_resets(out: &mut String, c: &C<'_, '_>) -> fmt::Result {
    let (plan, name) = (c.plan, c.prefix);
    let upper = name.to_uppercase();
    writeln!(
        out,
        "\nvoid {name}_init({name} *self)\n{{\n    self->instructions = 0;\n    self->winner = 0;\n    self->teams = 0;"
    )?;
    write_reset(out, plan)?;
    let resets = plan.resets();
    let calls = |seed: &str| {
        [
            "reset_memory(self)".to_owned(),
            format!("reset_registers(self, {seed})"),
        ]
    };
    for (call, reset) in calls("0").iter().zip(&resets) {
        if !reset.parts.is_empty() {
            writeln!(out, "    {call};")?;
        }
    }
    writeln!(
        out,
        "}}\n\nvoid {name}_reset({name} *self, {name}_reset_kind what, uint64_t agent_seed)\n{{"
    )?;
    write_reset(out, plan)?;
    for (call, reset) in calls("agent_seed").iter().zip(&resets) {
        let condition = match reset.when {
            _ if reset.parts.is_empty() => continue,
            When::Always => String::new(),
            When::Agent => format!("if (what == {upper}_AGENT) "),
            When::Episode => format!("if (what == {upper}_EPISODE) "),
            When::Never => continue,
        };
        writeln!(out, "    {condition}{call};")?;
    }
    writeln!(
        out,
        "    (void)self;\n    (void)what;\n    (void)agent_seed;\n}}"
    )
}

/// Writes the functions that read and overwrite the shared memory.
pub(super) fn write_memory_access(out: &mut String, c: &C<'_, '_>) -> fmt::Result {
    let (plan, name) = (c.plan, c.prefix);
    let upper = name.to_uppercase();
    let pieces = plan.shared().into_iter().map(|(shared, words)| {
        let piece = match shared {
            Shared::Cells => "self->indexed.cells".to_owned(),
            Shared::Slot {
                team,
                section,
                number,
            } => {
                let piece = format!("self->team_{team}.{}m{number}", letter(section));
                if section == Section::Scalar {
                    return (piece, None);
                }
                piece
            }
        };
        (piece, Some(words))
    });
    let (mut get, mut set, mut at) = (String::new(), String::new(), 0);
    for (piece, words) in pieces {
        let Some(n) = words else {
            // One float, not an array of one.
            writeln!(get, "    memory[{at}] = {piece};")?;
            writeln!(set, "    {piece} = or_zero(memory[{at}]);")?;
            at += 1;
            continue;
        };
        writeln!(
            get,
            "    for (int k = 0; k < {n}; k++) memory[{at} + k] = {piece}[k];"
        )?;
        writeln!(
            set,
            "    for (int k = 0; k < {n}; k++) {piece}[k] = or_zero(memory[{at} + k]);"
        )?;
        at += n;
    }
    write!(
        out,
        "\nvoid {name}_memory(const {name} *self, float memory[{upper}_MEMORY])\n{{\n{get}}}\n\n\
         void {name}_set_memory({name} *self, const float memory[{upper}_MEMORY])\n{{\n{set}}}\n"
    )
}
