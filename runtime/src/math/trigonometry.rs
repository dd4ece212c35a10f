//! Sine, cosine, tangent, arc sine and arc cosine in single precision only.
//!
//! `libm` computes all of these except arc cosine in f64. This is twenty times slower on a single-precision FPU.
//!
//! Sine and cosine reduce arguments below 8192 in magnitude by π/2 in three parts (Cody and Waite). They then evaluate
//! the minimax polynomials of Cephes' `sinf`. For larger arguments they first take the remainder (`fmodf`) by the f32
//! nearest to 2π. There, this defines the result. It does not approximate the exact sine.
//!
//! The tests check the largest absolute error against the exact function. It is 1.0e-7 for sine and cosine where
//! |x| < 8192. On [−1, 1] it is 2.0e-7 for arc sine and 4.0e-7 for arc cosine.

use super::{finite, square_root};

const REDUCTION_LIMIT: f32 = 8192.0;
/// A little less than π/4. Arguments of smaller magnitude need no reduction, so the code skips it to save time.
const FIRST_QUADRANT: f32 = 0.78;
const TWO_PI: f32 = core::f32::consts::TAU;
/// π/2 in three parts. The first two have few bits, so that their products with a quadrant number are exact.
const HALF_PI_PARTS: [f32; 3] = [1.570_312_5, 4.837_513e-4, 7.549_79e-8];

/// Quadrant of `x` (not reduced modulo 4), and the remainder, about −π/4 to π/4. Requires |x| < 8192.
#[inline(always)]
fn reduce(x: f32) -> (i32, f32) {
    if x > -FIRST_QUADRANT && x < FIRST_QUADRANT {
        (0, x)
    } else {
        reduce_far(x)
    }
}

/// Does the same as [`reduce`], without its shortcut for small arguments.
#[inline(always)]
fn reduce_far(x: f32) -> (i32, f32) {
    let q = x * core::f32::consts::FRAC_2_PI;
    let quadrant = (q + 0.5f32.copysign(q)) as i32;
    let k = quadrant as f32;
    let [high, middle, low] = HALF_PI_PARTS;
    (quadrant, ((x - k * high) - k * middle) - k * low)
}

/// Sine of r for |r| ≤ π/4.
#[inline(always)]
fn sin_kernel(r: f32) -> f32 {
    let z = r * r;
    ((-1.951_529_6e-4 * z + 8.332_161e-3) * z - 1.666_665_5e-1) * z * r + r
}

/// Cosine of r for |r| ≤ π/4.
#[inline(always)]
fn cos_kernel(r: f32) -> f32 {
    let z = r * r;
    ((2.443_315_7e-5 * z - 1.388_731_6e-3) * z + 4.166_664_6e-2) * z * z - 0.5 * z + 1.0
}

/// Sine of `quadrant` · π/2 + `r`.
#[inline(always)]
fn sin_of(quadrant: i32, r: f32) -> f32 {
    let magnitude = if quadrant & 1 == 0 {
        sin_kernel(r)
    } else {
        cos_kernel(r)
    };
    f32::from_bits(magnitude.to_bits() ^ ((quadrant as u32 & 2) << 30))
}

#[inline(always)]
fn in_range(x: f32) -> f32 {
    if x > -REDUCTION_LIMIT && x < REDUCTION_LIMIT {
        x
    } else {
        remainder(x)
    }
}

/// The exact remainder of x divided by [`TWO_PI`], with the sign of x, the same as `fmodf`. NaN for a non-finite x.
///
/// `libm::fmodf` divides 64-bit integers. On targets without such an instruction, this takes a kilobyte of flash.
fn remainder(x: f32) -> f32 {
    const MANTISSA: u32 = 0x007f_ffff;
    const HIDDEN: u32 = MANTISSA + 1;
    const EXPONENT: u32 = TWO_PI.to_bits() >> 23;
    const DIVISOR: u32 = TWO_PI.to_bits() & MANTISSA | HIDDEN;
    /// The value of the last mantissa bit of a number with 2π's exponent: 2^(129 − 150).
    const UNIT: f32 = f32::from_bits((EXPONENT - 23) << 23);
    let exponent = x.to_bits() >> 23 & 0xff;
    if exponent == 0xff {
        return f32::NAN;
    }
    if exponent < EXPONENT {
        return x;
    }
    let mut left = x.to_bits() & MANTISSA | HIDDEN;
    for _ in EXPONENT..exponent {
        if left >= DIVISOR {
            left -= DIVISOR;
        }
        left <<= 1;
    }
    if left >= DIVISOR {
        left -= DIVISOR;
    }
    (left as f32 * UNIT).copysign(x)
}

/// Sine of an angle in radians. 0 for a non-finite angle.
#[must_use]
pub fn sin(x: f32) -> f32 {
    let (quadrant, r) = reduce(in_range(x));
    finite(sin_of(quadrant, r))
}

/// Cosine of an angle in radians. 0 for a non-finite angle.
#[must_use]
pub fn cos(x: f32) -> f32 {
    let (quadrant, r) = reduce(in_range(x));
    finite(sin_of(quadrant.wrapping_add(1), r))
}

/// Tangent of an angle in radians, computed as sine divided by cosine. 0 where it is undefined.
#[must_use]
pub fn tan(x: f32) -> f32 {
    finite(sin(x) / cos(x))
}

/// Arc sine in radians, computed as 2·atan(x / (1 + √((1 − x)·(1 + x)))). 0 outside [−1, 1].
#[must_use]
pub fn asin(x: f32) -> f32 {
    finite(2.0 * libm::atanf(x / (1.0 + square_root((1.0 - x) * (1.0 + x)))))
}

/// Arc cosine in radians, computed as π/2 − asin x. 0 outside [−1, 1].
#[must_use]
pub fn acos(x: f32) -> f32 {
    if (-1.0..=1.0).contains(&x) {
        core::f32::consts::FRAC_PI_2 - asin(x)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;

    /// Largest absolute error of `f` against `exact` on an evenly spaced grid over [−limit, limit].
    fn worst(limit: f32, f: impl Fn(f32) -> f32, exact: impl Fn(f64) -> f64) -> f64 {
        let n = 400_000;
        (-n..=n)
            .map(|i| limit * (i as f32 / n as f32))
            .map(|x| (f64::from(f(x)) - exact(f64::from(x))).abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn errors_stay_below_the_stated_bounds() {
        for limit in [3.2, 100.0, 8191.9] {
            let (s, c) = (worst(limit, sin, f64::sin), worst(limit, cos, f64::cos));
            std::println!("|x| <= {limit}: sine {s:.2e}, cosine {c:.2e}");
            assert!(s <= 1.0e-7 && c <= 1.0e-7, "sine {s:e}, cosine {c:e}");
        }
        let (s, c) = (worst(1.0, asin, f64::asin), worst(1.0, acos, f64::acos));
        std::println!("[-1, 1]: arc sine {s:.2e}, arc cosine {c:.2e}");
        assert!(
            s <= 2.0e-7 && c <= 4.0e-7,
            "arc sine {s:e}, arc cosine {c:e}"
        );
    }

    #[test]
    fn small_arguments_are_their_own_rest_in_every_bit() {
        let step = if cfg!(debug_assertions) { 97 } else { 1 };
        for bits in (0..FIRST_QUADRANT.to_bits()).step_by(step) {
            for x in [f32::from_bits(bits), -f32::from_bits(bits)] {
                let (quadrant, rest) = reduce_far(x);
                assert_eq!((quadrant, rest.to_bits()), (0, x.to_bits()), "{x:e}");
            }
        }
    }

    /// Compares all bits for every exponent of finite numbers, near multiples of 2π and far from them.
    #[test]
    fn the_remainder_is_that_of_fmodf() {
        for exponent in 0..255u32 {
            for k in 0..2000u32 {
                let mantissa = crate::rng::mix64(&[exponent.into(), k.into()]) as u32 >> 9;
                let multiple = (k as f32 * TWO_PI * f32::from_bits(exponent << 23)).to_bits();
                for bits in [exponent << 23 | mantissa, multiple, multiple + 1] {
                    for x in [f32::from_bits(bits), -f32::from_bits(bits)] {
                        let (ours, theirs) = (remainder(x), libm::fmodf(x, TWO_PI));
                        let same = ours.to_bits() == theirs.to_bits();
                        assert!(same || ours.is_nan() && theirs.is_nan(), "{x:e}");
                    }
                }
            }
        }
    }

    #[test]
    fn undefined_arguments_give_zero() {
        for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            for f in [sin, cos, tan, asin, acos] {
                assert_eq!(f(x).to_bits(), 0, "{x}");
            }
        }
        for x in [1.000_000_1, -2.0, f32::MAX] {
            assert_eq!((asin(x).to_bits(), acos(x).to_bits()), (0, 0), "{x}");
        }
    }
}
