//! Register arithmetic lives in one place: `runtime/src/math.rs` and its children.
//!
//! Clippy's `float_arithmetic`, denied in the runtime, knows types and is the stronger check; this one makes sure that it
//! stays on, and adds what it cannot see. By reading every source file as a syntax tree:
//!
//! 1. The word `libm` stands in code only in the runtime's maths and, for the host's own f64, in the trainer's tasks, statistics,
//!    fit of front ends and search.
//! 2. Other runtime files do no arithmetic on float literals, call no float function, and silence no lint about it.
//! 3. No function outside the runtime has three branches that each select an arithmetic operation (by `match`, `if`,
//!    a table of closures or functions, or its mnemonic) and compute: an arithmetic operator, a negation, or a function
//!    named like a mathematical one. Analyses and generators of code need to select or to compute, an interpreter does
//!    both; one or two branches are allowed, since a special case is no interpreter.

#[path = "single_interpreter/checker.rs"]
mod checker;
#[path = "single_interpreter/expressions.rs"]
mod expressions;
#[path = "single_interpreter/words.rs"]
mod words;

use std::fs;
use std::path::{Path, PathBuf};

use checker::check;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The Rust files below a folder of the repository, by their paths from its root.
fn sources(folder: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        let Ok(entries) = fs::read_dir(root().join(&folder)) else {
            continue;
        };
        for entry in entries.map(|entry| entry.expect("entry")) {
            let path = format!("{folder}/{}", entry.file_name().to_string_lossy());
            if entry.path().is_dir() && !path.ends_with("/target") {
                folders.push(path);
            } else if path.ends_with(".rs") {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

#[test]
fn register_arithmetic_has_one_place() {
    let mut faults = Vec::new();
    for folder in [
        "runtime/src",
        "runtime/c-api",
        "runtime/tools",
        "trainer",
        "sim-bridge",
        "tests/policies",
        "tests/src",
        "firmware-examples",
    ] {
        let files = sources(folder);
        assert!(
            folder == "firmware-examples" || !files.is_empty(),
            "{folder}: no sources"
        );
        for path in &files {
            let source = fs::read_to_string(root().join(path)).expect("source is text");
            faults.extend(check(path, &source));
        }
        println!("{folder}: {} files read", files.len());
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    let manifest = fs::read_to_string(root().join("Cargo.toml")).expect("manifest");
    let renamed = manifest.split_whitespace().collect::<String>();
    assert!(!renamed.contains("package=\"libm\""), "libm is renamed");
}

/// The check can fail: every planted fault is found, and what is allowed is not.
#[test]
fn planted_faults_are_found() {
    let planted = [
        (
            "runtime/src/exec.rs",
            "fn f(x: f32) -> f32 { libm::sqrtf(x) }",
            "`libm`",
        ),
        (
            "runtime/src/exec.rs",
            "use libm as m; fn f(x: f32) -> f32 { m::sqrtf(x) }",
            "`libm`",
        ),
        (
            "runtime/src/exec.rs",
            "macro_rules! m { ($x:expr) => { libm::sqrtf($x) } }",
            "`libm`",
        ),
        (
            "trainer/tasks/src/eval.rs",
            "fn f(x: f32) -> f32 { libm::expf(x) }",
            "`libm`",
        ),
        ("sim-bridge/src/lib.rs", "extern crate libm;", "`libm`"),
        (
            "runtime/src/exec.rs",
            "fn f(x: f32) -> f32 { x * 2.0 }",
            "float literal",
        ),
        (
            "runtime/src/exec.rs",
            "fn f(mut x: f32) { x += (-1.5); }",
            "float literal",
        ),
        (
            "runtime/src/exec.rs",
            "macro_rules! m { ($x:expr) => { $x * 0.5 } }",
            "float literal in a macro",
        ),
        (
            "runtime/src/agent.rs",
            "fn f(x: f32) -> f32 { x.sqrt() }",
            "float method `sqrt`",
        ),
        (
            "runtime/src/agent.rs",
            "fn f(x: f32) -> f32 { f32::max(x, x) }",
            "`f32::max`",
        ),
        (
            "runtime/src/memory.rs",
            "#[expect(clippy::float_arithmetic)] fn f() {}",
            "silenced",
        ),
        (
            "runtime/src/tables.rs",
            "#![allow(clippy::float_arithmetic)]",
            "silenced",
        ),
        (
            "runtime/src/lib.rs",
            "#![deny(clippy::panic)]",
            "not denied",
        ),
        (
            "trainer/src/fast.rs",
            "fn f(op: Op, a: f32, b: f32) -> f32 { match op { Op::Add => a + b, Op::Sub => a - b, Op::Mul => a * b, _ => 0.0 } }",
            "second interpreter",
        ),
        (
            "trainer/src/fast.rs",
            "fn f(op: Op, a: f32) -> f32 { match op { Sin => a.sin(), Cos => libm_cos(a).cos(), Exp => a.exp(), _ => a } }",
            "second interpreter",
        ),
        (
            "trainer/tasks/src/task/fast.rs",
            "fn f(op: Op, a: f32, b: f32) -> f32 { match op { Op::Add => math::add(a, b), Op::Sub => math::sub(a, b), \
             Op::Dot => math::dot(a, b), _ => a } }",
            "second interpreter",
        ),
        (
            "sim-bridge/src/fast.rs",
            "fn f(op: Op, a: f32) -> f32 { if op == Op::Add { a + a } else if op == Op::Sqr { a * a } \
             else if let Op::Abs = op { a.abs() } else { a } }",
            "second interpreter",
        ),
        (
            "firmware-examples/x/src/main.rs",
            "static T: [(Op, F); 3] = [(Op::Add, |a, b| a + b), (Op::Sub, |a, b| a - b), (Op::Min, f32::min)];",
            "second interpreter",
        ),
        (
            "trainer/src/fast.rs",
            "fn f(op: &str, a: f32) -> f32 { match op { \"add\" => a + a, \"sqr\" => a * a, \"cube\" => a * a * a, _ => a } }",
            "second interpreter",
        ),
        (
            "trainer/src/fast.rs",
            "impl T { fn f(&self, op: Op, a: f32) -> f32 { run!(match op { Op::Add => a + a, Op::Sqr => a * a, Op::Cube => a }) } }",
            "second interpreter",
        ),
        (
            "trainer/tasks/src/task/mujoco/custom/expression.rs",
            "use tpg_runtime::isa::Op; fn f(a: f64) -> f64 { a }",
            "formulas that know the runtime",
        ),
    ];
    for (path, source, expected) in planted {
        let faults = check(path, source);
        assert!(
            faults.iter().any(|fault| fault.contains(expected)),
            "{path}: {source}: {faults:?}"
        );
    }
    let allowed = [
        (
            "runtime/src/math.rs",
            "fn f(x: f32) -> f32 { libm::sqrtf(x) * 2.0 }",
        ),
        ("runtime/src/math/x.rs", "fn f(x: f32) -> f32 { x.sin() }"),
        (
            "trainer/tasks/src/task/x.rs",
            "fn f(x: f64) -> f64 { libm::sin(x) }",
        ),
        (
            "trainer/src/front_end/x.rs",
            "fn f(x: f64) -> f64 { libm::exp(x) }",
        ),
        (
            "runtime/src/exec.rs",
            "/// As `libm`. \nfn f(x: f32) -> f32 { panic!(\"libm 1.0 * 2\"); f32::from_bits(1) }",
        ),
        (
            "runtime/src/exec.rs",
            "#[cfg(test)] mod tests { fn f(x: f32) -> f32 { x * 2.0 } }",
        ),
        (
            "runtime/src/exec.rs",
            "fn f(n: usize) -> usize { n.max(1) * 2 + 1 }",
        ),
        (
            "trainer/src/x.rs",
            "fn reads(op: Op) -> usize { match op { Op::Cond => 1 + 1, Op::Add => 2, Op::Sub => 2, Op::Mul => 2, _ => 1 } }",
        ),
        (
            "trainer/src/x.rs",
            "fn linear(n: u16) -> Vec<I> { (0..n).map(|k| [i(Op::Mul, 1 + k), i(Op::Add, 2 * k), i(Op::Sub, k - 1)]).collect() }",
        ),
        (
            "trainer/src/x.rs",
            "fn commutes(op: Op) -> bool { matches!(op, Op::Add | Op::Mul | Op::Min | Op::Max) }",
        ),
    ];
    for (path, source) in allowed {
        assert_eq!(
            check(path, source),
            Vec::<String>::new(),
            "{path}: {source}"
        );
    }
}
