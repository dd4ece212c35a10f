//! Defines every operation as a function over numbers, and the rules for non-finite results.
//!
//! Only this module and its children compute with floats at run time. The lint `clippy::float_arithmetic` denies it
//! elsewhere. Tests are exempt, and so is one table that the compiler computes.
//!
//! The order of operations is part of each definition. There is no fused multiply-add and no reassociation, so every
//! target computes the same bits.

#![expect(
    clippy::float_arithmetic,
    reason = "this is the one place for arithmetic"
)]

mod front_end;
#[cfg(feature = "trace")]
pub mod health;
#[cfg(feature = "lanes")]
mod lock_step;
mod trigonometry;
mod word;

pub use front_end::{LIMIT, centred, changes, is_blank, predict, residual, standardise};
#[cfg(feature = "lanes")]
pub use lock_step::{LaneMask, Lanes};
pub use trigonometry::{acos, asin, cos, sin, tan};
pub use word::{Mask, Word};

/// The number rule of the standard set: replaces a non-finite result by +0.
#[inline(always)]
#[must_use]
pub fn finite(x: f32) -> f32 {
    if x.is_finite() { x } else { 0.0 }
}

/// Whether the code is built for a host.
///
/// A host predicts branches. On a microcontroller each instruction costs time. The two need different code.
pub(crate) const HOST: bool = cfg!(target_pointer_width = "64");

/// Gives the same result as [`finite`], by a branch that is rarely taken.
///
/// The instructions that follow do not have to wait for the comparison.
#[inline(always)]
fn canonicalize(x: f32) -> f32 {
    if x.is_finite() { x } else { undefined() }
}

#[cold]
const fn undefined() -> f32 {
    0.0
}

/// The number rule of the classic set, the same as PyTPG's `nan_to_num`: NaN becomes +0, ±∞ becomes ±`f32::MAX`.
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

/// Limits `x` to `low..=high`. `x` must be finite.
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

/// Defines the operations that follow the number rule of the standard set.
///
/// Each operation gets several forms for different loops. All forms give the same bits.
macro_rules! operations {
    ($($(#[$doc:meta])* $name:ident |$($x:ident),+| $body:expr;)*) => {
        /// Operations without the number rule.
        mod raw {
            $(#[inline(always)] pub(super) fn $name($($x: f32),+) -> f32 { $body })*
        }

        /// Operations for the loop over scalar instructions.
        ///
        /// On a host they apply the number rule by a selection, on a microcontroller by a branch that is rarely taken.
        pub(crate) mod scalar {
            use super::{HOST, canonicalize, finite, raw};
            pub(crate) use super::{
                abs, acos, asin, cond, cos, heaviside, latch, max, min, sin, tan,
            };

            $(#[inline(always)] pub(crate) fn $name($($x: f32),+) -> f32 {
                let result = raw::$name($($x),+);
                if HOST { finite(result) } else { canonicalize(result) }
            })*
        }

        /// Operations for the elements of vectors. They have no branches, so the compiler can compute several at once.
        pub mod lanes {
            use super::{finite, raw};
            pub use super::{abs, heaviside, max, min, same};

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
    /// Quotient. 0 for a zero divisor.
    div |x, y| x / y;
    /// `x` to the power of `y`. 0 where the result is undefined or overflows.
    pow |x, y| libm::powf(x, y);
    /// Reciprocal. 0 for zero.
    recip |x| 1.0 / x;
    /// Square.
    sqr |x| x * x;
    /// Cube, as (x·x)·x.
    cube |x| (x * x) * x;
    /// Square root. 0 for negative numbers.
    sqrt |x| super::square_root(x);
    /// Arc tangent in radians.
    atan |x| libm::atanf(x);
    /// Hyperbolic tangent.
    tanh |x| libm::tanhf(x);
    /// Exponential. 0 where it overflows.
    exp |x| libm::expf(x);
    /// Natural logarithm. 0 for zero and for negative numbers.
    log |x| libm::logf(x);
}

plain! {
    /// The smaller number. The second one if they are equal.
    min |x, y| if x < y { x } else { y };
    /// The larger number. The second one if they are equal.
    max |x, y| if x > y { x } else { y };
    /// Magnitude. Clears the sign bit.
    abs |x| x.abs();
    /// 1 for x ≥ 0, including −0. Otherwise 0.
    heaviside |x| if x >= 0.0 { 1.0 } else { 0.0 };
    /// The number itself.
    same |x| x;
}

/// Whether a latch lets its operand through. Neither +0 nor −0 does.
#[inline(always)]
#[must_use]
pub fn opens(x: f32) -> bool {
    x > 0.0
}

/// The latch: `y` if `x` [opens] it, else `old`.
#[inline(always)]
#[must_use]
pub fn latch(old: f32, x: f32, y: f32) -> f32 {
    if opens(x) { y } else { old }
}

/// The conditional (thesis Algorithm 2, line 13): `if old < x { -y } else { old }`.
#[inline(always)]
#[must_use]
pub fn cond(old: f32, x: f32, y: f32) -> f32 {
    if old < x { -y } else { old }
}

/// The classic set (thesis §2.5.4), as PyTPG defines it. `x` is the destination and `y` is the source.
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
pub fn map<T: Copy, const W: usize>(x: &[T; W], f: impl Fn(T) -> T) -> [T; W] {
    let mut out = *x;
    for value in &mut out {
        *value = f(*value);
    }
    out
}

/// Applies `f` to every pair of elements.
#[inline(always)]
#[must_use]
pub fn zip<T: Copy, const W: usize>(x: &[T; W], y: &[T; W], f: impl Fn(T, T) -> T) -> [T; W] {
    let mut out = *x;
    for (value, y) in out.iter_mut().zip(y) {
        *value = f(*value, *y);
    }
    out
}

/// The correctly rounded square root. NaN for negative numbers.
///
/// `libm`'s is inline assembly on some hosts, which compilers cannot turn into vectors. The standard library's has the same
/// bits for every argument.
#[inline(always)]
fn square_root(x: f32) -> f32 {
    #[cfg(feature = "std")]
    return x.sqrt();
    #[cfg(not(feature = "std"))]
    libm::sqrtf(x)
}

/// Sum of `f` over the elements, by four partial sums that start from +0.
///
/// Element k is added to partial sum k mod 4. The total is (p0 + p1) + (p2 + p3).
#[inline(always)]
fn sum<V: Word>(x: &[V], f: impl Fn(V) -> V) -> V {
    let mut partial = [V::ZERO; 4];
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
fn join<V: Word>([p0, p1, p2, p3]: [V; 4]) -> V {
    (p0 + p1) + (p2 + p3)
}

/// Inner product. The products are summed in the same order as the squares in [`norm`].
#[inline(always)]
#[must_use]
pub fn dot<V: Word, const W: usize>(x: &[V; W], y: &[V; W]) -> V {
    sum(&zip(x, y, |x, y| x * y), |x| x).map(finite)
}

/// Euclidean norm of a vector. For a matrix given row by row it is the Frobenius norm.
#[inline(always)]
#[must_use]
pub fn norm<V: Word>(x: &[V]) -> V {
    sum(x, |x| x * x).map(square_root).map(finite)
}

/// Mean of the elements. 0 if there are none.
#[inline(always)]
#[must_use]
pub fn mean<V: Word>(x: &[V]) -> V {
    (sum(x, |x| x) / V::splat(x.len() as f32)).map(finite)
}

/// Population standard deviation in two passes. The number rule also applies to the mean that the first pass computes.
#[inline(always)]
#[must_use]
pub fn std<V: Word>(x: &[V]) -> V {
    let m = mean(x);
    let variance = sum(x, |x| (x - m) * (x - m)) / V::splat(x.len() as f32);
    variance.map(square_root).map(finite)
}

/// Euclidean norm of every column. The squares are summed in the same order as in [`norm`].
#[inline(always)]
#[must_use]
pub fn column_norm<V: Word, const W: usize>(rows: &[[V; W]; W]) -> [V; W] {
    let mut partial = [[V::ZERO; W]; 4];
    for quad in rows.chunks(4) {
        for (p, row) in partial.iter_mut().zip(quad) {
            for (p, x) in p.iter_mut().zip(row) {
                *p += *x * *x;
            }
        }
    }
    let [p0, p1, p2, p3] = &partial;
    let mut out = [V::ZERO; W];
    for ((((out, p0), p1), p2), p3) in out.iter_mut().zip(p0).zip(p1).zip(p2).zip(p3) {
        *out = join([*p0, *p1, *p2, *p3]).map(square_root).map(finite);
    }
    out
}

/// Matrix × vector. For each element, the products are added in order of ascending index k, starting from +0.
#[inline(always)]
#[must_use]
pub fn mat_vec<V: Word, const W: usize>(rows: &[[V; W]; W], x: &[V; W]) -> [V; W] {
    let mut out = [V::ZERO; W];
    for (out, row) in out.iter_mut().zip(rows) {
        let mut sum = V::ZERO;
        for (a, b) in row.iter().zip(x) {
            sum += *a * *b;
        }
        *out = sum.map(finite);
    }
    out
}

/// Matrix × matrix. For each element, the products are added in order of ascending index k, starting from +0.
#[inline(always)]
#[must_use]
pub fn mat_mul<V: Word, const W: usize>(x: &[[V; W]; W], y: &[[V; W]; W]) -> [[V; W]; W] {
    x.each_ref().map(|row| row_mul(row, y))
}

/// One row of the result of [`mat_mul`]. `row` is the same row of the left factor.
#[inline(always)]
pub(crate) fn row_mul<V: Word, const W: usize>(row: &[V; W], y: &[[V; W]; W]) -> [V; W] {
    let mut out = [V::ZERO; W];
    for (x, y) in row.iter().zip(y) {
        for (out, y) in out.iter_mut().zip(y) {
            *out += *x * *y;
        }
    }
    map(&out, |x| x.map(finite))
}

/// Transpose of a matrix.
#[inline(always)]
#[must_use]
pub fn transpose<V: Word, const W: usize>(x: &[[V; W]; W]) -> [[V; W]; W] {
    let mut out = [[V::ZERO; W]; W];
    for (r, row) in x.iter().enumerate() {
        for (out, x) in out.iter_mut().zip(row) {
            if let Some(cell) = out.get_mut(r) {
                *cell = *x;
            }
        }
    }
    out
}
