//! A policy as a C module: a header and a source.

mod decide;
mod header;
mod library;
mod memory;
mod perception;
mod program;
mod stack;
mod text;

use std::fmt::{self, Write as _};

use tpg_runtime::Policy;

use super::plan::Plan;
use super::program::write_function;
use decide::write_decide;
use header::write_header;
use library::{Snippet, used};
use memory::{memory_functions, reset_functions, write_memory_access, write_resets};
use perception::perceive;
pub(super) use program::number_text;
use program::{C, helper};
use text::comment;

/// The two files of a C module.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CSource {
    /// Text of `name.h`.
    pub header: String,
    /// Text of `name.c`.
    pub source: String,
}

/// Returns the policy as C code. The code uses no heap, and is valid C99 and C++17. The names of its types and
/// functions begin with `name`.
///
/// The code needs no library: what it calls is in it. The first lines of the files name `command` as their origin.
#[must_use]
pub fn c(policy: &Policy<'_>, name: &str, command: &str) -> CSource {
    let plan = Plan::new(policy);
    let (mut header, mut source) = (String::new(), String::new());
    // Writing to a string cannot fail.
    let _ = write_header(&mut header, &plan, name, command);
    let _ = write_source(&mut source, &plan, name, command);
    CSource { header, source }
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

#if defined(__cplusplus)
#define TPG_RESTRICT __restrict
#else
#define TPG_RESTRICT restrict
#endif
";

fn write_source(out: &mut String, plan: &Plan<'_>, name: &str, command: &str) -> fmt::Result {
    let c = C::new(plan, name);
    let mut body = String::new();
    write_resets(&mut body, &c)?;
    write_decide(&mut body, &c)?;
    if plan.memory_words() > 0 {
        write_memory_access(&mut body, &c)?;
    }
    let operations = plan.operations();
    let mut library: Vec<Snippet> = [
        include_str!("c/assets/arithmetic.c"),
        include_str!("c/assets/root.c"),
        include_str!("c/assets/trigonometry.c"),
        include_str!("c/assets/transcendental.c"),
        include_str!("c/assets/vector.c"),
        include_str!("c/assets/matrix.c"),
    ]
    .into_iter()
    .flat_map(Snippet::split)
    .collect();
    library.extend(
        operations
            .iter()
            .filter_map(|op| helper(*op))
            .map(Snippet::new),
    );
    library.extend(memory_functions(&c));
    for function in plan.functions() {
        let mut text = String::new();
        write_function(&mut text, plan, &c, function);
        library.push(Snippet::new(text));
    }
    library.extend(reset_functions(&c));
    library.extend(perceive(plan, name)?);
    out.push_str(&comment(plan, command, &[]));
    write!(
        out,
        "#include \"{name}.h\"\n\n#include <float.h>\n#include <stdbool.h>\n{GUARDS}\nenum {{ W = {} }};\n",
        plan.width
    )?;
    out.push_str(&used(library, &body));
    out.push_str(&body);
    Ok(())
}
