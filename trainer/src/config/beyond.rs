//! Checks of what goes beyond the thesis: tuning, shaping, choosing the champion, linear policies to begin with.

use tpg_runtime::blob::{InitialValues, RegisterMode};
use tpg_runtime::isa::Op;

use super::settings::value;
use super::{Config, ConfigError, SelectionParams};
use crate::evolve::{ActionPrograms, Initial, linear_ops, memory_ops};
use crate::lower::PolicySpec;
use crate::tune::TuningParams;
use tpg_tasks::task::ActionSpace;

/// Refuses settings that make no sense, or not with this policy.
pub(super) fn check(
    config: &Config,
    policy_spec: &PolicySpec,
    ops: &[Op],
) -> Result<(), ConfigError> {
    check_action_programs(config, policy_spec)?;
    check_initial(config.evolution.initial, policy_spec, ops)?;
    check_tuning(&config.tuning, policy_spec)?;
    check_memory(config, policy_spec, ops)?;
    check_curriculum(config, policy_spec)?;
    check_selection(&config.selection)?;
    let (alive, control) = (
        config.evaluation.shaping.alive,
        config.evaluation.shaping.control,
    );
    for (key, factor) in [
        ("evaluation.shaping.alive", alive),
        ("evaluation.shaping.control", control),
    ] {
        if !factor.is_finite() {
            return Err(value(key, &factor.to_string(), "a factor must be finite"));
        }
    }
    let again = [
        ("evaluation.elites", config.evaluation.elites),
        ("tuning.lines", config.tuning.lineages),
        ("selection.candidates", config.selection.candidates),
    ];
    for (key, number) in again {
        if number > 0 && policy_spec.shares_memory() {
            let why = "where agents share one memory none can be scored twice; take another \
                       policy.reset-scope, or 0";
            return Err(value(key, &number.to_string(), why));
        }
    }
    Ok(())
}

fn check_action_programs(config: &Config, policy_spec: &PolicySpec) -> Result<(), ConfigError> {
    let shape = &policy_spec.shape;
    if shape.action_programs == ActionPrograms::Winner {
        return Ok(());
    }
    let ActionSpace::Continuous { len: 2.., .. } = shape.actions else {
        let why = format!(
            "the task {} does not have several continuous outputs; take \"winner\"",
            policy_spec.task
        );
        let name = shape.action_programs.name();
        return Err(value("policy.action-programs", name, why));
    };
    let (outputs, max) = (
        u32::from(shape.atomic_actions()),
        config.evolution.team.size.max,
    );
    if max < outputs {
        let why = format!(
            "policy.action-programs = \"each\" needs room for a program for each of {outputs} outputs"
        );
        return Err(value("evolution.team.size.max", &max.to_string(), why));
    }
    Ok(())
}

fn check_initial(
    initial: Initial,
    policy_spec: &PolicySpec,
    ops: &[Op],
) -> Result<(), ConfigError> {
    let key = "evolution.initial";
    let name = match initial {
        Initial::Random => return Ok(()),
        Initial::Linear => "linear",
        Initial::LinearHistory => "linear-history",
    };
    let needed = linear_ops(&policy_spec.shape, initial);
    if let Some(missing) = needed.into_iter().find(|op| !ops.contains(op)) {
        let why = format!(
            "needs the operation {}, which is in none of policy.groups",
            missing.mnemonic()
        );
        return Err(value(key, name, why));
    }
    if policy_spec.initial_values == InitialValues::Zero {
        let why = "needs policy.initial-values = \"evolved\"";
        return Err(value(key, name, why));
    }
    if initial == Initial::LinearHistory && policy_spec.register_mode == RegisterMode::Stateless {
        let why = "needs policy.register-mode = \"stateful\", to remember the last observation";
        return Err(value(key, name, why));
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
        return Err(value(key, &text, why));
    }
    if policy_spec.register_mode == RegisterMode::Stateless
        || policy_spec.initial_values == InitialValues::Zero
    {
        let why = "memory lies in registers that keep their values: it needs policy.register-mode = \"stateful\" and \
                   policy.initial-values = \"evolved\"";
        return Err(value(key, &text, why));
    }
    Ok(())
}

fn check_curriculum(config: &Config, policy_spec: &PolicySpec) -> Result<(), ConfigError> {
    let curriculum = &config.evaluation.curriculum;
    let blackout = |o: &String| o.starts_with("blackout");
    let (key, steps) = ("evaluation.curriculum.steps", curriculum.steps.to_string());
    if curriculum.steps == 0 {
        Ok(())
    } else if curriculum.stages == 0 {
        Err(value(
            "evaluation.curriculum.stages",
            "0",
            "must be at least 1",
        ))
    } else if policy_spec.shares_memory() {
        let why = "all agents are scored again at each stage, which none can be where agents share one memory";
        Err(value(key, &steps, why))
    } else if !config.observability.iter().any(blackout) {
        Err(value(
            key,
            &steps,
            "there is no blackout in observability to begin without",
        ))
    } else {
        Ok(())
    }
}

fn check_tuning(tuning: &TuningParams, policy_spec: &PolicySpec) -> Result<(), ConfigError> {
    if tuning.lineages == 0 {
        return Ok(());
    }
    if policy_spec.initial_values == InitialValues::Zero {
        let why = "there are no constants to tune with policy.initial-values = \"zero\"";
        return Err(value("tuning.lines", &tuning.lineages.to_string(), why));
    }
    let positive = [
        ("tuning.iterations", tuning.iterations),
        ("tuning.directions", tuning.directions),
        ("tuning.top", tuning.top),
        ("tuning.episodes", tuning.episodes),
        ("tuning.grow-to", tuning.grow_to),
    ];
    for (key, number) in positive {
        if number == 0 {
            return Err(value(key, "0", "must be at least 1"));
        }
    }
    for (key, number) in [("tuning.noise", tuning.noise), ("tuning.step", tuning.step)] {
        if !(number > 0.0 && number.is_finite()) {
            let why = "must be a positive number";
            return Err(value(key, &number.to_string(), why));
        }
    }
    if tuning.halve && tuning.one_after == 0 {
        let why =
            "needs tuning.one-after, the iterations in which lineages are halved until one is left";
        return Err(value("tuning.halve", "true", why));
    }
    if !(tuning.margin >= 0.0 && tuning.margin.is_finite()) {
        let why = "must be a number, at least 0";
        return Err(value("tuning.margin", &tuning.margin.to_string(), why));
    }
    if tuning.top > tuning.directions {
        let why = format!(
            "must not be above tuning.directions = {}",
            tuning.directions
        );
        return Err(value("tuning.top", &tuning.top.to_string(), why));
    }
    Ok(())
}

fn check_selection(selection: &SelectionParams) -> Result<(), ConfigError> {
    let positive = [
        ("selection.every", selection.every),
        ("selection.episodes", selection.episodes),
        ("selection.batch", selection.batch),
    ];
    for (key, number) in positive {
        if selection.candidates > 0 && number == 0 {
            return Err(value(key, "0", "must be at least 1"));
        }
    }
    Ok(())
}
