//! Checks of settings that make no sense together. Bounds of single settings stand in the schema.

use tpg_runtime::blob::{InitialValues, MemoryModel, RegisterMode, ResetScope};
use tpg_runtime::isa::{Group, Op};

use super::error::ConfigError;
use super::schema::{Config, PolicyConfig};
use crate::evolve::{Initial, SizeRange, linear_ops, memory_ops};
use crate::keys::Named as _;
use crate::lower::PolicySpec;
use crate::tune::TuningParams;
use tpg_tasks::task::Observability;

/// Refuses settings that make no sense together, or not with this policy.
pub(super) fn check(
    config: &Config,
    policy_spec: &PolicySpec,
    ops: &[Op],
) -> Result<(), ConfigError> {
    check_policy(&config.policy)?;
    check_evolution(config)?;
    check_action_programs(config, policy_spec)?;
    check_initial(config.evolution.initial, policy_spec, ops)?;
    check_tuning(&config.tuning, policy_spec)?;
    check_memory(config, policy_spec, ops)?;
    check_curriculum(config, policy_spec)?;
    check_dropping(config, policy_spec)?;
    let scored_again = [
        ("evaluation.elites", config.evaluation.elites),
        ("tuning.lines", config.tuning.lineages),
        ("selection.candidates", config.selection.candidates),
    ];
    for (key, number) in scored_again {
        if number > 0 && policy_spec.shares_memory() {
            let why = "where agents share one memory none can be scored twice; take another \
                       policy.reset-scope, or 0";
            return Err(ConfigError::value(key, number, why));
        }
    }
    Ok(())
}

fn check_dropping(config: &Config, policy_spec: &PolicySpec) -> Result<(), ConfigError> {
    let (key, drop_after) = ("evaluation.drop-after", config.evaluation.drop_after);
    if drop_after == 0 {
        return Ok(());
    }
    let episodes = config.evaluation.episodes;
    if drop_after < 2 || drop_after >= episodes {
        let why = format!(
            "at least 2 episodes tell how far one lies behind, and fewer than evaluation.episodes = {episodes} must be; or 0"
        );
        return Err(ConfigError::value(key, drop_after, why));
    }
    if policy_spec.reset_scope.at_episode() != (true, true) {
        let why = "an agent that keeps something from episode to episode plays them all in one go; take another \
                   policy.reset-scope, or 0";
        return Err(ConfigError::value(key, drop_after, why));
    }
    Ok(())
}

/// Refuses combinations that no policy can have.
fn check_policy(policy: &PolicyConfig) -> Result<(), ConfigError> {
    let has = |group| policy.groups.contains(&group);
    if policy.groups.is_empty() {
        let why = "programs need at least one instruction group";
        return Err(ConfigError::value("policy.groups", "[]", why));
    }
    let stateless =
        policy.register_mode == RegisterMode::Stateless && policy.memory == MemoryModel::None;
    if stateless != (policy.reset_scope.scope() == ResetScope::EveryDecision) {
        let why = "stateless registers without memory go with every-decision, all else with \
                   another scope";
        let name = policy.reset_scope.name();
        return Err(ConfigError::text("policy.reset-scope", name, why));
    }
    let wrong_memory = |why| ConfigError::text("policy.memory", policy.memory.name(), why);
    let team = policy.memory == MemoryModel::Team;
    if team != (has(Group::TeamMemory) || has(Group::WholeReads)) {
        return Err(wrong_memory(
            "memory = \"team\" and the group team-memory go together",
        ));
    }
    if policy.memory == MemoryModel::Indexed && !has(Group::Classic) {
        return Err(wrong_memory("memory = \"indexed\" needs the group classic"));
    }
    if has(Group::Constants) && policy.initial_values == InitialValues::Zero {
        let why = "the group constants needs initial-values = \"evolved\"";
        let name = policy.initial_values.name();
        return Err(ConfigError::text("policy.initial-values", name, why));
    }
    if has(Group::TeamMemory) && policy.memory_sections.is_empty() {
        let why = "team memory needs at least one section";
        return Err(ConfigError::value("policy.memory-sections", "[]", why));
    }
    Ok(())
}

fn check_evolution(config: &Config) -> Result<(), ConfigError> {
    let params = &config.evolution;
    if params.children == 0 && config.tuning.lineages == 0 {
        let why = "must be at least 1 where tuning.lines is 0: nothing would change";
        return Err(ConfigError::value("evolution.children", 0, why));
    }
    let (low, high) = (params.constants.factor_min, params.constants.factor_max);
    if low > high {
        let why = format!("must not be above evolution.constants.factor-max = {high}");
        return Err(ConfigError::value(
            "evolution.constants.factor-min",
            low,
            why,
        ));
    }
    check_size("evolution.team.size", params.team.size)?;
    check_size("evolution.program.size", params.program.size)
}

fn check_size(key: &str, size: SizeRange) -> Result<(), ConfigError> {
    let SizeRange {
        initial_min,
        initial_max,
        max,
    } = size;
    if initial_min > initial_max || initial_max > max {
        let shown = format!("{initial_min}..{initial_max}, at most {max}");
        let why = "initial-min <= initial-max <= max must hold";
        return Err(ConfigError::value(key, shown, why));
    }
    Ok(())
}

fn check_action_programs(config: &Config, policy_spec: &PolicySpec) -> Result<(), ConfigError> {
    let shape = &policy_spec.shape;
    let name = shape.action_programs.name();
    if !shape.action_programs.fits(shape.actions) {
        let why = format!(
            "the task {} does not have several continuous outputs; take \"winner\"",
            policy_spec.task
        );
        return Err(ConfigError::text("policy.action-programs", name, why));
    }
    let (outputs, max) = (shape.separate_outputs(), config.evolution.team.size.max);
    if max < u32::from(outputs) {
        let why = format!(
            "policy.action-programs = {name:?} needs room for a program for each of {outputs} outputs"
        );
        return Err(ConfigError::value("evolution.team.size.max", max, why));
    }
    Ok(())
}

fn check_initial(
    initial: Initial,
    policy_spec: &PolicySpec,
    ops: &[Op],
) -> Result<(), ConfigError> {
    let key = "evolution.initial";
    if initial == Initial::Random {
        return Ok(());
    }
    let name = initial.name();
    let needed = linear_ops(&policy_spec.shape, initial);
    if let Some(missing) = needed.into_iter().find(|op| !ops.contains(op)) {
        let why = format!(
            "needs the operation {}, which is in none of policy.groups",
            missing.mnemonic()
        );
        return Err(ConfigError::text(key, name, why));
    }
    if policy_spec.initial_values == InitialValues::Zero {
        let why = "needs policy.initial-values = \"evolved\"";
        return Err(ConfigError::text(key, name, why));
    }
    if initial == Initial::LinearHistory && policy_spec.register_mode == RegisterMode::Stateless {
        let why = "needs policy.register-mode = \"stateful\", to remember the last observation";
        return Err(ConfigError::text(key, name, why));
    }
    if initial == Initial::LinearHistory && policy_spec.shape.output_registers().len() > 1 {
        let why = "needs a policy.width of at least the number of outputs; take \"linear\"";
        return Err(ConfigError::text(key, name, why));
    }
    Ok(())
}

fn check_memory(config: &Config, policy_spec: &PolicySpec, ops: &[Op]) -> Result<(), ConfigError> {
    let (rate, after) = (config.evolution.team.remember, config.tuning.remember_after);
    let (key, text) = if after > 0 {
        ("tuning.remember-after", after.to_string())
    } else if rate > 0.0 {
        ("evolution.team.remember", rate.to_string())
    } else {
        return Ok(());
    };
    let needed = memory_ops(&policy_spec.shape);
    if let Some(missing) = needed.into_iter().find(|op| !ops.contains(op)) {
        let missing = missing.mnemonic();
        let why = format!("needs the operation {missing}, which is in none of policy.groups");
        return Err(ConfigError::value(key, text, why));
    }
    if policy_spec.register_mode == RegisterMode::Stateless
        || policy_spec.initial_values == InitialValues::Zero
    {
        let why = "memory lies in registers that keep their values: it needs policy.register-mode = \"stateful\" and \
                   policy.initial-values = \"evolved\"";
        return Err(ConfigError::value(key, text, why));
    }
    Ok(())
}

fn check_curriculum(config: &Config, policy_spec: &PolicySpec) -> Result<(), ConfigError> {
    let steps = config.evaluation.curriculum.steps;
    if steps == 0 {
        return Ok(());
    }
    let wrong = |why: &str| {
        Err(ConfigError::value(
            "evaluation.curriculum.steps",
            steps,
            why,
        ))
    };
    let is_blackout = |part: &Observability| matches!(part, Observability::Blackout { .. });
    if policy_spec.shares_memory() {
        return wrong(
            "all agents are scored again at each stage, which none can be where agents share one memory",
        );
    }
    if !config.observability.iter().any(is_blackout) {
        return wrong("there is no blackout in observability to begin without");
    }
    Ok(())
}

fn check_tuning(tuning: &TuningParams, policy_spec: &PolicySpec) -> Result<(), ConfigError> {
    if tuning.lineages == 0 {
        return Ok(());
    }
    if policy_spec.initial_values == InitialValues::Zero {
        let why = "there are no constants to tune with policy.initial-values = \"zero\"";
        return Err(ConfigError::value("tuning.lines", tuning.lineages, why));
    }
    if tuning.halve && tuning.one_after == 0 {
        let why = "needs tuning.one-after, the iterations after which one of the lines is left";
        return Err(ConfigError::value("tuning.halve", true, why));
    }
    if tuning.top > tuning.directions {
        let why = format!(
            "must not be above tuning.directions = {}",
            tuning.directions
        );
        return Err(ConfigError::value("tuning.top", tuning.top, why));
    }
    Ok(())
}
