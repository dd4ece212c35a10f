//! Writes the state that lasts between decisions, in Rust: registers, shared memory and random streams.

use std::fmt::{self, Write as _};

use tpg_runtime::tables::{Section, Team};

use super::super::plan::Plan;
use super::super::reset::{Part, When};
use super::super::text::letter;
use super::super::values::{Shared, sections};
use super::decide::write_decide;
use super::program::{literal, number};

fn kind(section: Section) -> &'static str {
    match section {
        Section::Scalar => "f32",
        Section::Vector => "Vector",
        Section::Matrix => "Matrix",
    }
}

/// Writes the types of the state that lasts between decisions.
pub(super) fn write_state(out: &mut String, plan: &Plan<'_>) -> fmt::Result {
    for program in plan.stateful_programs() {
        writeln!(
            out,
            "\n#[derive(Debug, Clone, Copy)]\nstruct Registers{program} {{"
        )?;
        let registers = plan.registers(program);
        for register in &registers {
            let (section, number) = (register.section, register.number);
            writeln!(out, "    {}{number}: {},", letter(section), kind(section))?;
        }
        writeln!(
            out,
            "}}\n\nimpl Registers{program} {{\n    const INITIAL: Self = Registers{program} {{"
        )?;
        for register in &registers {
            writeln!(
                out,
                "        {}{}: {},",
                letter(register.section),
                register.number,
                literal(plan, register.section, &register.values)
            )?;
        }
        writeln!(out, "    }};\n}}")?;
    }
    for (number, team) in plan.remembering() {
        write_team_memory(out, plan, number, team)?;
    }
    if plan.is_indexed() {
        let cells: Vec<String> = plan.cells.iter().map(u16::to_string).collect();
        writeln!(
            out,
            "\nconst CELLS: [u16; {}] = [{}];",
            cells.len(),
            cells.join(", ")
        )?;
        out.push_str(INDEXED);
        let values: Vec<String> = plan.cell_values().into_iter().map(number).collect();
        writeln!(
            out,
            "\nconst CELL_VALUES: [f32; {}] = [{}];",
            cells.len(),
            values.join(", ")
        )?;
    }
    Ok(())
}

const INDEXED: &str = "
#[derive(Debug, Clone)]
struct Indexed {
    stream: IndexedStream,
    cells: [f32; CELLS.len()],
}

impl Indexed {
    fn write(&mut self, registers: [f32; 8]) {
        let write = self.stream.begin_write();
        for (cell, place) in CELLS.iter().zip(&mut self.cells) {
            if let (true, Some(x)) = (write.reaches(*cell, WRITES), registers.get(usize::from(*cell) % 8)) {
                *place = *x;
            }
        }
    }
}
";

fn write_team_memory(out: &mut String, plan: &Plan<'_>, number: u16, team: &Team) -> fmt::Result {
    let slots = plan.slots(team);
    writeln!(out, "\n#[derive(Debug, Clone)]\nstruct Memory{number} {{")?;
    for slot in &slots {
        let (section, number) = (slot.section, slot.number);
        writeln!(out, "    {}m{number}: {},", letter(section), kind(section))?;
    }
    for section in sections(team) {
        writeln!(out, "    {}_stream: Pcg32,", letter(section))?;
    }
    writeln!(
        out,
        "}}\n\nimpl Memory{number} {{\n    fn new() -> Self {{\n        Memory{number} {{"
    )?;
    for slot in &slots {
        writeln!(
            out,
            "            {}m{}: {},",
            letter(slot.section),
            slot.number,
            literal(plan, slot.section, &slot.values)
        )?;
    }
    for section in sections(team) {
        writeln!(
            out,
            "            {}_stream: {},",
            letter(section),
            stream(team, section, "0")
        )?;
    }
    writeln!(
        out,
        "        }}\n    }}\n\n    fn restore(&mut self) {{\n        let fresh = Self::new();"
    )?;
    for slot in &slots {
        let (letter, number) = (letter(slot.section), slot.number);
        writeln!(
            out,
            "        self.{letter}m{number} = fresh.{letter}m{number};"
        )?;
    }
    writeln!(out, "    }}\n\n    fn seed(&mut self, seed: u64) {{")?;
    for section in sections(team) {
        writeln!(
            out,
            "        self.{}_stream = {};",
            letter(section),
            stream(team, section, "seed")
        )?;
    }
    writeln!(out, "    }}")?;
    for section in sections(team) {
        let (letter, reference) = (
            letter(section),
            if section == Section::Scalar { "" } else { "&" },
        );
        let value = if reference.is_empty() { "x" } else { "*x" };
        writeln!(
            out,
            "\n    fn write_{letter}(&mut self, x: {reference}{}) {{",
            kind(section)
        )?;
        writeln!(
            out,
            "        match draw_slot(&mut self.{letter}_stream, WRITES) {{"
        )?;
        for slot in slots.iter().filter(|slot| slot.section == section) {
            let number = slot.number;
            writeln!(
                out,
                "            {number} => self.{letter}m{number} = {value},"
            )?;
        }
        writeln!(out, "            _ => {{}}\n        }}\n    }}")?;
    }
    writeln!(out, "}}")
}

fn stream(team: &Team, section: Section, seed: &str) -> String {
    format!(
        "slot_stream({seed}, {}, Section::{section:?})",
        team.stream_key
    )
}

pub(super) fn write_policy(out: &mut String, plan: &Plan<'_>) -> fmt::Result {
    let programs = plan.stateful_programs();
    let teams: Vec<u16> = plan.remembering().map(|(number, _)| number).collect();
    writeln!(
        out,
        "\n/// The policy with its state: registers, shared memory, random streams."
    )?;
    writeln!(out, "#[derive(Debug, Clone)]\npub struct Policy {{")?;
    for program in &programs {
        writeln!(out, "    program_{program}: Registers{program},")?;
    }
    for team in &teams {
        writeln!(out, "    team_{team}: Memory{team},")?;
    }
    if plan.is_indexed() {
        writeln!(out, "    indexed: Indexed,")?;
    }
    if plan.policy.front_end().is_some() {
        writeln!(out, "    perception: Perception,")?;
    }
    if plan.earlier() > 0 {
        writeln!(out, "    earlier: [f32; {}],", plan.earlier())?;
    }
    writeln!(
        out,
        "}}\n\nimpl Policy {{\n    /// As loaded: everything reset, with seed 0."
    )?;
    writeln!(
        out,
        "    #[must_use]\n    pub fn new() -> Self {{\n        Policy {{"
    )?;
    for program in &programs {
        writeln!(
            out,
            "            program_{program}: Registers{program}::INITIAL,"
        )?;
    }
    for team in &teams {
        writeln!(out, "            team_{team}: Memory{team}::new(),")?;
    }
    if plan.is_indexed() {
        writeln!(
            out,
            "            indexed: Indexed {{ stream: IndexedStream::new(0), cells: CELL_VALUES }},"
        )?;
    }
    if plan.policy.front_end().is_some() {
        writeln!(out, "            perception: Perception::START,")?;
    }
    if plan.earlier() > 0 {
        writeln!(out, "            earlier: [0.0; {}],", plan.earlier())?;
    }
    writeln!(out, "        }}\n    }}")?;
    write_reset(out, plan)?;
    write_decide(out, plan)?;
    if plan.memory_words() > 0 {
        write_memory_access(out, plan)?;
    }
    writeln!(out, "}}")
}

fn write_reset(out: &mut String, plan: &Plan<'_>) -> fmt::Result {
    let scope = plan.policy.header().reset_scope;
    writeln!(
        out,
        "\n    /// Begins an agent's evaluation or one of its episodes; the reset scope is {}.",
        scope.name()
    )?;
    writeln!(
        out,
        "    ///\n    /// `agent_seed` determines the random streams."
    )?;
    writeln!(
        out,
        "    pub fn reset(&mut self, what: Reset, agent_seed: u64) {{"
    )?;
    if plan.policy.front_end().is_some() {
        writeln!(out, "        self.perception = Perception::START;")?;
    }
    if plan.earlier() > 0 {
        writeln!(out, "        self.earlier = [0.0; {}];", plan.earlier())?;
    }
    for reset in plan.resets() {
        let condition = match reset.when {
            _ if reset.parts.is_empty() => continue,
            When::Always => "",
            When::Agent => "if what == Reset::Agent ",
            When::Episode => "if what == Reset::Episode ",
            When::Never => continue,
        };
        let lines: Vec<String> = reset.parts.into_iter().map(renew).collect();
        let lines = lines.join("\n            ");
        writeln!(
            out,
            "        {condition}{{\n            {lines}\n        }}"
        )?;
    }
    writeln!(out, "    }}")
}

/// The statements that reset a part of the state.
fn renew(part: Part) -> String {
    match part {
        Part::Registers(program) => {
            format!("self.program_{program} = Registers{program}::INITIAL;")
        }
        Part::Slots(team) => format!("self.team_{team}.restore();"),
        Part::Streams(team) => format!("self.team_{team}.seed(agent_seed);"),
        Part::Cells => "self.indexed.cells = CELL_VALUES;".to_owned(),
        Part::CellStream => "self.indexed.stream = IndexedStream::new(agent_seed);".to_owned(),
    }
}

/// Writes functions that copy the shared memory in state order. Comparisons need them. So do reset scopes in which the
/// memory lasts longer than the agent.
fn write_memory_access(out: &mut String, plan: &Plan<'_>) -> fmt::Result {
    let expressions = |(shared, _): (Shared, usize)| match shared {
        Shared::Cells => (
            "self.indexed.cells".to_owned(),
            "self.indexed.cells".to_owned(),
        ),
        Shared::Slot {
            team,
            section,
            number,
        } => {
            let slot = format!("self.team_{team}.{}m{number}", letter(section));
            match section {
                Section::Scalar => (
                    format!("[{slot}]"),
                    format!("core::slice::from_mut(&mut {slot})"),
                ),
                Section::Vector => (slot.clone(), slot),
                Section::Matrix => (
                    format!("{slot}.as_flattened()"),
                    format!("{slot}.as_flattened_mut()"),
                ),
            }
        }
    };
    let pieces: Vec<(String, String)> = plan.shared().into_iter().map(expressions).collect();
    writeln!(
        out,
        "\n    /// Memory that programs share: the teams' slots, then the kept cells."
    )?;
    writeln!(
        out,
        "    #[must_use]\n    pub fn memory(&self) -> [f32; MEMORY] {{"
    )?;
    writeln!(
        out,
        "        let mut memory = [0.0; MEMORY];\n        let mut places = memory.iter_mut();"
    )?;
    for (value, _) in &pieces {
        writeln!(
            out,
            "        for (x, place) in {value}.iter().zip(&mut places) {{ *place = *x; }}"
        )?;
    }
    writeln!(
        out,
        "        memory\n    }}\n\n    /// Overwrites the shared memory, for scopes in which it outlives the agent."
    )?;
    writeln!(
        out,
        "    pub fn set_memory(&mut self, memory: &[f32; MEMORY]) {{\n        let mut values = memory.iter();"
    )?;
    for (_, place) in &pieces {
        writeln!(
            out,
            "        for (place, x) in {place}.iter_mut().zip(&mut values) {{ *place = math::finite(*x); }}"
        )?;
    }
    writeln!(out, "    }}")
}
