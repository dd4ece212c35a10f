//! A population of known size: every instruction of it can influence an action.

use tpg_runtime::Policy;
use tpg_runtime::isa::{Group, Op, Operand};
use tpg_runtime::tables::Section;
use tpg_tasks::task::Rng;
use tpg_trainer::config::{Config, Settings};
use tpg_trainer::evolve::{
    Action, Constants, Genes, Instruction, Population, Program, ProgramId, Source, Team,
};
use tpg_trainer::lower::{Mode, lower};

/// How large the policies are.
#[derive(Debug, Clone, Copy)]
pub struct Size {
    /// Root teams.
    pub roots: usize,
    /// Programs of each team, none of them shared.
    pub programs: usize,
    /// Effective instructions of each program, at least 8.
    pub instructions: usize,
    /// Programs of each team, the first ones, that compute one matrix product each.
    pub products: usize,
}

/// Makes the population; a seed fixes it.
///
/// A program writes to and reads from the scalars of its team's memory. Those with a matrix product read it by the means
/// of its rows. All other instructions are drawn as evolution draws them, each operation of the groups scalar, vector and
/// constants equally often, but for what touches matrices.
pub fn population(config: &Config, size: Size, seed: u64) -> Population {
    let settings = Settings::new(config).expect("a sound configuration");
    let mut genes = settings.genes.clone();
    genes.ops = Genes::ops_of(&[Group::Scalar, Group::Vector, Group::Constants]);
    genes.ops.retain(|op| *op != Op::ReloadM);
    let mut rng = Rng::new(seed);
    let mut population = Population::default();
    for _ in 0..size.roots {
        let mut members: Vec<ProgramId> = Vec::new();
        for k in 0..size.programs {
            let mut code = Code::new(&genes, size.instructions);
            code.write(k < size.products, &mut rng);
            let instructions = code.finish();
            members.push(population.add_program(Program {
                constants: genes.program_constants(&instructions, &mut rng),
                instructions,
                offset: rng.below(u64::from(genes.shape.inputs)) as u16,
                action: Action::Atomic(0),
            }));
        }
        let programs = members.iter().map(|id| &**population.program(*id));
        let mut memory = Constants::default();
        genes.fit_memory(&mut memory, programs, &mut rng);
        let root = population.add_team(Team {
            members,
            memory,
            stream_key: rng.word() as u32,
            reset_rule: None,
        });
        population.roots.push(root);
    }
    let root = population.roots[0];
    let policy_spec = &settings.policy_spec;
    let blob = lower(&population, root, policy_spec, [0; 16], None, Mode::Compact);
    let blob = blob.expect("within the format's limits");
    let policy = Policy::load(&blob).expect("a sound policy");
    let expected = (size.programs * size.instructions) as u32;
    assert_eq!(policy.bounds().instructions, expected, "all are effective");
    population
}

/// A program's code, written from its end to its start, so that it is known what each instruction is for.
struct Code<'a> {
    genes: &'a Genes,
    len: usize,
    reversed: Vec<Instruction>,
    /// Registers of each kind, a bit for each, whose values are still to come from somewhere.
    live: [u8; 3],
}

impl<'a> Code<'a> {
    fn new(genes: &'a Genes, len: usize) -> Self {
        Code {
            genes,
            len,
            reversed: Vec::new(),
            // The bid, and the action of several outputs.
            live: [1, 2, 0],
        }
    }

    fn write(&mut self, product: bool, rng: &mut Rng) {
        // Kinds of places that are not written yet; places of their own keep all programs alike.
        let (mut product, mut read, mut written) = (product, true, true);
        while self.reversed.len() < self.len {
            let left = self.len - self.reversed.len();
            if written && left <= self.len / 4 {
                written = false;
                self.push(Op::WriteS, 0, rng);
            } else if read && left <= 3 * self.len / 4 && self.live[0] != 0 {
                read = false;
                let to = pick(self.live[0], rng);
                self.push(Op::ReadS, to, rng);
            } else if product && left <= self.len / 2 && self.live[1] != 0 {
                product = false;
                let to = pick(self.live[1], rng);
                self.push(Op::RowMean, to, rng);
                let matrix = self.live[2].trailing_zeros() as u8;
                self.push(Op::MatMul, matrix, rng);
            } else {
                self.draw(rng);
            }
        }
    }

    /// A random instruction that writes a live register.
    fn draw(&mut self, rng: &mut Rng) {
        loop {
            let op = self.genes.ops[rng.below(self.genes.ops.len() as u64) as usize];
            let Some(section) = written(op).filter(|s| self.live[*s as usize] != 0) else {
                continue;
            };
            let before = self.live;
            let to = pick(self.live[section as usize], rng);
            self.push(op, to, rng);
            // Scalars and vectors stay wanted, so that the rest finds places to write to.
            if self.live[0] != 0 && self.live[1] != 0 {
                return;
            }
            self.live = before;
            self.reversed.pop();
        }
    }

    fn push(&mut self, op: Op, destination: u8, rng: &mut Rng) {
        let kinds = op.operands();
        let mut source = |kind| {
            let mut source = Source::random(kind, &self.genes.shape, rng);
            if op == Op::RowMean {
                source.observed = false;
                source.element = 0;
                source.register = 0;
            }
            source
        };
        let [a, b] = kinds.map(&mut source);
        if let Some(section) = written(op)
            && !op.destination().is_update()
        {
            self.live[section as usize] &= !(1 << destination);
        }
        for (kind, source) in kinds.into_iter().zip([a, b]) {
            if !source.observed
                && let Some(section) = read(kind, source)
            {
                self.live[section as usize] |= 1 << source.register;
            }
        }
        self.reversed.push(Instruction {
            op,
            destination,
            a,
            b,
        });
    }

    fn finish(mut self) -> Vec<Instruction> {
        self.reversed.reverse();
        self.reversed
    }
}

fn pick(set: u8, rng: &mut Rng) -> u8 {
    loop {
        let register = rng.below(8) as u8;
        if set & (1 << register) != 0 {
            return register;
        }
    }
}

fn written(op: Op) -> Option<Section> {
    op.destination().section()
}

fn read(kind: Operand, source: Source) -> Option<Section> {
    match kind {
        Operand::S => Some(Section::Scalar),
        Operand::SOrVElement if !source.of_vector => Some(Section::Scalar),
        Operand::V | Operand::VElement | Operand::SOrVElement => Some(Section::Vector),
        Operand::M | Operand::MElement => Some(Section::Matrix),
        _ => None,
    }
}
