//! Policies made by hand, so that a test knows what must happen in them.

use tpg_runtime::blob::{InitialValues, MemoryModel, RegisterMode, ResetScope, WriteDistribution};
use tpg_runtime::isa::Op;
use tpg_tasks::task::{self, ActionSpace};
use tpg_trainer::evolve::{
    Action, ActionPrograms, Constants, Instruction, Population, Program, Registers, Shape, Source,
    Team, TeamId,
};
use tpg_trainer::lower::{Mode, PolicySpec, lower};

/// A chain of three teams; the last writes its team's memory and reads it in every decision.
///
/// The roots' other programs win where the first input is low, so that some decisions end early. Actions
/// mix the observation with what memory holds.
///
/// # Panics
/// If the task does not exist in this build.
#[must_use]
pub fn three_teams(task_name: &str, mode: RegisterMode) -> Vec<u8> {
    let task = task::create(task_name).expect("a task of this build");
    let spec = task.spec();
    let outputs = match spec.actions {
        ActionSpace::Discrete(_) => &[],
        ActionSpace::Continuous { .. } => spec.outputs.as_slice(),
    };
    let channels = spec.inputs.iter().chain(outputs);
    let shape = Shape {
        width: spec.inputs.len() as u16,
        inputs: spec.inputs.len() as u16,
        history: 1,
        actions: spec.actions,
        action_programs: ActionPrograms::Winner,
    };
    let policy_spec = PolicySpec {
        task: spec.name.clone(),
        observability: "blackout:1/3".into(),
        labels: channels
            .map(|c| format!("{}\t{}\n", c.name, c.unit))
            .collect(),
        ranges: Vec::new(),
        shape,
        control_period_us: spec.period_us,
        register_mode: mode,
        initial_values: InitialValues::Evolved,
        reset_scope: ResetScope::PerEpisode,
        memory_model: MemoryModel::Team,
        write_distribution: WriteDistribution::Thesis,
        front_end: None,
    };
    let mut population = Population::default();
    let last = add_team(&mut population, &shape, 3, None);
    let middle = add_team(&mut population, &shape, 2, Some(last));
    let root = add_team(&mut population, &shape, 1, Some(middle));
    lower(
        &population,
        root,
        &policy_spec,
        [1; 16],
        None,
        Mode::Compact,
    )
    .expect("small enough")
}

/// A team of two atomic programs and, if it leads on, one that mostly outbids them.
fn add_team(
    population: &mut Population,
    shape: &Shape,
    stream_key: u32,
    next: Option<TeamId>,
) -> TeamId {
    // Registers and slots that need none have constants too: exported policies leave them out.
    let constants = |salt: usize| {
        let mut values = (0..).map(|k: usize| ((k * 37 + salt * 11) % 101) as f32 / 50.0 - 1.0);
        Constants::new(Registers::ALL, shape.width, || values.next().unwrap_or(0.0))
    };
    let key = stream_key as usize;
    let program = |action: Action, salt: usize, instructions: Vec<Instruction>| Program {
        instructions,
        constants: constants(salt),
        offset: (salt % usize::from(shape.inputs)) as u16,
        action,
    };
    let mut members = Vec::new();
    for rival in 0..2 {
        let index = match shape.actions {
            ActionSpace::Discrete(actions) => (key + rival) as u16 % actions,
            ActionSpace::Continuous { .. } => 0,
        };
        let acting = program(Action::Atomic(index), key + 5 * rival, acting());
        members.push(population.add_program(acting));
    }
    if let Some(next) = next {
        let leading_on = program(Action::Team(next), key, leading_on());
        members.push(population.add_program(leading_on));
    }
    population.add_team(Team {
        members,
        memory: constants(key),
        stream_key,
        reset_rule: None,
    })
}

fn instruction(op: Op, destination: u8, a: Source, b: Source) -> Instruction {
    Instruction {
        op,
        destination,
        a,
        b,
    }
}

/// Writes memory, reads it, and lets both bid and action depend on what it read.
fn acting() -> Vec<Instruction> {
    let register = Source::register;
    vec![
        instruction(Op::VScale, 2, register(3), Source::observation(0)),
        instruction(Op::VAdd, 1, register(2), register(4)),
        instruction(Op::Add, 5, register(5), Source::observation(1)),
        instruction(Op::WriteS, 0, register(5), Source::default()),
        instruction(Op::WriteV, 0, register(1), Source::default()),
        instruction(Op::ReadS, 6, Source::element(4, 0), Source::default()),
        instruction(Op::ReadV, 7, Source::element(3, 0), Source::element(0, 1)),
        instruction(Op::Mul, 0, register(6), register(7)),
        instruction(Op::Sin, 1, register(0), Source::default()),
        instruction(Op::VScale, 1, register(1), register(1)),
        instruction(Op::Tanh, 0, register(0), Source::default()),
    ]
}

/// Bids 1.5 for most observations, above the tanh of its rival, and less for some.
fn leading_on() -> Vec<Instruction> {
    let register = Source::register;
    vec![
        instruction(Op::VMean, 3, Source::observation(0), Source::default()),
        instruction(Op::Heaviside, 4, register(3), Source::default()),
        instruction(Op::Exp, 0, register(4), Source::default()),
        instruction(Op::Recip, 2, register(0), Source::default()),
        instruction(Op::Add, 0, register(0), register(2)),
    ]
}
