//! How much stack a decision takes, told from what the text declares.

use tpg_runtime::front_end::{Fallback, action_variables};
use tpg_runtime::isa::{Form, Op};
use tpg_runtime::tables::Section;

use super::super::plan::{Function, Plan};
use super::super::values::Register;
use super::program::C;

/// Room for saved registers, spilled numbers and the library's functions, in bytes.
const AROUND: usize = 256;

/// The bytes of stack that a decision takes: all variables of `decide` and of the function that declares most, and
/// [`AROUND`]. Compilers keep many of them in registers, so they take less unless they are told not to optimise.
pub(super) fn stack_bytes(c: &C<'_, '_>) -> usize {
    let plan = c.plan;
    let functions = plan.functions();
    let programs = functions.iter().map(|function| program_words(c, *function));
    let called = programs.chain([perceive_words(plan)]).max().unwrap_or(0);
    (4 * (decide_words(plan) + called) + AROUND).next_multiple_of(8)
}

/// The words that `decide` declares, with the outputs of the team whose programs have most.
fn decide_words(plan: &Plan<'_>) -> usize {
    let outputs = |program: u16| if plan.acts(program) { plan.values() } else { 0 };
    let cached = plan.cached.iter().map(|program| 2 + outputs(*program));
    let own = plan.reached().map(|(_, team)| {
        let programs = team.members.iter().map(|member| member.program);
        let alone = programs.filter(|program| !plan.cached.contains(program));
        alone.map(outputs).sum::<usize>()
    });
    let best = if plan.each { 2 * plan.outputs } else { 0 };
    let teams = plan.marked.len() + own.max().unwrap_or(0);
    plan.window + plan.outputs + best + cached.sum::<usize>() + teams
}

/// The words that a program's function declares, and those of the greatest operation in it.
fn program_words(c: &C<'_, '_>, function: Function) -> usize {
    let plan = c.plan;
    let kept = c.kept().get(&function.program);
    let is_kept = |register: &Register| {
        let mut kept = kept.into_iter().flatten();
        kept.any(|r| (r.section, r.number) == (register.section, register.number))
    };
    let mut registers = plan.mentioned(function);
    registers.retain(|r| r.section == Section::Scalar || (r.written && !is_kept(r)));
    let words: usize = registers.iter().map(|r| r.values.len()).sum();
    let beside = plan
        .code(function.program)
        .map(|i| beside(i.op, plan.width));
    words + beside.max().unwrap_or(0)
}

/// The words of a result that is made beside its place.
fn beside(op: Op, width: usize) -> usize {
    match (op.form(), op.destination().section()) {
        (Form::Whole, Some(Section::Matrix)) => width * width,
        (Form::Whole, _) => width,
        (Form::WriteCells, _) => 8,
        _ => 0,
    }
}

/// The words of the variables and sums of a front end's model.
fn perceive_words(plan: &Plan<'_>) -> usize {
    let front_end = plan.policy.front_end();
    let model = front_end.filter(|front_end| front_end.fallback == Fallback::Model);
    model.map_or(0, |model| {
        2 * model.columns.len() + action_variables(plan.policy.header())
    })
}
