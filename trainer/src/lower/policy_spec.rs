//! What a blob says apart from its graph, and the header that says it.

use std::sync::Arc;

use tpg_runtime::Header;
use tpg_runtime::blob::{InitialValues, MemoryModel, RegisterMode, ResetScope, WriteDistribution};
use tpg_runtime::isa::Operand;
use tpg_runtime::tables::{Range, Target};

use super::error::{LowerError, limit, small};
use super::liveness::{Graph, Kept};
use crate::evolve::{ResetRule, Shape};
use crate::front_end::LearnedFrontEnd;
use tpg_tasks::task::ActionSpace;

/// What a blob says apart from the graph.
#[derive(Debug, Clone, PartialEq)]
pub struct PolicySpec {
    /// Full name of the task.
    pub task: String,
    /// What the policy sees of it, in canonical form.
    pub observability: String,
    /// A line `name<TAB>unit` for each input, then for each continuous output.
    pub labels: String,
    /// The ranges of all inputs and continuous outputs as the file has them. Empty if there is nothing to say.
    pub ranges: Vec<[u8; Range::BYTES]>,
    /// Sizes shared with evolution.
    pub shape: Shape,
    /// Time between two decisions, in microseconds.
    pub control_period_us: u32,
    /// Whether registers outlive a decision.
    pub register_mode: RegisterMode,
    /// Where initial values come from.
    pub initial_values: InitialValues,
    /// When registers and memory are reset.
    pub reset_scope: ResetScope,
    /// What memory programs share.
    pub memory_model: MemoryModel,
    /// With what probabilities writes reach the slots or cells of memory.
    pub write_distribution: WriteDistribution,
    /// What happens to observations before programs see them.
    pub front_end: Option<Arc<LearnedFrontEnd>>,
}

impl PolicySpec {
    /// Whether all agents of a population share one memory.
    #[must_use]
    pub const fn shares_memory(&self) -> bool {
        matches!(
            self.reset_scope,
            ResetScope::Original | ResetScope::PerGeneration
        )
    }
}

/// The header of a policy. What depends on the layout of the tables is filled in later: words, streams, groups, front end and
/// provenance.
pub(super) fn header(
    policy_spec: &PolicySpec,
    graph: &Graph<'_>,
    kept: &Kept,
) -> Result<Header, LowerError> {
    let shape = &policy_spec.shape;
    let (actions, action_low, action_high) = match shape.actions {
        ActionSpace::Discrete(actions) => (actions, 0.0, 0.0),
        ActionSpace::Continuous { len, low, high } => (len, low, high),
    };
    let target_limit = usize::from(Target::MAX);
    limit("teams", graph.teams.len(), target_limit)?;
    let mut header = Header::default();
    header.programs = small("programs", graph.programs.len())?;
    header.teams = small("teams", graph.teams.len())?;
    header.width = shape.width;
    header.observation_len = shape.inputs;
    let (history, window) = window(shape, graph, kept);
    header.history = history;
    header.window = small("observation window", window)?;
    header.actions = actions;
    header.action_kind = shape.action_kind();
    header.register_mode = policy_spec.register_mode;
    header.initial_values = policy_spec.initial_values;
    header.reset_scope = reset_scope(policy_spec, graph);
    header.memory_model = policy_spec.memory_model;
    header.write_distribution = policy_spec.write_distribution;
    header.action_low = action_low;
    header.action_high = action_high;
    header.control_period_us = policy_spec.control_period_us;
    Ok(header)
}

/// The agent's own rule of resets, where agents evolve it.
fn reset_scope(policy_spec: &PolicySpec, graph: &Graph<'_>) -> ResetScope {
    let rule = graph.teams.first().and_then(|(_, root)| root.reset_rule);
    rule.map_or(policy_spec.reset_scope, ResetRule::scope)
}

/// How many observations the window holds, and its number of words. They are repeated cyclically, so that every operand that
/// reads them is a plain slice.
///
/// Observations before the earliest that anything reads are left out.
fn window(shape: &Shape, graph: &Graph<'_>, kept: &Kept) -> (u16, usize) {
    let width = usize::from(shape.width);
    let mut words = usize::from(shape.inputs);
    for ((_, program), code) in graph.programs.iter().zip(&kept.code) {
        let offset = usize::from(program.offset);
        for instruction in code {
            let kinds = instruction.op.operands();
            for (kind, source) in kinds.into_iter().zip([&instruction.a, &instruction.b]) {
                if !source.observed {
                    continue;
                }
                let read = match kind {
                    Operand::V => width,
                    Operand::M => width * width,
                    Operand::VElement | Operand::MElement => 1,
                    Operand::SOrVElement if source.of_vector => 1,
                    // Scalars of the observation are counted from its start.
                    Operand::S | Operand::SOrVElement => {
                        words = words.max(usize::from(source.element) + 1);
                        continue;
                    }
                    _ => continue,
                };
                words = words.max(offset + usize::from(source.element) + read);
            }
        }
    }
    let observed = usize::from(shape.observed());
    if words > observed {
        // Something reads the newest elements behind the earliest.
        return (shape.history, words);
    }
    let history = words.div_ceil(usize::from(shape.inputs).max(1)) as u16;
    (history, usize::from(history) * usize::from(shape.inputs))
}
