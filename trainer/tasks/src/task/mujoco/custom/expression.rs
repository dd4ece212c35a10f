//! Formulas of a task's file: numbers, sources in braces, operators and functions.
//!
//! A formula is compiled once to a list of operations on a stack; working it out allocates nothing. Functions are those of
//! the C library, as in MuJoCo and NumPy, and each operation rounds once, in the order in which the formula is written.

use super::measure::{Measure, Now};
use std::cmp::Ordering;

/// The most values that a formula may need at once.
const STACK: usize = 32;

type Unary = fn(f64) -> f64;
type Binary = fn(f64, f64) -> f64;

/// Functions of one value.
const UNARY: [(&str, Unary); 17] = [
    ("abs", f64::abs),
    ("sqrt", f64::sqrt),
    ("square", |x| x * x),
    ("exp", f64::exp),
    ("ln", f64::ln),
    ("sin", f64::sin),
    ("cos", f64::cos),
    ("tan", f64::tan),
    ("asin", f64::asin),
    ("acos", f64::acos),
    ("atan", f64::atan),
    ("tanh", f64::tanh),
    ("floor", f64::floor),
    ("ceil", f64::ceil),
    ("round", f64::round),
    ("sign", |x| if x == 0.0 { 0.0 } else { x.signum() }),
    // Rounded to single precision.
    ("f32", |x| f64::from(x as f32)),
];

/// Functions of two values or more.
const BINARY: [(&str, Binary); 3] = [("min", f64::min), ("max", f64::max), ("hypot", f64::hypot)];

/// Functions of a fixed number of values that are neither.
const OTHERS: [(&str, usize, Op); 4] = [
    ("atan2", 2, Op::Binary(f64::atan2)),
    ("if", 3, Op::If),
    ("clamp", 3, Op::Clamp),
    ("tolerance", 4, Op::Tolerance),
];

#[derive(Debug, Clone, Copy)]
enum Op {
    Number(f64),
    Measure(usize),
    Unary(Unary),
    Binary(Binary),
    If,
    Clamp,
    Tolerance,
}

/// A formula, ready to be worked out.
#[derive(Debug, Clone)]
pub(super) struct Expression {
    ops: Vec<Op>,
    measures: Vec<Measure>,
}

impl Expression {
    /// Reads a formula; `find` finds what stands in braces.
    pub(super) fn read(
        text: &str,
        find: &dyn Fn(&str) -> Result<Measure, String>,
    ) -> Result<Self, String> {
        let mut reader = Reader {
            text,
            rest: text,
            find,
            ops: Vec::new(),
            measures: Vec::new(),
            height: 0,
            depth: 0,
        };
        let read = reader.condition().and_then(|()| match reader.peek() {
            None => Ok(()),
            Some(_) => Err(reader.expected("an operator or the end")),
        });
        read.map_err(|why| format!("expression = {text:?}: {why}"))?;
        Ok(Self {
            ops: reader.ops,
            measures: reader.measures,
        })
    }

    /// Keeps what the formula needs of the state before a step.
    pub(super) fn begin(&mut self, now: Now<'_>) {
        for measure in &mut self.measures {
            measure.begin(now);
        }
    }

    /// Whether any value in braces satisfies this.
    pub(super) fn any(&self, test: impl Fn(&Measure) -> bool) -> bool {
        self.measures.iter().any(test)
    }

    /// Works the formula out.
    pub(super) fn value(&self, now: Now<'_>) -> f64 {
        let mut stack = [0.0; STACK];
        let mut top = 0;
        // Reading has checked that no operation reaches below the stack or above it.
        for op in &self.ops {
            let (taken, value) = match *op {
                Op::Number(value) => (0, value),
                Op::Measure(index) => (0, self.measures[index].value(now)),
                Op::Unary(f) => (1, f(stack[top - 1])),
                Op::Binary(f) => (2, f(stack[top - 2], stack[top - 1])),
                Op::If if stack[top - 3] == 0.0 => (3, stack[top - 1]),
                Op::If => (3, stack[top - 2]),
                Op::Clamp => (3, stack[top - 3].max(stack[top - 2]).min(stack[top - 1])),
                Op::Tolerance => {
                    let [x, low, high, margin] = [4, 3, 2, 1].map(|back| stack[top - back]);
                    (4, tolerance(x, low, high, margin))
                }
            };
            top -= taken;
            stack[top] = value;
            top += 1;
        }
        stack[0]
    }
}

/// 1 within the bounds, and a bell outside of them that has fallen to 0.1 at the margin.
fn tolerance(x: f64, low: f64, high: f64, margin: f64) -> f64 {
    /// The square of the distance, in margins, times this is the exponent: e to the minus this is 0.1.
    const STEEPNESS: f64 = std::f64::consts::LN_10;
    let outside = (low - x).max(x - high);
    if outside <= 0.0 {
        1.0
    } else if margin > 0.0 {
        let distance = outside / margin;
        (-STEEPNESS * distance * distance).exp()
    } else {
        0.0
    }
}

fn truth(holds: bool) -> f64 {
    f64::from(u8::from(holds))
}

struct Reader<'a> {
    text: &'a str,
    rest: &'a str,
    find: &'a dyn Fn(&str) -> Result<Measure, String>,
    ops: Vec<Op>,
    measures: Vec<Measure>,
    /// Values on the stack after the operations so far.
    height: usize,
    /// Levels of brackets, functions and signs around this place.
    depth: usize,
}

/// Operators of one rank, which join from the left.
type Rank = &'static [(&'static str, Binary)];

const OR: Rank = &[("||", |a, b| truth(a != 0.0 || b != 0.0))];
const AND: Rank = &[("&&", |a, b| truth(a != 0.0 && b != 0.0))];
const COMPARISON: Rank = &[
    ("<=", |a, b| truth(a <= b)),
    (">=", |a, b| truth(a >= b)),
    ("==", |a, b| {
        truth(a.partial_cmp(&b).is_some_and(Ordering::is_eq))
    }),
    ("!=", |a, b| {
        truth(a.partial_cmp(&b).is_some_and(Ordering::is_ne))
    }),
    ("<", |a, b| truth(a < b)),
    (">", |a, b| truth(a > b)),
];
const SUM: Rank = &[("+", |a, b| a + b), ("-", |a, b| a - b)];
const PRODUCT: Rank = &[("*", |a, b| a * b), ("/", |a, b| a / b)];

impl Reader<'_> {
    fn peek(&mut self) -> Option<char> {
        self.rest = self.rest.trim_start();
        self.rest.chars().next()
    }

    fn take(&mut self, token: &str) -> bool {
        self.rest = self.rest.trim_start();
        match self.rest.strip_prefix(token) {
            Some(rest) => {
                self.rest = rest;
                true
            }
            None => false,
        }
    }

    fn expected(&self, what: &str) -> String {
        let at = self.text.len() - self.rest.len();
        match self.rest.chars().next() {
            Some(found) => format!("at byte {at}: expected {what}, found {found:?}"),
            None => format!("at the end: expected {what}"),
        }
    }

    fn push(&mut self, op: Op, taken: usize) -> Result<(), String> {
        self.height = self.height + 1 - taken;
        if self.height > STACK {
            return Err(format!("it needs more than {STACK} values at once"));
        }
        self.ops.push(op);
        Ok(())
    }

    fn condition(&mut self) -> Result<(), String> {
        self.join(OR, |r| r.join(AND, |r| r.join(COMPARISON, Self::sum)))
    }

    fn sum(&mut self) -> Result<(), String> {
        self.join(SUM, |r| r.join(PRODUCT, Self::signed))
    }

    /// Reads operands that the operators of a rank join.
    fn join(
        &mut self,
        rank: Rank,
        operand: impl Fn(&mut Self) -> Result<(), String>,
    ) -> Result<(), String> {
        operand(self)?;
        while let Some(&(_, f)) = rank.iter().find(|(token, _)| self.take(token)) {
            operand(self)?;
            self.push(Op::Binary(f), 2)?;
        }
        Ok(())
    }

    /// A power with signs before it: `-x^2` is the opposite of the square.
    fn signed(&mut self) -> Result<(), String> {
        self.deeper(|r| {
            if r.take("-") {
                r.signed()?;
                return r.push(Op::Unary(|x| -x), 1);
            }
            if r.rest.starts_with('!') && !r.rest.starts_with("!=") && r.take("!") {
                r.signed()?;
                return r.push(Op::Unary(|x| truth(x == 0.0)), 1);
            }
            r.atom()?;
            if r.take("^") {
                r.signed()?;
                // C's `pow`, as NumPy's `**`; the black box keeps the compiler from turning a square into a product.
                r.push(Op::Binary(|a, b| a.powf(std::hint::black_box(b))), 2)?;
            }
            Ok(())
        })
    }

    /// Bounds how deep brackets may nest, so that no text overflows the stack of the reader.
    fn deeper(&mut self, read: impl FnOnce(&mut Self) -> Result<(), String>) -> Result<(), String> {
        const DEEPEST: usize = 64;
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(format!("it nests more than {DEEPEST} levels"));
        }
        read(self)?;
        self.depth -= 1;
        Ok(())
    }

    fn atom(&mut self) -> Result<(), String> {
        match self.peek() {
            Some('(') => {
                self.take("(");
                self.condition()?;
                self.close(")")
            }
            Some('{') => {
                let inner = self.rest[1..].split_once('}');
                let (name, rest) = inner.ok_or_else(|| self.expected("a } after the {"))?;
                self.rest = rest;
                let measure = (self.find)(name.trim())?;
                self.measures.push(measure);
                self.push(Op::Measure(self.measures.len() - 1), 0)
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_ascii_alphabetic() => self.function(),
            _ => Err(self.expected("a number, a {source}, a function or a bracket")),
        }
    }

    fn close(&mut self, token: &str) -> Result<(), String> {
        if self.take(token) {
            Ok(())
        } else {
            Err(self.expected(token))
        }
    }

    fn number(&mut self) -> Result<(), String> {
        let bytes = self.rest.as_bytes();
        let digits = |from: usize| {
            let more = bytes[from..].iter().take_while(|c| c.is_ascii_digit());
            from + more.count()
        };
        let mut end = digits(0);
        if bytes.get(end) == Some(&b'.') {
            end = digits(end + 1);
        }
        if matches!(bytes.get(end), Some(b'e' | b'E')) {
            let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
            end = digits(end + 1 + sign);
        }
        let (number, rest) = self.rest.split_at(end);
        let value: f64 = number
            .parse()
            .map_err(|_| format!("{number:?} is no number"))?;
        if !value.is_finite() {
            return Err(format!("{number} is too large"));
        }
        self.rest = rest;
        self.push(Op::Number(value), 0)
    }

    fn function(&mut self) -> Result<(), String> {
        let end = (self.rest.find(|c: char| !c.is_ascii_alphanumeric())).unwrap_or(self.rest.len());
        let (name, rest) = self.rest.split_at(end);
        self.rest = rest;
        if name == "pi" {
            return self.push(Op::Number(std::f64::consts::PI), 0);
        }
        if !self.take("(") {
            return Err(format!(
                "{name:?} is no function with brackets behind it; a value of the model stands in braces, as {{qpos:JOINT}}"
            ));
        }
        let mut count = 1;
        self.condition()?;
        while self.take(",") {
            self.condition()?;
            count += 1;
        }
        self.close(")")?;
        let wrong = |takes: &str| Err(format!("{name} takes {takes}, not {count}"));
        if let Some((_, f)) = UNARY.iter().find(|(known, _)| *known == name) {
            if count != 1 {
                return wrong("one value");
            }
            return self.push(Op::Unary(*f), 1);
        }
        if let Some((_, f)) = BINARY.iter().find(|(known, _)| *known == name) {
            if count < 2 {
                return wrong("two values or more");
            }
            // From the right, which makes no difference to these functions.
            for _ in 1..count {
                self.push(Op::Binary(*f), 2)?;
            }
            return Ok(());
        }
        match OTHERS.iter().find(|(known, _, _)| *known == name) {
            Some((_, takes, op)) if *takes == count => self.push(*op, count),
            Some((_, takes, _)) => wrong(&format!("{takes} values")),
            None => {
                let unary = UNARY.iter().map(|(name, _)| *name);
                let others = OTHERS.iter().map(|(name, _, _)| *name);
                let known: Vec<&str> = unary
                    .chain(BINARY.iter().map(|(name, _)| *name))
                    .chain(others)
                    .collect();
                Err(super::unknown("function", name, &known))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::source::Moment;
    use super::*;
    use crate::task::mujoco::sim::compile;
    use mujoco_rs::prelude::{MjData, MjModel};

    fn value(text: &str) -> Result<f64, String> {
        let model = compile(|| MjModel::from_xml_string("<mujoco/>")).unwrap();
        let data = MjData::new(model);
        let now = Now::at(Moment {
            data: &data,
            goals: &[],
        });
        let find = |name: &str| match name.parse() {
            Ok(number) => Ok(Measure::constant(number)),
            Err(_) => Err(format!("no {name}")),
        };
        Expression::read(text, &find).map(|expression| expression.value(now))
    }

    #[test]
    fn formulas_mean_what_mathematics_means() {
        for (text, expected) in [
            ("1 + 2 * 3", 7.0),
            ("(1 + 2) * 3", 9.0),
            ("-2^2", -4.0),
            ("2^-1", 0.5),
            ("2^3^2", 512.0),
            ("7 - 3 - 2", 2.0),
            ("8 / 4 / 2", 1.0),
            ("5e-1 + .5 + 1.", 2.0),
            ("-{-3}", 3.0),
            ("abs(-3) * sign(-2)", -3.0),
            ("max(1, min(5, 3), 2)", 3.0),
            ("min(4, max(1, 2))", 2.0),
            ("if({1} > 0 && 2 != 2, 10, 20)", 20.0),
            ("!(1 < 2) || 3 >= 3", 1.0),
            ("clamp(7, -1, 1)", 1.0),
            ("tolerance(0.5, 0, 1, 1)", 1.0),
            ("round(1e6 * tolerance(3, 0, 1, 2))", 1e5),
            ("hypot(3, 4)", 5.0),
            ("f32(0.1) == 0.1", 0.0),
            ("cos(pi)", -1.0_f64),
        ] {
            assert_eq!(value(text).unwrap().to_bits(), expected.to_bits(), "{text}");
        }
    }

    #[test]
    fn mistakes_say_where_they_are() {
        for (text, words) in [
            ("", "at the end: expected a number"),
            ("1 +", "at the end"),
            ("(1", "expected )"),
            ("1 2", "at byte 2: expected an operator"),
            ("{qpos", "a } after the {"),
            ("{nothing}", "no nothing"),
            ("sqr(1)", "did you mean \"sqrt\""),
            ("abs(1, 2)", "abs takes one value, not 2"),
            ("if(1)", "if takes 3 values, not 1"),
            ("max(1)", "max takes two values or more"),
            ("x + 1", "braces"),
            ("1e999", "too large"),
            ("1e", "no number"),
            ("é", "expected a number"),
        ] {
            let message = value(text).unwrap_err();
            assert!(message.contains(words), "{text:?}: {message}");
        }
        let nested = "(".repeat(10_000);
        assert!(value(&nested).unwrap_err().contains("nests"));
        let wide = format!("{}1{}", "1 + (".repeat(40), ")".repeat(40));
        assert!(value(&wide).unwrap_err().contains("at once"));
    }
}
