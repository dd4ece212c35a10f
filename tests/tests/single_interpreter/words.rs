//! Names and words: what computes, by how it is spelt.

use tpg_runtime::isa::{Group, Op};

/// Functions of floats whose names mean nothing else.
pub const FLOAT_FUNCTIONS: &[&str] = &[
    "sqrt",
    "cbrt",
    "hypot",
    "powf",
    "powi",
    "sin",
    "cos",
    "tan",
    "sin_cos",
    "asin",
    "acos",
    "atan",
    "atan2",
    "sinh",
    "cosh",
    "tanh",
    "exp",
    "exp2",
    "exp_m1",
    "ln",
    "ln_1p",
    "log10",
    "log2",
    "mul_add",
    "recip",
    "fract",
    "to_degrees",
    "to_radians",
    "sqrtf",
    "expf",
    "logf",
    "sinf",
    "cosf",
    "tanf",
    "tanhf",
    "atanf",
    "fmodf",
];
/// What may follow `f32::` or `f64::`: conversions of bits, constants and tests.
pub const FLOAT_PATHS: &[&str] = &[
    "from_bits",
    "from_le_bytes",
    "from",
    "to_bits",
    "to_le_bytes",
    "is_finite",
    "is_nan",
    "MAX",
    "MIN",
    "NAN",
    "INFINITY",
    "NEG_INFINITY",
    "EPSILON",
];
/// Names of computing functions that integers have too.
const SHARED_FUNCTIONS: &[&str] = &["abs", "min", "max", "pow", "clamp", "log", "neg", "rem"];

/// Whether `name` is an operation that computes, as the enum or as the configuration names it.
pub fn is_operation(name: &str) -> bool {
    let groups = [Group::Scalar, Group::Vector, Group::Matrix, Group::Classic];
    Op::ALL
        .iter()
        .filter(|op| groups.contains(&op.group()))
        .any(|op| op.mnemonic() == name || format!("{op:?}") == name)
}

pub fn is_computing_function(name: &str) -> bool {
    let mnemonic = name.replace('_', "-");
    let lower = name.starts_with(|c: char| c.is_ascii_lowercase());
    lower
        && (FLOAT_FUNCTIONS.contains(&name)
            || SHARED_FUNCTIONS.contains(&name)
            || is_operation(&mnemonic))
}

/// The words of a macro's tokens, without the contents of strings.
pub fn macro_words(tokens: &str) -> Vec<String> {
    let (mut words, mut word, mut in_string, mut escaped) =
        (Vec::new(), String::new(), false, false);
    for c in tokens.chars() {
        if in_string {
            in_string = escaped || c != '"';
            escaped = !escaped && c == '\\';
            continue;
        }
        in_string = c == '"';
        let name = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
        let joins = word
            .chars()
            .last()
            .is_some_and(|last| name(last) == name(c))
            && !"()[]{},;\"".contains(c);
        if !joins || c.is_whitespace() {
            words.push(std::mem::take(&mut word));
        }
        if !c.is_whitespace() && c != '"' {
            word.push(c);
        }
    }
    words.push(word);
    words.retain(|word| !word.is_empty());
    words
}

pub fn is_float_word(word: &str) -> bool {
    word.starts_with(|c: char| c.is_ascii_digit())
        && (word.ends_with("f32") || word.ends_with("f64") || word.contains('.'))
        && !word.starts_with("0x")
        && !word.contains("..")
}

pub fn is_operator_word(word: &str) -> bool {
    ["+", "-", "*", "/", "%", "+=", "-=", "*=", "/=", "%="].contains(&word)
}
