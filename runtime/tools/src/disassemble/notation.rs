//! Instructions as mathematics writes them.

use tpg_runtime::isa::Op;
use tpg_runtime::tables::Instruction;

use super::names::Names;

/// An instruction as a line of mathematics: `·` multiplies, `⊙` and `⊘` multiply and divide element by element, `⟨a, b⟩` is the
/// product of two vectors that gives a scalar, `H` is 1 from zero on and 0 below.
pub(super) fn notation(instruction: &Instruction, names: &Names<'_>) -> String {
    let Instruction { op, d, a, b } = *instruction;
    let [kind_a, kind_b] = Op::operands(op);
    mathematics(op)
        .replace("{d}", &names.destination(op.destination(), d))
        .replace("{a}", &names.operand(kind_a, a))
        .replace("{b}", &names.operand(kind_b, b))
}

/// The form in which an operation is read, with the places of [`Op::notation`].
const fn mathematics(op: Op) -> &'static str {
    match op {
        Op::Mul | Op::VScale | Op::MScale | Op::MatVec | Op::MatMul => "{d} = {a} · {b}",
        Op::VMul | Op::MMul => "{d} = {a} ⊙ {b}",
        Op::VDiv | Op::MDiv => "{d} = {a} ⊘ {b}",
        Op::VRecip | Op::MRecip => "{d} = 1 ⊘ {a}",
        Op::Dot => "{d} = ⟨{a}, {b}⟩",
        Op::Outer => "{d} = {a} ⊗ {b}",
        Op::Transpose => "{d} = {a}ᵀ",
        Op::Pow => "{d} = {a}^{b}",
        Op::Sqr => "{d} = {a}²",
        Op::Cube => "{d} = {a}³",
        Op::Sqrt => "{d} = √{a}",
        Op::Abs | Op::VAbs | Op::MAbs => "{d} = |{a}|",
        Op::VNorm | Op::MNorm => "{d} = ‖{a}‖",
        Op::Heaviside | Op::VHeaviside | Op::MHeaviside => "{d} = H({a})",
        Op::ClassicMult => "{d} = 2 · {d}",
        other => other.notation(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_names_what_the_table_names() {
        for op in Op::ALL {
            for place in ["{d}", "{a}", "{b}"] {
                let (read, table) = (mathematics(*op), op.notation());
                assert_eq!(read.contains(place), table.contains(place), "{op:?}");
            }
        }
    }
}
