//! What evolution edits: teams and programs as plain values. Nothing here can be executed. [`crate::lower`] turns it into the
//! runtime's tables.

use serde::{Deserialize, Serialize};
use tpg_runtime::MAX_OUTPUTS;
use tpg_runtime::blob::{ActionKind, RegisterMode, ResetScope};
use tpg_runtime::isa::{Group, INDEXED_CELLS, Op, Operand, REGISTERS, SLOTS};
use tpg_runtime::tables::Section;

use super::{Constants, Registers};
use crate::keys::named;
use tpg_tasks::task::{ActionSpace, Rng};

/// Vector registers that outputs may fill. Register 0 is left to the programs.
const MOST_OUTPUT_VECTORS: u16 = REGISTERS as u16 - 1;

/// Names a team for the length of a run. A larger number is younger.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct TeamId(pub u64);

/// Names a program for the length of a run. A larger number is younger.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct ProgramId(pub u64);

/// Which programs give the values of a continuous action.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ActionPrograms {
    /// The winning program gives all of them.
    #[default]
    Winner,
    /// Each output has programs of its own. The highest bidder among them gives the value. A policy has one team.
    Each,
}

impl ActionPrograms {
    /// Every value.
    pub const ALL: &'static [Self] = &[Self::Winner, Self::Each];

    /// The name used in configurations.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Winner => "winner",
            Self::Each => "each",
        }
    }

    /// Whether a task with these actions can be controlled so.
    #[must_use]
    pub const fn fits(self, actions: ActionSpace) -> bool {
        match self {
            Self::Winner => true,
            Self::Each => matches!(actions, ActionSpace::Continuous { len: 2.., .. }),
        }
    }
}

named!(ActionPrograms);

/// The sizes that every genome of a run shares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    /// Vector width W.
    pub width: u16,
    /// Length of the observation that a policy sees.
    pub inputs: u16,
    /// How many of the last observations programs read, at least 1; see [`Shape::observed`].
    pub history: u16,
    /// The task's actions.
    pub actions: ActionSpace,
    /// Which programs give the values of a continuous action.
    pub action_programs: ActionPrograms,
}

impl Shape {
    /// Elements of the observations that programs read, the newest first: element i · inputs + k is element k of the observation i
    /// decisions ago.
    #[must_use]
    pub const fn observed(&self) -> u16 {
        self.inputs.saturating_mul(self.history)
    }

    /// The registers that matter after a run of a program that leads to the plant: those of bid and output.
    #[must_use]
    pub fn results(&self) -> Registers {
        let mut results = Registers::default();
        results.insert(Section::Scalar, 0);
        if let Some(section) = self.output_section() {
            for register in self.output_registers() {
                results.insert(section, register);
            }
        }
        results
    }

    /// The registers of what a program gives to the plant, from 1 on: as many vectors as the outputs fill, or one scalar. Programs
    /// of discrete tasks have register 1 for themselves.
    #[must_use]
    pub fn output_registers(&self) -> std::ops::RangeInclusive<u8> {
        let vectors = match (self.actions, self.action_programs) {
            (ActionSpace::Continuous { len, .. }, ActionPrograms::Winner) => {
                len.div_ceil(self.width)
            }
            _ => 1,
        };
        1..=vectors.clamp(1, MOST_OUTPUT_VECTORS) as u8
    }

    /// The most outputs that a policy of this width can have.
    #[must_use]
    pub fn most_outputs(width: u16, action_programs: ActionPrograms) -> u16 {
        match action_programs {
            ActionPrograms::Winner => MAX_OUTPUTS.min(MOST_OUTPUT_VECTORS * width),
            ActionPrograms::Each => MAX_OUTPUTS,
        }
    }

    /// Number of atomic actions that programs can have. Discrete tasks: one for each action. Continuous tasks: 1, or one for each
    /// output where outputs have programs of their own.
    #[must_use]
    pub fn atomic_actions(&self) -> u16 {
        match (self.actions, self.action_programs) {
            (ActionSpace::Discrete(actions), _) => actions,
            (ActionSpace::Continuous { .. }, ActionPrograms::Winner) => 1,
            (ActionSpace::Continuous { len, .. }, ActionPrograms::Each) => len,
        }
    }

    /// How many outputs have programs of their own; 0 where the winner gives the whole action.
    #[must_use]
    pub fn separate_outputs(&self) -> u16 {
        match (self.actions, self.action_programs) {
            (ActionSpace::Continuous { len, .. }, ActionPrograms::Each) => len,
            _ => 0,
        }
    }

    /// What a decision yields.
    #[must_use]
    pub fn action_kind(&self) -> ActionKind {
        match (self.actions, self.action_programs) {
            (ActionSpace::Discrete(_), _) => ActionKind::Discrete,
            (ActionSpace::Continuous { .. }, ActionPrograms::Winner) => ActionKind::Continuous,
            (ActionSpace::Continuous { .. }, ActionPrograms::Each) => ActionKind::Each,
        }
    }

    /// The kind of register that holds what a program gives to the plant; `None` for discrete actions.
    #[must_use]
    pub fn output_section(&self) -> Option<Section> {
        match (self.actions, self.action_programs) {
            (ActionSpace::Discrete(_), _) => None,
            (ActionSpace::Continuous { len, .. }, ActionPrograms::Winner) if len > 1 => {
                Some(Section::Vector)
            }
            (ActionSpace::Continuous { .. }, _) => Some(Section::Scalar),
        }
    }

    /// Elements of a matrix.
    #[must_use]
    pub fn square(&self) -> u16 {
        self.width * self.width
    }
}

/// What kinds of genes a run's programs have.
#[derive(Debug, Clone, PartialEq)]
pub struct Genes {
    /// Shared sizes.
    pub shape: Shape,
    /// Operations that programs may use.
    pub ops: Vec<Op>,
    /// Whether programs and teams carry evolved constants (all variants but SL-NC).
    pub constants: bool,
    /// Whether registers outlive a decision.
    pub register_mode: RegisterMode,
    /// Whether teams have shared memory.
    pub team_memory: bool,
    /// Whether agents evolve when they are reset.
    pub reset_rules: bool,
    /// Probability that a random instruction is a move or a latch, where there are any. With 0 they are drawn like all others.
    pub copies: f64,
}

impl Genes {
    /// The operations of some groups, in the order of the instruction table.
    #[must_use]
    pub fn ops_of(groups: &[Group]) -> Vec<Op> {
        let mut ops = Op::ALL.to_vec();
        ops.retain(|op| {
            // What copies vectors or matrices is of no use where nothing computes on them.
            let computed = match op.destination().section() {
                Some(Section::Vector) => groups.contains(&Group::Vector),
                Some(Section::Matrix) => groups.contains(&Group::Matrix),
                _ => true,
            };
            groups.contains(&op.group()) && (op.group() != Group::Copies || computed)
        });
        ops
    }
}

/// Where an instruction reads: a register, or the observation in its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Source {
    /// Reads the observation instead of a register.
    pub observed: bool,
    /// Reads an element of a vector where a scalar would do as well (the conditional).
    pub of_vector: bool,
    /// Register, or slot of team memory.
    pub register: u8,
    /// Element of the observation, vector or matrix; cell of indexed memory.
    pub element: u16,
}

impl Source {
    /// A register.
    #[must_use]
    pub const fn register(register: u8) -> Self {
        Source {
            observed: false,
            of_vector: false,
            register,
            element: 0,
        }
    }

    /// The observation. Scalar operands read this element of it. Vector and matrix operands begin at this element, counted
    /// from the program's offset. Operands that are an element of a vector or matrix read this element, counted likewise.
    #[must_use]
    pub const fn observation(element: u16) -> Self {
        Source {
            observed: true,
            of_vector: false,
            register: 0,
            element,
        }
    }

    /// An element of a vector or matrix register, or of what a slot holds.
    #[must_use]
    pub const fn element(register: u8, element: u16) -> Self {
        Source {
            observed: false,
            of_vector: false,
            register,
            element,
        }
    }

    /// A random source of this kind. Every index is in range, and fields that the kind does not use are zero.
    #[must_use]
    pub fn random(kind: Operand, shape: &Shape, rng: &mut Rng) -> Self {
        let mut source = Source::default();
        match kind {
            Operand::None => return source,
            Operand::ScalarSlot | Operand::VectorSlot | Operand::MatrixSlot => {
                source.register = rng.below(SLOTS as u64) as u8;
                return source;
            }
            Operand::VectorIndex => {
                source.element = rng.below(u64::from(shape.width)) as u16;
                return source;
            }
            Operand::MatrixIndex => {
                source.element = rng.below(u64::from(shape.square())) as u16;
                return source;
            }
            Operand::Cell => {
                source.element = rng.below(INDEXED_CELLS as u64) as u16;
                return source;
            }
            _ => {}
        }
        source.of_vector = kind == Operand::SOrVElement && rng.chance(0.5);
        source.observed = rng.chance(0.5);
        if !source.observed {
            source.register = rng.below(REGISTERS as u64) as u8;
        }
        let scalar = kind == Operand::S || (kind == Operand::SOrVElement && !source.of_vector);
        let elements = match kind {
            _ if scalar && source.observed => shape.observed(),
            Operand::VElement => shape.width,
            Operand::SOrVElement if source.of_vector => shape.width,
            Operand::MElement => shape.square(),
            _ => 1,
        };
        source.element = rng.below(u64::from(elements)) as u16;
        source
    }
}

/// One instruction as evolution sees it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Instruction {
    /// What to do.
    #[serde(with = "op_code")]
    pub op: Op,
    /// Destination register.
    pub destination: u8,
    /// First operand.
    pub a: Source,
    /// Second operand.
    pub b: Source,
}

impl Instruction {
    /// A random instruction: draws an operation of the run's set, then its registers and operands.
    #[must_use]
    pub fn random(genes: &Genes, rng: &mut Rng) -> Self {
        // With a rate of zero nothing is drawn, so that runs without it keep their random streams.
        let copies = genes.ops.iter().filter(|op| op.group() == Group::Copies);
        let op = if genes.copies > 0.0 && copies.clone().count() > 0 && rng.chance(genes.copies) {
            let at = rng.below(copies.clone().count() as u64) as usize;
            *copies.clone().nth(at).unwrap_or(&Op::Move)
        } else {
            genes.ops[rng.below(genes.ops.len() as u64) as usize]
        };
        let [a, b] = op.operands();
        Instruction {
            op,
            destination: rng.below(REGISTERS as u64) as u8,
            a: Source::random(a, &genes.shape, rng),
            b: Source::random(b, &genes.shape, rng),
        }
    }
}

/// Operations are stored by their code, which the instruction table keeps unique.
mod op_code {
    use serde::{Deserialize, Deserializer, Serializer, de};
    use tpg_runtime::isa::Op;

    pub fn serialize<S: Serializer>(op: &Op, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_u8(*op as u8)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Op, D::Error> {
        let code = u8::deserialize(deserializer)?;
        Op::from_code(code).ok_or_else(|| {
            de::Error::invalid_value(
                de::Unexpected::Unsigned(code.into()),
                &"an operation's code",
            )
        })
    }
}

/// Where a winning program leads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Action {
    /// To the plant. The number is an action's index in discrete tasks, 0 in continuous ones, and an output's index where outputs
    /// have programs of their own.
    Atomic(u16),
    /// To another team.
    Team(TeamId),
}

/// A program. It does not change once it is part of a population, so that teams can share it.
#[derive(Debug, Clone, PartialEq)]
pub struct Program {
    /// Its code, at least one instruction.
    pub instructions: Vec<Instruction>,
    /// Evolved constants of the registers whose initial values can matter, [`Genes::initial_registers`]. Empty in a run without
    /// constants.
    pub constants: Constants,
    /// Element of the observation at which the observation vector and matrix begin, from 0.
    pub offset: u16,
    /// Where it leads when it wins.
    pub action: Action,
}

impl Program {
    /// Whether its action goes to the plant.
    #[must_use]
    pub fn is_atomic(&self) -> bool {
        matches!(self.action, Action::Atomic(_))
    }
}

/// A random action that goes to the plant.
#[must_use]
pub fn random_atomic(shape: &Shape, rng: &mut Rng) -> Action {
    match (shape.actions, shape.action_programs) {
        (ActionSpace::Continuous { .. }, ActionPrograms::Winner) => Action::Atomic(0),
        _ => Action::Atomic(rng.below(u64::from(shape.atomic_actions())) as u16),
    }
}

/// A team. It does not change once it is part of a population.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Team {
    /// Its programs, in order. At least one is atomic. Where outputs have programs of their own, each output has one.
    pub members: Vec<ProgramId>,
    /// Evolved constants of those slots of its shared memory that its programs read. Empty in a run without such memory, or
    /// without constants.
    pub memory: Constants,
    /// Names its random streams. Its clones keep it.
    pub stream_key: u32,
    /// When an agent with this root is reset, in a run where agents evolve it.
    pub reset_rule: Option<ResetRule>,
}

/// When an agent's registers and memory are reset, apart from the start of its evaluation. Agents evolve this rule (T §2.7).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ResetRule {
    /// Whether registers and random streams are reset at the start of each episode.
    pub registers: bool,
    /// Whether shared memory is reset at the start of each episode.
    pub memory: bool,
}

impl ResetRule {
    /// One of the four rules.
    #[must_use]
    pub fn random(rng: &mut Rng) -> Self {
        ResetRule {
            registers: rng.chance(0.5),
            memory: rng.chance(0.5),
        }
    }

    /// What a policy's header says of it.
    #[must_use]
    pub const fn scope(self) -> ResetScope {
        match (self.registers, self.memory) {
            (false, false) => ResetScope::PerAgent,
            (true, false) => ResetScope::MemoryPerAgent,
            (false, true) => ResetScope::MemoryPerEpisode,
            (true, true) => ResetScope::PerEpisode,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::genes;
    use super::*;

    #[test]
    fn copies_are_of_what_is_computed_and_as_frequent_as_they_are_said_to_be() {
        let mut genes = genes();
        genes.ops = Genes::ops_of(&[Group::Scalar, Group::Vector, Group::Copies]);
        let copies = |ops: &[Op]| -> Vec<Op> {
            let copies = ops.iter().filter(|op| op.group() == Group::Copies);
            copies.copied().collect()
        };
        let four = [Op::Move, Op::Latch, Op::VMove, Op::VLatch];
        assert_eq!(copies(&genes.ops), four);
        assert_eq!(
            copies(&Genes::ops_of(&[Group::Scalar, Group::Copies])),
            four[..2]
        );
        genes.copies = 0.5;
        let mut rng = Rng::new(2);
        let drawn: Vec<Op> = (0..4000)
            .map(|_| Instruction::random(&genes, &mut rng).op)
            .collect();
        // Of the other half, 4 of 43 are copies too: 0.547 in all.
        let share = copies(&drawn).len() as f64 / 4000.0;
        assert!((share - 0.547).abs() < 0.04, "{share}");
        for op in four {
            let count = drawn.iter().filter(|drawn| **drawn == op).count();
            assert!((400..700).contains(&count), "{op:?}: {count}");
        }
        // Without a group of copies the rate has nothing to draw, and draws nothing.
        genes.ops = Genes::ops_of(&[Group::Scalar]);
        let mut draws = |copies: f64| -> Vec<Instruction> {
            let mut rng = Rng::new(3);
            genes.copies = copies;
            (0..50)
                .map(|_| Instruction::random(&genes, &mut rng))
                .collect()
        };
        assert_eq!(draws(0.0), draws(0.5));
    }
}
