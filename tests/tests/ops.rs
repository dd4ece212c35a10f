//! Every operation computes what `docs/semantics.md` says, in every place that its operands may have.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use tpg_runtime::isa::{Destination, Extent, Op, Operand};
use tpg_tests::ops::{Outcome, parse};

#[test]
fn every_operation_computes_its_vectors() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden/ops");
    let mut counts: BTreeMap<Op, (usize, Outcome)> = BTreeMap::new();
    let mut faults = Vec::new();
    let entries = fs::read_dir(&folder).expect("golden/ops is there");
    for path in entries.map(|entry| entry.expect("entry").path()) {
        if path.extension().is_none_or(|extension| extension != "txt") {
            continue;
        }
        let name = path.file_name().unwrap_or_default().display().to_string();
        let text = fs::read_to_string(&path).expect("vectors are text");
        for vector in parse(&text).unwrap_or_else(|fault| panic!("{name}: {fault}")) {
            let (vectors, total) = counts.entry(vector.op).or_default();
            *vectors += 1;
            match vector.check() {
                Ok(outcome) => {
                    total.runs += outcome.runs;
                    total.worst = total.worst.max(outcome.worst);
                }
                Err(fault) => faults.push(format!("{name}: {fault}")),
            }
        }
    }
    for (op, (vectors, Outcome { runs, worst })) in &counts {
        let name = op.mnemonic();
        println!(
            "{name:18} {vectors:4} vectors, {runs:5} runs, at most {worst:.2} of the allowed error"
        );
    }
    let missing: Vec<&str> = Op::ALL
        .iter()
        .filter(|op| !counts.contains_key(op))
        .map(|op| op.mnemonic())
        .collect();
    assert!(missing.is_empty(), "no vector for {missing:?}");
    let shown = faults.iter().take(20).cloned().collect::<Vec<_>>();
    assert!(
        faults.is_empty(),
        "{} vectors failed:\n{}",
        faults.len(),
        shown.join("\n")
    );
}

/// A wrong expectation is noticed: the comparison is not vacuous.
#[test]
fn a_wrong_vector_fails() {
    for wrong in [
        "add a=3f800000 b=3f800000 -> 40000001",
        "max a=80000000 b=00000000 -> 80000000",
        "sin a=3f800000 -> 0.85 +- 1e-07",
        "v-add w=2 a=3f800000,3f800000 b=3f800000,3f800000 -> 40000000,40400000",
        "write-s w=1 seed=0 key=0 kept=ff,ff,ff -> slots 0,0,0,0,0,0,0,0",
        "mem-write seed=0 -> cells 1,2,3",
    ] {
        let vectors = parse(wrong).expect("well formed");
        let fault = vectors[0].check().expect_err(wrong);
        assert!(fault.starts_with("line 1, "), "{fault}");
    }
    for malformed in [
        "add a=1",
        "nop a=00000000 -> 00000000",
        "add a=x b=0 -> 0",
        "add a",
    ] {
        let fails = parse(malformed).map(|vectors| vectors.iter().all(|v| v.check().is_err()));
        assert!(fails.unwrap_or(true), "{malformed}");
    }
}

/// The row of an operation in the document's table, up to its result.
fn row(op: Op) -> (String, String) {
    let destination = match op.destination() {
        Destination::None => "–",
        Destination::S => "s",
        Destination::SUpdate => "s*",
        Destination::V => "v",
        Destination::VUpdate => "v*",
        Destination::M => "m",
        Destination::MUpdate => "m*",
    };
    let operands = op.operands().into_iter().filter_map(|kind| match kind {
        Operand::None => None,
        Operand::S => Some("s"),
        Operand::V => Some("v"),
        Operand::M => Some("m"),
        Operand::VElement => Some("v[i]"),
        Operand::MElement => Some("m[i]"),
        Operand::SOrVElement => Some("s or v[i]"),
        Operand::ScalarSlot | Operand::VectorSlot | Operand::MatrixSlot => Some("slot"),
        Operand::VectorIndex | Operand::MatrixIndex => Some("index"),
        Operand::Cell => Some("cell"),
    });
    let operands = operands.collect::<Vec<_>>().join(", ");
    let extent = match op.cost().extent {
        Extent::One => "",
        Extent::Width => "·W",
        Extent::Square => "·W²",
        Extent::Cube => "·W³",
        Extent::Cells => "·cells",
    };
    let (code, name, unit) = (op as u8, op.mnemonic(), op.cost().unit);
    let signature = format!("{destination} ← {operands}");
    let start = format!("| {code} | `{name}` | {} |", signature.trim_end());
    (start, format!("| {unit}{extent} |"))
}

/// `docs/semantics.md` lists every operation with its code, operands and cost.
#[test]
fn the_document_lists_every_operation() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/semantics.md");
    let text = fs::read_to_string(path).expect("docs/semantics.md is there");
    // Its code, then its mnemonic as code; other tables begin with numbers too.
    let is_operation = |line: &&str| {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        matches!(cells.as_slice(), ["", code, name, ..] if code.parse::<u8>().is_ok() && name.starts_with('`'))
    };
    let lines: Vec<&str> = text.lines().filter(is_operation).collect();
    assert_eq!(lines.len(), Op::ALL.len(), "rows of operations");
    for (op, line) in Op::ALL.iter().zip(lines) {
        let (start, end) = row(*op);
        assert!(
            line.starts_with(&start) && line.ends_with(&end),
            "the row reads\n{line}\nbut should begin and end\n{start} … {end}"
        );
    }
}

/// Hosts take square roots from the standard library, boards from `libm`.
#[test]
fn both_square_roots_have_the_same_bits_for_every_argument() {
    const PARTS: u32 = 8;
    let differ = |part: u32| {
        let arguments = (0..=u32::MAX / PARTS).map(|k| k * PARTS + part);
        let mut arguments = arguments.map(f32::from_bits);
        arguments.find(|x| {
            let (one, other) = (x.sqrt(), libm::sqrtf(*x));
            one.to_bits() != other.to_bits() && !(one.is_nan() && other.is_nan())
        })
    };
    std::thread::scope(|scope| {
        let parts: Vec<_> = (0..PARTS)
            .map(|part| scope.spawn(move || differ(part)))
            .collect();
        for part in parts {
            assert_eq!(part.join().expect("a thread"), None);
        }
    });
}
