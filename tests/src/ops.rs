//! Runs the test vectors of `tests/golden/ops`: one policy of one program of one instruction for each.
//!
//! `tests/golden/ops/README.md` describes the lines.

mod parse;

use std::fmt::Write as _;

use tpg_runtime::blob::MemoryModel;
use tpg_runtime::isa::{Destination, Group, INDEXED_CELLS, Op, Operand};
use tpg_runtime::tables::{Section, Target};
use tpg_runtime::{Policy, Reset};

use self::parse::{Expected, numbers};
use crate::draft::{
    Draft, DraftProgram, DraftTeam, TestAgent, header, instruction, make_stateful, slot_offset,
};

pub use self::parse::{Vector, parse};

/// What running a vector took and found.
#[derive(Debug, Clone, Copy, Default)]
pub struct Outcome {
    /// Decisions that were compared.
    pub runs: usize,
    /// Largest error found, as a share of the allowed one.
    pub worst: f64,
}

/// Faults are told as text.
type Check<T> = Result<T, String>;

/// Registers in which a value can be placed, or the observation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    Register(usize),
    Observation,
    /// An element of a vector register, for an operand that is a scalar or such an element.
    VectorElement,
}

/// The registers of the program: the bid, sources and destinations, and all that a memory write needs.
const REGISTERS: [u8; 3] = [8, 3, 3];
const SOURCES: [usize; 2] = [1, 2];
const SCALAR_DESTINATION: usize = 3;
const WIDE_DESTINATION: usize = 0;
/// Fills registers, so that a missing or a stray write shows.
const JUNK: f32 = 12345.0;

impl Vector {
    /// Runs the vector in every placement of its operands.
    ///
    /// # Errors
    /// What differs from the vector's expectation.
    pub fn check(&self) -> Check<Outcome> {
        let outcome = match &self.expected {
            Expected::Slots(slots) => self.check_slots(slots),
            Expected::Cells(cells) => self.check_cells(cells),
            _ => self.check_value(),
        };
        outcome.map_err(|fault| format!("line {}, {}: {fault}", self.line, self.op.mnemonic()))
    }

    /// A policy of one program without code.
    fn draft(&self, observation_len: usize) -> Check<Draft> {
        let width = self.width()?;
        let mut header = header(width as u16, observation_len as u16);
        let model = match self.op.group() {
            Group::TeamMemory | Group::WholeReads => MemoryModel::Team,
            _ if matches!(self.op, Op::MemRead | Op::MemWrite) => MemoryModel::Indexed,
            _ => MemoryModel::None,
        };
        if model != MemoryModel::None {
            make_stateful(&mut header, model);
        }
        let [s, v, m] = REGISTERS.map(usize::from);
        Ok(Draft {
            header,
            teams: vec![DraftTeam {
                members: vec![0],
                ..DraftTeam::default()
            }],
            programs: vec![DraftProgram {
                registers: REGISTERS,
                constants: vec![JUNK; s + v * width + m * width * width],
                code: Vec::new(),
                target: Target::Atomic(1),
                output: None,
            }],
            cells: Vec::new(),
            image: Vec::new(),
            front_end: Vec::new(),
            ranges: Vec::new(),
        })
    }

    fn check_value(&self) -> Check<Outcome> {
        let mut outcome = Outcome::default();
        for (places, destination) in self.placements()? {
            let worst = self
                .run(places, destination)
                .map_err(|e| format!("operands in {places:?}, to {destination:?}: {e}"))?;
            outcome.worst = outcome.worst.max(worst);
            outcome.runs += 1;
        }
        Ok(outcome)
    }

    /// Where operands and destination may lie without a change of meaning.
    fn placements(&self) -> Check<Vec<([Place; 2], usize)>> {
        let registers = SOURCES.map(Place::Register);
        let own = match self.op.destination() {
            Destination::S | Destination::SUpdate => SCALAR_DESTINATION,
            _ => WIDE_DESTINATION,
        };
        let mut out = vec![(registers, own)];
        let kinds = self.op.operands();
        if kinds.iter().any(|kind| shape(*kind).is_some()) {
            out.push(([Place::Observation; 2], own));
        }
        if kinds[0] == Operand::SOrVElement {
            out.push(([Place::VectorElement, registers[1]], own));
        }
        let update = self.op.destination().is_update();
        let is_register = |k: &usize| !matches!(kinds[*k], Operand::VElement | Operand::MElement);
        for k in (0..2).filter(is_register) {
            let same_kind = shape(kinds[k]) == destination_shape(self.op.destination());
            let key = ["a", "b"][k];
            if same_kind && (!update || self.text("d")? == self.text(key)?) {
                out.push((registers, SOURCES[k]));
            }
        }
        if shape(kinds[0]).is_some()
            && shape(kinds[0]) == shape(kinds[1])
            && self.text("a")? == self.text("b")?
        {
            out.push(([registers[0]; 2], own));
        }
        Ok(out)
    }

    /// Runs one placement and returns the error as a share of the allowed one.
    fn run(&self, places: [Place; 2], destination: usize) -> Check<f64> {
        let width = self.width()?;
        let kinds = self.op.operands();
        // Junk around the observed operands, so that an offset that is off by one shows.
        let mut observation = vec![JUNK];
        let mut observed = [0u16; 2];
        for (k, kind) in kinds.into_iter().enumerate() {
            if places[k] == Place::Observation && shape(kind).is_some() {
                observed[k] = observation.len() as u16;
                observation.extend(self.values(["a", "b"][k])?);
                observation.push(JUNK);
            }
        }
        let mut draft = self.draft(observation.len())?;
        let start = usize::from(draft.scalar(0, 0));
        let offset = |draft: &Draft, shape: Shape, i: usize| match shape {
            Shape::Scalar => draft.scalar(0, i),
            Shape::Vector => draft.vector(0, i),
            Shape::Matrix => draft.matrix(0, i),
        };
        let to = destination_shape(self.op.destination())
            .map_or(0, |shape| offset(&draft, shape, destination));
        let set = |draft: &mut Draft, at: u16, values: &[f32]| {
            let at = usize::from(at) - start;
            draft.programs[0].constants[at..at + values.len()].copy_from_slice(values);
        };
        if self.fields.contains_key("d") {
            let old = self.values("d")?;
            set(&mut draft, to, &old);
        }
        let mut fields = [0u16; 2];
        for (k, kind) in kinds.into_iter().enumerate() {
            let index = self.number("index")? as u16;
            fields[k] = match (shape(kind), places[k]) {
                (Some(_), Place::Observation) => observed[k],
                (Some(_), Place::VectorElement) => draft.vector(0, 1) + (width - 1) as u16,
                (Some(shape), Place::Register(i)) => offset(&draft, shape, i),
                (None, _) => self.memory_operand(&mut draft, kind)?,
            };
            if shape(kind).is_some() {
                if places[k] != Place::Observation {
                    let values = self.values(["a", "b"][k])?;
                    set(&mut draft, fields[k], &values);
                }
                if matches!(kind, Operand::VElement | Operand::MElement) {
                    fields[k] += index;
                }
            }
        }
        if self.fields.contains_key("constant") {
            // The observation overwrites the register first, so that the constant must come back.
            let value = self.values("constant")?;
            set(&mut draft, to, &value);
            let spoil = match self.op {
                Op::ReloadM => Op::MHeaviside,
                Op::ReloadV => Op::VHeaviside,
                _ => Op::Heaviside,
            };
            draft.programs[0].code.push(instruction(spoil, to, 0, 0));
        }
        let [a, b] = fields;
        draft.programs[0].code.push(instruction(self.op, to, a, b));
        let bytes = draft.encode();
        let policy = Policy::load(&bytes).map_err(|e| e.to_string())?;
        let mut agent = TestAgent::new(policy).map_err(|e| e.to_string())?;
        agent.reset(Reset::Agent, 1);
        let before = agent.words().to_vec();
        let decision = agent.decide(&observation).map_err(|e| e.to_string())?;
        if decision.instructions as usize != draft.programs[0].code.len() {
            return Err(format!("{} instructions ran", decision.instructions));
        }
        let (to, window) = (usize::from(to), start);
        let got = &agent.words()[to..];
        let (worst, len) = match &self.expected {
            Expected::Near(value, allowed) => (near(got[0], *value, *allowed)?, 1),
            Expected::Words(words) => (exact(got, words)?, words.len()),
            _ => return Err("no value".to_owned()),
        };
        for (at, (old, new)) in before.iter().zip(agent.words()).enumerate() {
            let elsewhere = at >= window && !(to..to + len).contains(&at);
            if elsewhere && old.to_bits() != new.to_bits() {
                return Err(format!("word {at} changed from {old} to {new}"));
            }
        }
        Ok(worst)
    }

    /// The field of an operand that is no value, and the memory that it needs.
    fn memory_operand(&self, draft: &mut Draft, kind: Operand) -> Check<u16> {
        Ok(match kind {
            Operand::ScalarSlot | Operand::VectorSlot | Operand::MatrixSlot => {
                draft.teams[0].slots = self.kept_slots()?;
                draft.teams[0].constants = self.values("memory")?;
                self.number("slot")? as u16
            }
            Operand::VectorIndex | Operand::MatrixIndex => self.number("index")? as u16,
            Operand::Cell => {
                let kept = numbers(self.text("kept")?)?;
                let cell = self.number("cell")?;
                let at = kept.iter().position(|k| *k == cell);
                draft.cells = kept.iter().map(|k| *k as u16).collect();
                draft.image = self.values("memory")?;
                (draft.memory_start() + at.ok_or("cell is not kept")?) as u16
            }
            _ => 0,
        })
    }

    /// Writes once in every decision and looks where the value went.
    fn check_slots(&self, slots: &[usize]) -> Check<Outcome> {
        let width = self.width()?;
        let section = match self.op {
            Op::WriteS => Section::Scalar,
            Op::WriteV => Section::Vector,
            _ => Section::Matrix,
        };
        let observation: Vec<f32> = (1..=width * width).map(|k| k as f32).collect();
        let mut draft = self.draft(observation.len())?;
        let kept = self.kept_slots()?;
        draft.teams[0].slots = kept;
        draft.teams[0].stream_key =
            u32::try_from(self.hex("key")?).map_err(|e| format!("key: {e}"))?;
        let team_words = |s: Section| kept[s as usize].count_ones() as usize * s.slot_words(width);
        let memory_words: usize = Section::ALL.into_iter().map(team_words).sum();
        draft.teams[0].constants = vec![0.0; memory_words];
        draft.programs[0].code.push(instruction(self.op, 0, 0, 0));
        let bytes = draft.encode();
        let policy = Policy::load(&bytes).map_err(|e| e.to_string())?;
        let mut agent = TestAgent::new(policy).map_err(|e| e.to_string())?;
        agent.reset(Reset::Agent, self.hex("seed")?);
        let empty = vec![0.0; memory_words];
        for (draw, slot) in slots.iter().enumerate() {
            agent.set_memory(&empty).map_err(|e| e.to_string())?;
            agent.decide(&observation).map_err(|e| e.to_string())?;
            let mut expected = empty.clone();
            if let Some(start) = slot_offset(kept, section, *slot, width) {
                let len = section.slot_words(width);
                expected[start..start + len].copy_from_slice(&observation[..len]);
            }
            exact(agent.memory(), &expected).map_err(|e| format!("draw {draw}: {e}"))?;
        }
        Ok(Outcome {
            runs: slots.len(),
            worst: 0.0,
        })
    }

    /// Writes once in every decision and looks which cells it reached, with all kept and with few.
    fn check_cells(&self, writes: &[Vec<usize>]) -> Check<Outcome> {
        let mut outcome = Outcome::default();
        for step in [1, 7] {
            let cells: Vec<usize> = (0..INDEXED_CELLS).step_by(step).collect();
            let mut draft = self.draft(1)?;
            draft.cells = cells.iter().map(|c| *c as u16).collect();
            for (i, constant) in draft.programs[0].constants.iter_mut().take(8).enumerate() {
                *constant = (i + 1) as f32;
            }
            let code = instruction(Op::MemWrite, 0, 0, 0);
            draft.programs[0].code.push(code);
            let bytes = draft.encode();
            let policy = Policy::load(&bytes).map_err(|e| e.to_string())?;
            let mut agent = TestAgent::new(policy).map_err(|e| e.to_string())?;
            agent.reset(Reset::Agent, self.hex("seed")?);
            let empty = vec![0.0; cells.len()];
            for (write, reached) in writes.iter().enumerate() {
                agent.set_memory(&empty).map_err(|e| e.to_string())?;
                agent.decide(&[0.0]).map_err(|e| e.to_string())?;
                let value = |cell: &usize| match reached.contains(cell) {
                    true => (cell % 8 + 1) as f32,
                    false => 0.0,
                };
                let expected: Vec<f32> = cells.iter().map(value).collect();
                exact(agent.memory(), &expected).map_err(|e| format!("write {write}: {e}"))?;
                outcome.runs += 1;
            }
        }
        Ok(outcome)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Shape {
    Scalar,
    Vector,
    Matrix,
}

/// Which registers hold such an operand; `None` where it is no value.
const fn shape(kind: Operand) -> Option<Shape> {
    match kind {
        Operand::S | Operand::SOrVElement => Some(Shape::Scalar),
        Operand::V | Operand::VElement => Some(Shape::Vector),
        Operand::M | Operand::MElement => Some(Shape::Matrix),
        _ => None,
    }
}

const fn destination_shape(kind: Destination) -> Option<Shape> {
    match kind {
        Destination::None => None,
        Destination::S | Destination::SUpdate => Some(Shape::Scalar),
        Destination::V | Destination::VUpdate => Some(Shape::Vector),
        Destination::M | Destination::MUpdate => Some(Shape::Matrix),
    }
}

fn exact(got: &[f32], expected: &[f32]) -> Check<f64> {
    let mut faults = String::new();
    for (k, x) in expected.iter().enumerate() {
        let word = got.get(k).copied().unwrap_or(f32::NAN);
        if word.to_bits() != x.to_bits() && faults.len() < 400 {
            let _ = write!(faults, "word {k} is {:08x} ({word:e}), ", word.to_bits());
            let _ = write!(faults, "expected {:08x} ({x:e}); ", x.to_bits());
        }
    }
    if faults.is_empty() {
        Ok(0.0)
    } else {
        Err(faults)
    }
}

fn near(got: f32, value: f64, allowed: f64) -> Check<f64> {
    let error = (f64::from(got) - value).abs();
    if error <= allowed {
        Ok(error / allowed)
    } else {
        Err(format!(
            "{got:e} is {error:e} from {value:e}, allowed {allowed:e}"
        ))
    }
}
