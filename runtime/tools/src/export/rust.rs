//! A policy as a Rust module.

mod decide;
mod perception;
mod program;
mod state;

use std::fmt::{self, Write as _};

use tpg_runtime::Policy;

use super::plan::Plan;
use super::program::write_function;
use super::text::preamble;
use perception::write_perception;
use program::{Rust, write_helper};
use state::{write_policy, write_state};

/// Returns the policy as the text of a Rust module. The module depends only on `tpg-runtime`. It uses no `std`, no heap
/// and no `unsafe`, and does not panic.
///
/// The module's first lines name `command` as its origin.
#[must_use]
pub fn rust(policy: &Policy<'_>, command: &str) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write_module(&mut text, &Plan::new(policy), command);
    text
}

fn write_module(out: &mut String, plan: &Plan<'_>, command: &str) -> fmt::Result {
    for line in preamble(plan, command) {
        writeln!(out, "{}", format!("//! {line}").trim_end())?;
    }
    out.push_str("#![allow(unused, clippy::all, clippy::pedantic)]\n\n");
    writeln!(
        out,
        "use tpg_runtime::memory::{{IndexedStream, WriteDistribution, draw_slot, slot_stream}};"
    )?;
    writeln!(
        out,
        "use tpg_runtime::rng::Pcg32;\nuse tpg_runtime::tables::Section;\nuse tpg_runtime::{{Reset, math}};\n"
    )?;
    let header = plan.policy.header();
    if plan.memory_words() > 0 {
        writeln!(
            out,
            "const WRITES: WriteDistribution = WriteDistribution::{:?};\n",
            header.write_distribution
        )?;
    }
    writeln!(
        out,
        "/// Length of an observation.\npub const INPUTS: usize = {};",
        plan.inputs
    )?;
    writeln!(out, "/// Time between two decisions, in microseconds.")?;
    writeln!(
        out,
        "pub const CONTROL_PERIOD_US: u32 = {};",
        header.control_period_us
    )?;
    writeln!(
        out,
        "/// Words of shared memory.\npub const MEMORY: usize = {};",
        plan.memory_words()
    )?;
    if plan.outputs > 0 {
        writeln!(
            out,
            "/// One value for each output, within the limits.\npub type Action = [f32; {}];",
            plan.outputs
        )?;
        let output = if plan.each { "[f32; 1]" } else { "Action" };
        writeln!(out, "type Output = {output};")?;
    } else {
        writeln!(
            out,
            "/// Index of one of {} actions.\npub type Action = u16;",
            header.actions
        )?;
    }
    writeln!(out, "\nconst W: usize = {};", plan.width)?;
    out.push_str("type Vector = [f32; W];\ntype Matrix = [Vector; W];\n");
    writeln!(out, "type Window = [f32; {}];", plan.window)?;
    out.push_str(DECISION);
    write_perception(out, plan)?;
    write_state(out, plan)?;
    write_policy(out, plan)?;
    for function in plan.functions() {
        write_function(out, plan, &Rust(plan), function);
    }
    out.push_str(HELPERS);
    for op in plan.operations() {
        write_helper(out, op)?;
    }
    Ok(())
}

const DECISION: &str = "
/// One decision: the action and how it came about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decision {
    /// What the plant is to do.
    pub action: Action,
    /// Number of the program that won at the last team.
    pub winner: u16,
    /// Instructions executed.
    pub instructions: u32,
    /// Teams visited.
    pub teams: u16,
}
";

/// Functions that read vectors and matrices of the observation, and functions that work row by row.
const HELPERS: &str = "
#[inline(always)]
fn vector(x: &Window, at: usize) -> Vector {
    x.get(at..).and_then(|x| x.first_chunk()).copied().unwrap_or([0.0; W])
}

#[inline(always)]
fn matrix(x: &Window, at: usize) -> Matrix {
    let rows = x.get(at..).map(|x| x.as_chunks().0).unwrap_or_default();
    rows.first_chunk().copied().unwrap_or([[0.0; W]; W])
}

#[inline(always)]
fn each_row(x: &Matrix, f: impl Fn(&Vector) -> Vector) -> Matrix {
    let mut out = *x;
    for row in &mut out {
        *row = f(row);
    }
    out
}

#[inline(always)]
fn fill_rows(x: &Vector, f: impl Fn(f32) -> Vector) -> Matrix {
    let mut out = [[0.0; W]; W];
    for (row, x) in out.iter_mut().zip(x) {
        *row = f(*x);
    }
    out
}
";
