//! What every operation means: plain functions over numbers, and the only rule for non-finite results.
//!
//! Only this module and its children compute with floats; the lint `clippy::float_arithmetic` denies it elsewhere.
//! The order of operations is part of the definition: no fused multiply-add, no reassociation. So every target computes
//! the same bits.

#![expect(
    clippy::float_arithmetic,
    reason = "this is the one place for arithmetic"
)]

mod front_end;
mod trigonometry;

pub use front_end::{LIMIT, centred, changes, is_blank, predict, standardise};
pub use trigonometry::{acos, asin, cos, sin, tan};

/// The number rule of the standard set: a non-finite result becomes +0.
#[inline(always)]
#[must_use]
pub fn finite(x: f32) -> f32 {
    if x.is_finite() { x } else { 0.0 }
}

/// Whether code is shaped for a host, which predicts branches, or for a microcontroller, where each instruction costs.
pub(crate) const HOST: bool = cfg!(target_pointer_width = "64");

/// [`finite`] as a branch that is hardly ever taken: what follows need not wait for the comparison.
#[inline(always)]
fn canonicalize(x: f32) -> f32 {
    if x.is_finite() { x } else { undefined() }
}

#[cold]
const fn undefined() -> f32 {
    0.0
}

/// The number rule of the classic set, as PyTPG's `nan_to_num`: NaN becomes +0, infinities ±`f32::MAX`.
#[inline(always)]
#[must_use]
pub fn finite_classic(x: f32) -> f32 {
    if x.is_nan() {
        0.0
    } else if x == f32::INFINITY {
        f32::MAX
    } else if x == f32::NEG_INFINITY {
        f32::MIN
    } else {
        x
    }
}

/// Limits a finite `x` to `low..=high`.
#[inline(always)]
#[must_use]
pub fn clamp(x: f32, low: f32, high: f32) -> f32 {
    if x < low {
        low
    } else if x > high {
        high
    } else {
        x
    }
}

/// Defines operations under the number rule of the standard set, in forms for different loops that give the same bits.
macro_rules! operations {
    ($($(#[$doc:meta])* $name:ident |$($x:ident),+| $body:expr;)*) => {
        /// Operations before the number rule.
        mod raw {
            $(#[inline(always)] pub(super) fn $name($($x: f32),+) -> f32 { $body })*
        }

        /// Operations for the loop over scalar instructions.
        ///
        /// On a host they leave the number rule to the loop, which applies it in one place to whatever was computed.
        pub(crate) mod scalar {
            use super::{HOST, canonicalize, raw};
            pub(crate) use super::{abs, acos, asin, cond, cos, heaviside, max, min, sin, tan};

            $(#[inline(always)] pub(crate) fn $name($($x: f32),+) -> f32 {
                let result = raw::$name($($x),+);
                if HOST { result } else { canonicalize(result) }
            })*
        }

        /// Operations for the elements of vectors: without branches, so that several are computed at once.
        pub mod lanes {
            use super::{finite, raw};
            pub use super::{abs, heaviside, max, min};

            $($(#[$doc])* #[inline(always)] #[must_use] pub fn $name($($x: f32),+) -> f32 { finite(raw::$name($($x),+)) })*
        }

        $($(#[$doc])* #[inline(always)] #[must_use] pub fn $name($($x: f32),+) -> f32 { canonicalize(raw::$name($($x),+)) })*
    };
}

macro_rules! plain {
    ($($(#[$doc:meta])* $name:ident |$($x:ident),+| $body:expr;)*) => {
        $($(#[$doc])* #[inline(always)] #[must_use] pub fn $name($($x: f32),+) -> f32 { $body })*
    };
}

operations! {
    /// Sum.
    add |x, y| x + y;
    /// Difference.
    sub |x, y| x - y;
    /// Product.
    mul |x, y| x * y;
    /// Quotient; 0 for a zero divisor.
    div |x, y| x / y;
    /// Power.
    pow |x, y| libm::powf(x, y);
    /// Reciprocal; 0 for zero.
    recip |x| 1.0 / x;
    /// Square.
    sqr |x| x * x;
    /// Cube, as (x·x)·x.
    cube |x| (x * x) * x;
    /// Square root; 0 for negative numbers.
    sqrt |x| super::square_root(x);
    /// Arc tangent.
    atan |x| libm::atanf(x);
    /// Hyperbolic tangent.
    tanh |x| libm::tanhf(x);
    /// Exponential; 0 where it overflows.
    exp |x| libm::expf(x);
    /// Natural logarithm; 0 where it is undefined.
    log |x| libm::logf(x);
}

plain! {
    /// The smaller; the second of equals.
    min |x, y| if x < y { x } else { y };
    /// The larger; the second of equals.
    max |x, y| if x > y { x } else { y };
    /// Magnitude: the sign bit cleared.
    abs |x| x.abs();
    /// 1 for x ≥ 0 (−0 included), else 0.
    heaviside |x| if x >= 0.0 { 1.0 } else { 0.0 };
}

/// The conditional: `if old < x { -y } else { old }` (thesis Algorithm 2, line 13).
#[inline(always)]
#[must_use]
pub fn cond(old: f32, x: f32, y: f32) -> f32 {
    if old < x { -y } else { old }
}

/// The classic set (thesis §2.5.4, as PyTPG defines it): `x` is the destination, `y` the source.
pub mod classic {
    use super::finite_classic;

    plain! {
        /// x + y.
        add |x, y| finite_classic(x + y);
        /// x − y.
        sub |x, y| finite_classic(x - y);
        /// −x if x < y, else x.
        neg |x, y| if x < y { -x } else { x };
        /// log y if y > 0, else x.
        log |x, y| if y > 0.0 { finite_classic(libm::logf(y)) } else { x };
        /// 2·x.
        mult |x| finite_classic(x * 2.0);
        /// x / 2.
        div |x| finite_classic(x / 2.0);
        /// cos y.
        cos |y| finite_classic(super::cos(y));
        /// exp y.
        exp |y| finite_classic(libm::expf(y));
    }
}

/// Applies `f` to every element.
#[inline(always)]
#[must_use]
pub fn map<const W: usize>(x: &[f32; W], f: impl Fn(f32) -> f32) -> [f32; W] {
    let mut out = *x;
    for value in &mut out {
        *value = f(*value);
    }
    out
}

/// Applies `f` to every pair of elements.
#[inline(always)]
#[must_use]
pub fn zip<const W: usize>(x: &[f32; W], y: &[f32; W], f: impl Fn(f32, f32) -> f32) -> [f32; W] {
    let mut out = *x;
    for (value, y) in out.iter_mut().zip(y) {
        *value = f(*value, *y);
    }
    out
}

/// The correctly rounded square root; NaN for negative numbers.
#[inline(always)]
fn square_root(x: f32) -> f32 {
    libm::sqrtf(x)
}

/// Sum of `f` over the elements in four partial sums: element k goes into sum k mod 4, all start
/// from +0 and are joined as (p0 + p1) + (p2 + p3).
#[inline(always)]
fn sum(x: &[f32], f: impl Fn(f32) -> f32) -> f32 {
    let mut partial = [0.0f32; 4];
    let (quads, rest) = x.as_chunks::<4>();
    for quad in quads {
        for (p, x) in partial.iter_mut().zip(quad) {
            *p += f(*x);
        }
    }
    for (p, x) in partial.iter_mut().zip(rest) {
        *p += f(*x);
    }
    join(partial)
}

#[inline(always)]
fn join([p0, p1, p2, p3]: [f32; 4]) -> f32 {
    (p0 + p1) + (p2 + p3)
}

/// Inner product, in the order of [`norm`]'s sum.
#[inline(always)]
#[must_use]
pub fn dot<const W: usize>(x: &[f32; W], y: &[f32; W]) -> f32 {
    finite(sum(&zip(x, y, |x, y| x * y), |x| x))
}

/// Euclidean norm of a vector, Frobenius norm of a matrix given row by row.
#[inline(always)]
#[must_use]
pub fn norm(x: &[f32]) -> f32 {
    finite(square_root(sum(x, |x| x * x)))
}

/// Mean of the elements; 0 of none.
#[inline(always)]
#[must_use]
pub fn mean(x: &[f32]) -> f32 {
    finite(sum(x, |x| x) / x.len() as f32)
}

/// Population standard deviation in two passes; the mean of the first is subject to the number rule.
#[inline(always)]
#[must_use]
pub fn std(x: &[f32]) -> f32 {
    let m = mean(x);
    finite(square_root(sum(x, |x| (x - m) * (x - m)) / x.len() as f32))
}

/// Norm of every column.
#[inline(always)]
#[must_use]
pub fn column_norm<const W: usize>(rows: &[[f32; W]; W]) -> [f32; W] {
    let mut partial = [[0.0f32; W]; 4];
    for quad in rows.chunks(4) {
        for (p, row) in partial.iter_mut().zip(quad) {
            for (p, x) in p.iter_mut().zip(row) {
                *p += x * x;
            }
        }
    }
    let [p0, p1, p2, p3] = &partial;
    let mut out = [0.0; W];
    for ((((out, p0), p1), p2), p3) in out.iter_mut().zip(p0).zip(p1).zip(p2).zip(p3) {
        *out = finite(square_root(join([*p0, *p1, *p2, *p3])));
    }
    out
}

/// Matrix × vector: each element accumulates its row's products, k ascending from +0.
#[inline(always)]
#[must_use]
pub fn mat_vec<const W: usize>(rows: &[[f32; W]; W], x: &[f32; W]) -> [f32; W] {
    let mut out = [0.0; W];
    for (out, row) in out.iter_mut().zip(rows) {
        let mut sum = 0.0f32;
        for (a, b) in row.iter().zip(x) {
            sum += a * b;
        }
        *out = finite(sum);
    }
    out
}

/// Matrix × matrix: each element accumulates its products, k ascending from +0.
#[inline(always)]
#[must_use]
pub fn mat_mul<const W: usize>(x: &[[f32; W]; W], y: &[[f32; W]; W]) -> [[f32; W]; W] {
    x.each_ref().map(|row| row_mul(row, y))
}

/// A row of [`mat_mul`]'s result, from a row of its left factor.
#[inline(always)]
pub(crate) fn row_mul<const W: usize>(row: &[f32; W], y: &[[f32; W]; W]) -> [f32; W] {
    let mut out = [0.0; W];
    for (x, y) in row.iter().zip(y) {
        for (out, y) in out.iter_mut().zip(y) {
            *out += x * y;
        }
    }
    map(&out, finite)
}

/// Transpose.
#[inline(always)]
#[must_use]
pub fn transpose<const W: usize>(x: &[[f32; W]; W]) -> [[f32; W]; W] {
    let mut out = [[0.0; W]; W];
    for (r, row) in x.iter().enumerate() {
        for (out, x) in out.iter_mut().zip(row) {
            if let Some(cell) = out.get_mut(r) {
                *cell = *x;
            }
        }
    }
    out
}
