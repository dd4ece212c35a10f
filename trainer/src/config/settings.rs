//! A configuration whose meaning has been checked, in the types that evolution and scoring use.

use tpg_runtime::MAX_WIDTH;
use tpg_runtime::blob::{InitialValues, MemoryModel};
use tpg_runtime::isa::Op;
use tpg_runtime::tables::Range;

use super::error::ConfigError;
use super::schema::{self, Config, Curriculum, PolicyConfig, Resets, SelectionParams};
use super::{checks, front_end};
use crate::evolve::{EvolutionParams, Genes, Shape};
use crate::front_end::{FrontEndParams, action_variables};
use crate::lower::PolicySpec;
use crate::tune::TuningParams;
use tpg_tasks::eval::{Arena, DisturbError, Disturbance, Line, Link, Shaping};
use tpg_tasks::task::{self, ActionSpace, Channel, Observability, Spec, Wrappers, stack_text};

/// Everything that a run needs to know, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Name of the task, or path of the file that describes it.
    pub task: String,
    /// What fixes the task wherever its files lie.
    pub task_identity: String,
    /// Whether somebody else runs the task's episodes, so that it cannot be made here.
    pub external: bool,
    /// What genes programs have.
    pub genes: Genes,
    /// What exported policies say of themselves apart from their graph.
    pub policy_spec: PolicySpec,
    /// What policies see.
    pub observability: Vec<Observability>,
    /// Whether the population's memory is wiped when the median score falls (T §2.7).
    pub wipe_on_fall: bool,
    /// Training episodes of each new team.
    pub episodes: u32,
    /// Best teams that are scored again in each generation.
    pub elites: u32,
    /// Episodes after which a new team that lies far behind plays no more; 0: none is dropped.
    pub drop_after: u32,
    /// What of the reward the fitness of training counts.
    pub shaping: Shaping,
    /// Control steps after which training episodes end. 0 stands for the task's own limit, which holds in any case.
    pub max_steps: u32,
    /// How blackouts become as frequent as the task says.
    pub curriculum: Curriculum,
    /// What happens to observations and actions on their way, in order.
    pub disturb: Vec<Disturbance>,
    /// Rates and sizes of evolution.
    pub params: EvolutionParams,
    /// How evolved constants are tuned.
    pub tuning: TuningParams,
    /// How the champion is chosen.
    pub selection: SelectionParams,
    /// What front ends learn.
    pub front_end: FrontEndParams,
    /// Numbers of the columns that a front end's model describes, ascending. `None` if the data choose them.
    pub front_end_columns: Option<Vec<u16>>,
}

impl Settings {
    /// Checks what a configuration means.
    ///
    /// # Errors
    /// [`ConfigError::Value`] names the key, its value and what would be right.
    pub fn new(config: &Config) -> Result<Self, ConfigError> {
        schema::check(&table(config)?)?;
        if config.task.is_empty() {
            let why = "the preset names no task: give a name, the path of a .toml file, or series:FILE.csv:COLUMN, by --task";
            return Err(ConfigError::text("task", "", why));
        }
        let wrong_task = |why: String| ConfigError::text("task", &config.task, why);
        let task = task::create(&config.task).map_err(|e| wrong_task(e.to_string()))?;
        let identity = task::identity(&config.task).map_err(|e| wrong_task(e.to_string()))?;
        Self::of(config, task.spec(), identity, false)
    }

    /// Checks what a configuration means for a task whose episodes somebody else runs, such as an environment in Python.
    /// The configuration's own task is not looked at.
    ///
    /// # Errors
    /// As for [`Settings::new`], and where reward terms are shaped, which such a task does not tell.
    pub fn external(config: &Config, spec: &Spec) -> Result<Self, ConfigError> {
        schema::check(&table(config)?)?;
        if !config.evaluation.shaping.is_default() {
            let why = "the task gives its reward as one number, so no terms of it can be weighted";
            return Err(ConfigError::text("evaluation.shaping", &spec.name, why));
        }
        if !config.evaluation.disturb.is_empty() {
            let why = "somebody else runs the task's episodes, and so disturbs them";
            let texts = texts(&config.evaluation.disturb);
            return Err(ConfigError::text("evaluation.disturb", &texts, why));
        }
        Self::of(config, spec, format!("{spec:?}"), true)
    }

    fn of(
        config: &Config,
        spec: &Spec,
        task_identity: String,
        external: bool,
    ) -> Result<Self, ConfigError> {
        let mut observability = config.observability.clone();
        observability.retain(|part| *part != Observability::None);
        let stack = stack_text(&observability);
        let wrappers = Wrappers::new(&observability, spec)
            .map_err(|e| ConfigError::text("observability", &stack, e.to_string()))?;
        let policy = &config.policy;
        let policy_spec = PolicySpec {
            task: spec.name.clone(),
            observability: stack,
            labels: labels(wrappers.inputs(), &spec.outputs, spec.actions),
            ranges: ranges(wrappers.inputs(), &spec.outputs, spec.actions),
            shape: shape(policy, wrappers.inputs().len(), spec.actions)?,
            control_period_us: spec.period_us,
            register_mode: policy.register_mode,
            initial_values: policy.initial_values,
            reset_scope: policy.reset_scope.scope(),
            memory_model: policy.memory,
            write_distribution: policy.memory_writes,
            front_end: None,
        };
        line(&config.evaluation.disturb, spec, &wrappers)?;
        let ops = ops(policy);
        checks::check(config, &policy_spec, &ops)?;
        let variables = action_variables(policy_spec.shape.actions);
        let front_end_columns = front_end::check(&config.front_end, wrappers.inputs(), variables)?;
        Ok(Settings {
            task: config.task.clone(),
            task_identity,
            external,
            genes: Genes {
                shape: policy_spec.shape,
                ops,
                constants: policy_spec.initial_values == InitialValues::Evolved,
                register_mode: policy_spec.register_mode,
                team_memory: policy_spec.memory_model == MemoryModel::Team,
                reset_rules: policy.reset_scope == Resets::Evolved,
                copies: config.evolution.program.copies,
            },
            policy_spec,
            observability,
            wipe_on_fall: policy.reset_scope == Resets::OnFall,
            episodes: config.evaluation.episodes,
            elites: config.evaluation.elites,
            drop_after: config.evaluation.drop_after,
            shaping: config.evaluation.shaping,
            max_steps: config.evaluation.max_steps,
            curriculum: config.evaluation.curriculum,
            disturb: config.evaluation.disturb.clone(),
            params: config.evolution,
            tuning: config.tuning,
            selection: config.selection,
            front_end: config.front_end.clone(),
            front_end_columns,
        })
    }

    /// A fresh instance of the task behind its wrappers.
    ///
    /// # Errors
    /// [`ConfigError::Value`] if the task cannot be made any more, for example because its file is gone.
    pub fn arena(&self) -> Result<Arena, ConfigError> {
        let name = &self.task;
        let task =
            task::create(name).map_err(|e| ConfigError::text("task", name, e.to_string()))?;
        let wrappers = Wrappers::new(&self.observability, task.spec()).map_err(|e| {
            let stack = &self.policy_spec.observability;
            ConfigError::text("observability", stack, e.to_string())
        })?;
        let line = line(&self.disturb, task.spec(), &wrappers)?;
        let arena = Arena::new(task, wrappers).with_shaping(self.shaping);
        Ok(arena.with_line(line))
    }
}

/// The link between a task and its policies.
fn line(disturb: &[Disturbance], spec: &Spec, wrappers: &Wrappers) -> Result<Line, ConfigError> {
    let link = Link {
        inputs: wrappers.inputs(),
        outputs: &spec.outputs,
        actions: spec.actions,
        period_us: spec.period_us,
    };
    let wrong =
        |e: DisturbError| ConfigError::text("evaluation.disturb", &texts(disturb), e.to_string());
    Line::new(disturb, &link).map_err(wrong)
}

fn texts(disturb: &[Disturbance]) -> String {
    let texts: Vec<String> = disturb.iter().map(ToString::to_string).collect();
    texts.join(", ")
}

/// A configuration as it is written, without what is left out there.
fn table(config: &Config) -> Result<toml::Table, ConfigError> {
    toml::Table::try_from(config).map_err(|e| ConfigError::Toml(e.to_string()))
}

/// The operations of the configured groups, without those on memory that there is not.
fn ops(policy: &PolicyConfig) -> Vec<Op> {
    let mut ops = Genes::ops_of(&policy.groups);
    ops.retain(|op| {
        op.section()
            .is_none_or(|section| policy.memory_sections.contains(&section))
    });
    if policy.memory != MemoryModel::Indexed {
        ops.retain(|op| !matches!(op, Op::MemRead | Op::MemWrite));
    }
    ops
}

fn shape(policy: &PolicyConfig, inputs: usize, actions: ActionSpace) -> Result<Shape, ConfigError> {
    let outputs = match actions {
        ActionSpace::Discrete(_) => 1,
        ActionSpace::Continuous { len, .. } => len,
    };
    let inputs = u16::try_from(inputs).unwrap_or(u16::MAX);
    let Some(observed) = inputs.checked_mul(policy.history) else {
        let why = format!(
            "the task has {inputs} inputs, and windows hold at most {} elements",
            u16::MAX
        );
        return Err(ConfigError::value("policy.history", policy.history, why));
    };
    let width = match policy.width {
        0 => observed.max(outputs).min(MAX_WIDTH),
        width => width,
    };
    if width > MAX_WIDTH {
        let why = format!("the vector width is at most {MAX_WIDTH}");
        return Err(ConfigError::value("policy.width", width, why));
    }
    let most = Shape::most_outputs(width, policy.action_programs);
    if outputs > most {
        let why = format!(
            "policies of this width have at most {most} outputs, and the task has {outputs}"
        );
        return Err(ConfigError::value("policy.width", width, why));
    }
    Ok(Shape {
        width,
        inputs,
        history: policy.history,
        actions,
        action_programs: policy.action_programs,
    })
}

fn labels(inputs: &[Channel], outputs: &[Channel], actions: ActionSpace) -> String {
    let outputs = match actions {
        ActionSpace::Discrete(_) => &[],
        ActionSpace::Continuous { .. } => outputs,
    };
    let channels = inputs.iter().chain(outputs);
    channels
        .map(|c| format!("{}\t{}\n", c.name, c.unit))
        .collect()
}

/// The ranges of a policy's inputs and outputs as its file has them, none if the header says it all.
fn ranges(
    inputs: &[Channel],
    outputs: &[Channel],
    actions: ActionSpace,
) -> Vec<[u8; Range::BYTES]> {
    let (outputs, common) = match actions {
        ActionSpace::Discrete(_) => (&[][..], Range::ALL),
        ActionSpace::Continuous { low, high, .. } => (outputs, Range { low, high }),
    };
    let inputs = inputs.iter().map(|c| (c.range, Range::ALL));
    let outputs = outputs.iter().map(|c| (c.range, common));
    let channels = inputs.chain(outputs);
    // The format has one zero; adding it makes +0 of -0.
    let stored = |(range, default): (Option<Range>, Range)| {
        let Range { low, high } = range.unwrap_or(default);
        Range {
            low: low + 0.0,
            high: high + 0.0,
        }
    };
    if channels.clone().all(|channel| stored(channel) == channel.1) {
        return Vec::new();
    }
    channels.map(|channel| stored(channel).to_bytes()).collect()
}
