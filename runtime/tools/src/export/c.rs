//! A policy as a C module: a header and a source.

mod decide;
mod header;
mod memory;
mod perception;
mod program;

use std::collections::BTreeSet;
use std::fmt::{self, Write as _};

use tpg_runtime::Policy;
use tpg_runtime::isa::{Group, Op};
use tpg_runtime::tables::{Section, Team};

use super::plan::Plan;
use super::text::preamble;
use decide::write_decide;
use header::write_header;
use memory::{write_memories, write_memory_access, write_resets};
use perception::write_perceive;
use program::{arity, external, write_function, write_helper};

/// The two files of a C module.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CSource {
    /// Text of `name.h`.
    pub header: String,
    /// Text of `name.c`.
    pub source: String,
}

/// The policy as C11 without heap, whose types and functions begin with `name`.
///
/// It needs the functions `tpg_math_*` of the runtime's C library and nothing else. `command` is what the files' first
/// lines name as their origin.
#[must_use]
pub fn c(policy: &Policy<'_>, name: &str, command: &str) -> CSource {
    let plan = Plan::new(policy);
    let (mut header, mut source) = (String::new(), String::new());
    // Writing to a string cannot fail.
    let _ = write_header(&mut header, &plan, name, command);
    let _ = write_source(&mut source, &plan, name, command);
    CSource { header, source }
}

fn write_comment(out: &mut String, plan: &Plan<'_>, command: &str) -> fmt::Result {
    let mut start = "/*";
    for line in preamble(plan, command) {
        writeln!(
            out,
            "{}",
            format!("{start} {}", line.replace("*/", "* /")).trim_end()
        )?;
        start = " *";
    }
    writeln!(out, " */")
}

fn sections(team: &Team) -> impl Iterator<Item = Section> + use<'_> {
    Section::ALL
        .into_iter()
        .filter(|section| team.kept(*section) != 0)
}

fn signature(plan: &Plan<'_>, name: &str) -> String {
    let upper = name.to_uppercase();
    if plan.outputs > 0 {
        format!(
            "void {name}_decide({name} *self, const float observation[{upper}_INPUTS], float action[{upper}_OUTPUTS])"
        )
    } else {
        format!("uint16_t {name}_decide({name} *self, const float observation[{upper}_INPUTS])")
    }
}

const GUARDS: &str = "
/* Every operation is one rounding to single precision. Compile with -ffp-contract=off and without -ffast-math. */
#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__)
#error \"compile without -ffast-math: actions would differ from those that were scored\"
#endif
#if FLT_EVAL_METHOD != 0 && FLT_EVAL_METHOD != 16
#error \"this target computes floats in another precision (on x86 use -msse2 -mfpmath=sse)\"
#endif
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC optimize(\"fp-contract=off\")
#endif
";

fn write_source(out: &mut String, plan: &Plan<'_>, name: &str, command: &str) -> fmt::Result {
    write_comment(out, plan, command)?;
    writeln!(
        out,
        "#include \"{name}.h\"\n\n#include <float.h>\n#include <stdbool.h>"
    )?;
    out.push_str(GUARDS);
    let functions = plan.functions();
    let used: BTreeSet<Op> = functions
        .iter()
        .flat_map(|f| plan.code(f.program))
        .map(|i| i.op)
        .collect();
    let group = |group| used.iter().any(|op| op.group() == group);
    let is_wide = functions
        .iter()
        .any(|f| plan.program(f.program).registers[1..] != [0, 0])
        || plan.remembering().next().is_some()
        || plan.outputs > 0
        || group(Group::Vector)
        || group(Group::Matrix);
    writeln!(out, "\nenum {{ W = {} }};", plan.width)?;
    let mut externals: BTreeSet<String> = used
        .iter()
        .filter_map(|op| external(*op).map(|f| declaration(&f, arity(*op))))
        .collect();
    if is_wide {
        externals.insert(declaration("tpg_math_sqrt", 1));
    }
    if !externals.is_empty() {
        writeln!(out, "\n/* From the runtime's C library. */")?;
        externals
            .iter()
            .try_for_each(|line| writeln!(out, "{line}"))?;
    }
    writeln!(out)?;
    out.push_str(include_str!("c/assets/arithmetic.c"));
    if is_wide {
        out.push_str(include_str!("c/assets/wide.c"));
    }
    if group(Group::Matrix) {
        out.push_str(include_str!("c/assets/matrix.c"));
    }
    used.iter().try_for_each(|op| write_helper(out, *op))?;
    write_memories(out, plan, name)?;
    for function in functions {
        write_function(out, plan, name, function)?;
    }
    write_resets(out, plan, name)?;
    write_perceive(out, plan, name)?;
    write_decide(out, plan, name)?;
    if plan.memory_words() > 0 {
        write_memory_access(out, plan, name)?;
    }
    Ok(())
}

fn declaration(function: &str, arity: usize) -> String {
    let parameters = if arity == 2 {
        "float x, float y"
    } else {
        "float x"
    };
    format!("extern float {function}({parameters});")
}
