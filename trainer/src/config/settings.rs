//! A configuration whose meaning has been checked, in the types that evolution and scoring use.

use tpg_runtime::blob::{InitialValues, MemoryModel, RegisterMode, ResetScope, WriteDistribution};
use tpg_runtime::isa::{Group, Op};
use tpg_runtime::tables::Section;

use super::layers::nearest;
use super::{Config, ConfigError, Curriculum, SelectionParams, beyond, front_end};
use crate::evolve::{ActionPrograms, EvolutionParams, Genes, Shape, SizeRange};
use crate::front_end::{FrontEndParams, action_variables};
use crate::lower::PolicySpec;
use crate::tune::TuningParams;
use tpg_tasks::eval::{Arena, Shaping};
use tpg_tasks::task::{self, ActionSpace, Channel, Observability, Wrappers, stack_text};

/// Everything that a run needs to know, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Name of the task, or path of the file that describes it.
    pub task: String,
    /// What fixes the task wherever its files lie.
    pub task_identity: String,
    /// What genes programs have.
    pub genes: Genes,
    /// What exported policies say of themselves.
    pub policy_spec: PolicySpec,
    /// What policies see.
    pub observability: Vec<Observability>,
    /// Whether the population's memory is wiped when the median score falls (T §2.7).
    pub wipe_on_fall: bool,
    /// Training episodes of each new team.
    pub episodes: u32,
    /// Best teams that are scored again in each generation.
    pub elites: u32,
    /// What of the reward the fitness of training counts.
    pub shaping: Shaping,
    /// Control steps after which training episodes end; 0 stands for the task's own limit.
    pub max_steps: u32,
    /// How blackouts become as frequent as the task says.
    pub curriculum: Curriculum,
    /// Rates and sizes of evolution.
    pub params: EvolutionParams,
    /// How evolved constants are tuned.
    pub tuning: TuningParams,
    /// How the champion is chosen.
    pub selection: SelectionParams,
    /// What policies learn to perceive.
    pub front_end: FrontEndParams,
    /// The columns that a front end's model describes; `None` if the data choose them.
    pub front_end_columns: Option<Vec<u16>>,
}

impl Settings {
    /// Checks what a configuration means.
    ///
    /// # Errors
    /// [`ConfigError::Value`] names the key, its value and what would be right.
    pub fn new(config: &Config) -> Result<Self, ConfigError> {
        if config.task.is_empty() {
            let why =
                "the preset names no task: give a name, or the path of a .toml file, by --task";
            return Err(value("task", "", why));
        }
        let task =
            task::create(&config.task).map_err(|e| value("task", &config.task, e.to_string()))?;
        let text = config.observability.join("+");
        let text = if text.is_empty() { "none" } else { &text };
        let observability =
            task::parse_stack(text).map_err(|e| value("observability", text, e.to_string()))?;
        let wrappers = Wrappers::new(&observability, task.spec())
            .map_err(|e| value("observability", text, e.to_string()))?;
        let spec = task.spec();
        let policy = &config.policy;
        let groups = groups(&policy.groups)?;
        let resets = Resets::named(&policy.reset_scope)?;
        let policy_spec = PolicySpec {
            task: spec.name.clone(),
            observability: stack_text(&observability),
            labels: labels(wrappers.inputs(), &spec.outputs, spec.actions),
            shape: Shape {
                action_programs: named(
                    "policy.action-programs",
                    &policy.action_programs,
                    ActionPrograms::ALL,
                    ActionPrograms::name,
                )?,
                ..shape(policy.width, wrappers.inputs().len(), spec.actions)?
            },
            control_period_us: spec.period_us,
            register_mode: named(
                "policy.register-mode",
                &policy.register_mode,
                RegisterMode::ALL,
                RegisterMode::name,
            )?,
            initial_values: named(
                "policy.initial-values",
                &policy.initial_values,
                InitialValues::ALL,
                InitialValues::name,
            )?,
            reset_scope: resets.scope(),
            memory_model: named("policy.memory", &policy.memory, MemoryModel::ALL, |v| {
                v.name()
            })?,
            write_distribution: named(
                "policy.memory-writes",
                &policy.memory_writes,
                WriteDistribution::ALL,
                WriteDistribution::name,
            )?,
            front_end: None,
        };
        check_policy(&policy_spec, &groups, config)?;
        check_params(config)?;
        let ops = ops(&groups, &policy.memory_sections, policy_spec.memory_model)?;
        beyond::check(config, &policy_spec, &ops)?;
        let variables = action_variables(policy_spec.shape.actions);
        let front_end_columns = front_end::check(&config.front_end, wrappers.inputs(), variables)?;
        Ok(Settings {
            task: config.task.clone(),
            task_identity: task::identity(&config.task)
                .map_err(|e| value("task", &config.task, e.to_string()))?,
            genes: Genes {
                shape: policy_spec.shape,
                ops,
                constants: policy_spec.initial_values == InitialValues::Evolved,
                team_memory: policy_spec.memory_model == MemoryModel::Team,
                reset_rules: resets == Resets::Evolved,
            },
            policy_spec,
            observability,
            wipe_on_fall: resets == Resets::OnFall,
            episodes: config.evaluation.episodes,
            elites: config.evaluation.elites,
            shaping: config.evaluation.shaping,
            max_steps: config.evaluation.max_steps,
            curriculum: config.evaluation.curriculum,
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
    /// [`ConfigError::Value`] if the task is not to be had any more.
    pub fn arena(&self) -> Result<Arena, ConfigError> {
        let name = &self.task;
        let task = task::create(name).map_err(|e| value("task", name, e.to_string()))?;
        let wrappers = Wrappers::new(&self.observability, task.spec()).map_err(|e| {
            value(
                "observability",
                &self.policy_spec.observability,
                e.to_string(),
            )
        })?;
        Ok(Arena::new(task, wrappers).with_shaping(self.shaping))
    }
}

/// Who decides when registers and memory are reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Resets {
    /// The run, once for all policies.
    Fixed(ResetScope),
    /// The run: one memory for the population, wiped when the median score falls.
    OnFall,
    /// Each policy, as it evolved.
    Evolved,
}

impl Resets {
    const ON_FALL: &str = "on-fall";
    const EVOLVED: &str = "evolved";

    fn named(name: &str) -> Result<Self, ConfigError> {
        let fixed = ResetScope::ALL.iter().copied();
        let all: Vec<Self> = (fixed.map(Resets::Fixed))
            .chain([Resets::OnFall, Resets::Evolved])
            .collect();
        named("policy.reset-scope", name, &all, |resets| match resets {
            Resets::Fixed(scope) => scope.name(),
            Resets::OnFall => Self::ON_FALL,
            Resets::Evolved => Self::EVOLVED,
        })
    }

    /// What policies say of themselves, unless they evolved a rule of their own.
    const fn scope(self) -> ResetScope {
        match self {
            Resets::Fixed(scope) => scope,
            Resets::OnFall => ResetScope::Original,
            Resets::Evolved => ResetScope::PerAgent,
        }
    }
}

pub(super) fn value(key: &'static str, value: &str, why: impl Into<String>) -> ConfigError {
    ConfigError::Value {
        key,
        value: format!("{value:?}"),
        why: why.into(),
    }
}

/// The value of this name.
fn named<T: Copy>(
    key: &'static str,
    name: &str,
    all: &[T],
    name_of: impl Fn(T) -> &'static str,
) -> Result<T, ConfigError> {
    all.iter()
        .copied()
        .find(|v| name_of(*v) == name)
        .ok_or_else(|| {
            let names: Vec<&str> = all.iter().map(|v| name_of(*v)).collect();
            let suggestion = nearest(name, names.iter().copied());
            let why = format!(
                "not one of {}; did you mean {suggestion:?}?",
                names.join(", ")
            );
            value(key, name, why)
        })
}

fn groups(names: &[String]) -> Result<Vec<Group>, ConfigError> {
    if names.is_empty() {
        return Err(value(
            "policy.groups",
            "[]",
            "programs need at least one instruction group",
        ));
    }
    names
        .iter()
        .map(|name| named("policy.groups", name, &Group::ALL, Group::name))
        .collect()
}

/// The operations of these groups that use none but the memory that there is.
fn ops(groups: &[Group], sections: &[String], memory: MemoryModel) -> Result<Vec<Op>, ConfigError> {
    let key = "policy.memory-sections";
    let sections: Vec<Section> = sections
        .iter()
        .map(|name| named(key, name, &Section::ALL, section_name))
        .collect::<Result<_, _>>()?;
    let mut ops = Genes::ops_of(groups);
    ops.retain(|op| op.section().is_none_or(|s| sections.contains(&s)));
    if memory != MemoryModel::Indexed {
        ops.retain(|op| !matches!(op, Op::MemRead | Op::MemWrite));
    }
    if groups.contains(&Group::TeamMemory) && sections.is_empty() {
        return Err(value(key, "[]", "team memory needs at least one section"));
    }
    Ok(ops)
}

/// Configuration name of a section of team memory.
fn section_name(section: Section) -> &'static str {
    match section {
        Section::Scalar => "scalar",
        Section::Vector => "vector",
        Section::Matrix => "matrix",
    }
}

fn shape(width: u16, inputs: usize, actions: ActionSpace) -> Result<Shape, ConfigError> {
    let outputs = match actions {
        ActionSpace::Discrete(_) => 1,
        ActionSpace::Continuous { len, .. } => len,
    };
    let inputs = u16::try_from(inputs).unwrap_or(u16::MAX);
    let chosen = if width == 0 {
        inputs.max(outputs)
    } else {
        width
    };
    if chosen < outputs || chosen > tpg_runtime::MAX_WIDTH {
        let why = format!(
            "the vector width must lie between the {outputs} outputs and {}",
            tpg_runtime::MAX_WIDTH
        );
        return Err(value("policy.width", &chosen.to_string(), why));
    }
    Ok(Shape {
        width: chosen,
        inputs,
        actions,
        action_programs: ActionPrograms::Winner,
    })
}

fn labels(inputs: &[Channel], outputs: &[Channel], actions: ActionSpace) -> String {
    let outputs = match actions {
        ActionSpace::Discrete(_) => &[],
        ActionSpace::Continuous { .. } => outputs,
    };
    let lines = inputs.iter().chain(outputs);
    lines.map(|c| format!("{}\t{}\n", c.name, c.unit)).collect()
}

/// Refuses combinations that no policy can have.
fn check_policy(
    policy_spec: &PolicySpec,
    groups: &[Group],
    config: &Config,
) -> Result<(), ConfigError> {
    let stateless = policy_spec.register_mode == RegisterMode::Stateless
        && policy_spec.memory_model == MemoryModel::None;
    if stateless != (policy_spec.reset_scope == ResetScope::EveryDecision) {
        let why = "stateless registers without memory go with every-decision, all else with \
                   another scope";
        return Err(value("policy.reset-scope", &config.policy.reset_scope, why));
    }
    let has = |group| groups.contains(&group);
    let team = policy_spec.memory_model == MemoryModel::Team;
    if team != (has(Group::TeamMemory) || has(Group::WholeReads)) {
        let why = "memory = \"team\" and the group team-memory go together";
        return Err(value("policy.memory", &config.policy.memory, why));
    }
    if policy_spec.memory_model == MemoryModel::Indexed && !has(Group::Classic) {
        let why = "memory = \"indexed\" needs the group classic";
        return Err(value("policy.memory", &config.policy.memory, why));
    }
    if has(Group::Constants) && policy_spec.initial_values == InitialValues::Zero {
        let why = "the group constants needs initial-values = \"evolved\"";
        return Err(value(
            "policy.initial-values",
            &config.policy.initial_values,
            why,
        ));
    }
    Ok(())
}

fn check_params(config: &Config) -> Result<(), ConfigError> {
    let params = &config.evolution;
    // Tuning alone needs no children.
    let children = params.children.max(config.tuning.lineages);
    let positive = [
        ("evaluation.episodes", config.evaluation.episodes),
        ("evolution.population", params.population),
        ("evolution.children", children),
        ("evolution.tournament", params.tournament),
    ];
    for (key, n) in positive {
        if n == 0 {
            return Err(value(key, "0", "must be at least 1"));
        }
    }
    let (team, program, constants) = (&params.team, &params.program, &params.constants);
    let rates = [
        ("evolution.team.crossover", team.crossover),
        ("evolution.team.inherit", team.inherit),
        ("evolution.team.delete", team.delete),
        ("evolution.team.add", team.add),
        ("evolution.team.reorder", team.reorder),
        ("evolution.team.mutate", team.mutate),
        ("evolution.team.reset", team.reset),
        ("evolution.team.grow", team.grow),
        ("evolution.team.remember", team.remember),
        ("evolution.program.code", program.code),
        ("evolution.program.change", program.change),
        ("evolution.program.swap", program.swap),
        ("evolution.program.delete", program.delete),
        ("evolution.program.add", program.add),
        ("evolution.program.action", program.action),
        ("evolution.program.atomic", program.atomic),
        ("evolution.program.offset", program.offset),
        ("evolution.constants.mutate", constants.mutate),
        ("evolution.constants.flip", constants.flip),
    ];
    for (key, rate) in rates {
        if !(0.0..=1.0).contains(&rate) {
            return Err(value(
                key,
                &rate.to_string(),
                "a probability lies between 0 and 1",
            ));
        }
    }
    let (low, high) = (constants.factor_min, constants.factor_max);
    if !(low.is_finite() && high.is_finite() && low <= high) {
        let why = "factors must be finite, the smallest not above the largest";
        return Err(value(
            "evolution.constants.factor-min",
            &low.to_string(),
            why,
        ));
    }
    check_size("evolution.team.size", team.size, 1000)?;
    check_size("evolution.program.size", program.size, 60_000)
}

fn check_size(key: &'static str, size: SizeRange, limit: u32) -> Result<(), ConfigError> {
    let SizeRange {
        initial_min,
        initial_max,
        max,
    } = size;
    if initial_min == 0 || initial_min > initial_max || initial_max > max || max > limit {
        let shown = format!("{initial_min}..{initial_max}, at most {max}");
        let why = format!("1 <= initial-min <= initial-max <= max <= {limit} must hold");
        return Err(value(key, &shown, why));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{presets, resolve};

    #[test]
    fn every_preset_makes_sense() {
        for preset in presets().expect("well-formed") {
            let config = resolve(&preset, None, &[]).expect("complete");
            match Settings::new(&config) {
                Ok(settings) => {
                    assert_eq!(settings.policy_spec.observability, preset.observability)
                }
                // Without MuJoCo its tasks are known but cannot be made.
                Err(e) => assert!(
                    cfg!(not(feature = "mujoco"))
                        && !["cartpole", "acrobot", "pendulum"].contains(&preset.task),
                    "{e}"
                ),
            }
        }
    }
}
