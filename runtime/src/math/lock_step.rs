//! Words and masks of several agents.

use core::ops::{Add, AddAssign, Div, Mul, Sub};

use super::word::{Mask, Word};

/// One number of each of `L` agents.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lanes<const L: usize>(pub [f32; L]);

/// A choice among `L` lanes: all bits of those that are chosen, so that compilers select by bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LaneMask<const L: usize>([u32; L]);

/// All bits if `chosen`.
#[inline(always)]
const fn bits(chosen: bool) -> u32 {
    if chosen { u32::MAX } else { 0 }
}

impl<const L: usize> Word for Lanes<L> {
    const LANES: usize = L;
    const ZERO: Self = Lanes([0.0; L]);
    type Mask = LaneMask<L>;

    #[inline(always)]
    fn zeros<'z, const W: usize>() -> &'z [Self; W] {
        &[Lanes([0.0; L]); W]
    }

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Lanes([x; L])
    }

    #[inline(always)]
    fn map(self, f: impl Fn(f32) -> f32) -> Self {
        Lanes(super::map(&self.0, f))
    }

    #[inline(always)]
    fn zip(self, y: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Lanes(super::zip(&self.0, &y.0, f))
    }

    #[inline(always)]
    fn map_in(self, mask: LaneMask<L>, f: impl Fn(f32) -> f32) -> Self {
        self.zip_in(mask, self, |x, _| f(x))
    }

    #[inline(always)]
    fn zip_in(self, mask: LaneMask<L>, y: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        let mut out = self;
        for ((out, y), mask) in out.0.iter_mut().zip(y.0).zip(mask.0) {
            if mask != 0 {
                *out = f(*out, y);
            }
        }
        out
    }

    #[inline(always)]
    fn zip3(self, x: Self, y: Self, f: impl Fn(f32, f32, f32) -> f32) -> Self {
        let mut out = self;
        for ((out, x), y) in out.0.iter_mut().zip(x.0).zip(y.0) {
            *out = f(*out, x, y);
        }
        out
    }

    #[inline(always)]
    fn test(self, f: impl Fn(f32) -> bool) -> LaneMask<L> {
        LaneMask(self.0.map(|x| bits(f(x))))
    }

    #[inline(always)]
    fn test2(self, y: Self, f: impl Fn(f32, f32) -> bool) -> LaneMask<L> {
        let mut mask = [0; L];
        for ((mask, x), y) in mask.iter_mut().zip(self.0).zip(y.0) {
            *mask = bits(f(x, y));
        }
        LaneMask(mask)
    }

    #[inline(always)]
    fn select(self, mask: LaneMask<L>, other: Self) -> Self {
        let mut out = self;
        for ((out, mask), other) in out.0.iter_mut().zip(mask.0).zip(other.0) {
            *out = f32::from_bits((out.to_bits() & mask) | (other.to_bits() & !mask));
        }
        out
    }

    #[inline(always)]
    fn over(self, old: Self, running: LaneMask<L>) -> Self {
        self.select(running, old)
    }

    #[inline(always)]
    fn lane(self, lane: usize) -> f32 {
        self.0.get(lane).copied().unwrap_or(0.0)
    }
}

impl<const L: usize> Mask for LaneMask<L> {
    type Numbers = [u32; L];
    const NONE: Self = LaneMask([0; L]);
    const ALL: Self = LaneMask([u32::MAX; L]);

    #[inline(always)]
    fn of(f: impl Fn(usize) -> bool) -> Self {
        LaneMask(core::array::from_fn(|lane| bits(f(lane))))
    }

    #[inline(always)]
    fn has(self, lane: usize) -> bool {
        self.0.get(lane).is_some_and(|bits| *bits != 0)
    }

    #[inline(always)]
    fn any(self) -> bool {
        self.0.iter().fold(0, |all, bits| all | bits) != 0
    }

    #[inline(always)]
    fn and(self, other: Self) -> Self {
        self.combine(other, |x, y| x & y)
    }

    #[inline(always)]
    fn or(self, other: Self) -> Self {
        self.combine(other, |x, y| x | y)
    }

    #[inline(always)]
    fn without(self, other: Self) -> Self {
        self.combine(other, |x, y| x & !y)
    }

    #[inline(always)]
    fn numbers(number: u32) -> [u32; L] {
        [number; L]
    }

    #[inline(always)]
    fn having(numbers: &[u32; L], number: u32) -> Self {
        LaneMask(numbers.map(|own| bits(own == number)))
    }

    #[inline(always)]
    fn put(self, numbers: &mut [u32; L], number: u32) {
        for (own, mask) in numbers.iter_mut().zip(self.0) {
            *own = (number & mask) | (*own & !mask);
        }
    }

    #[inline(always)]
    fn add(self, numbers: &mut [u32; L], number: u32) {
        for (own, mask) in numbers.iter_mut().zip(self.0) {
            *own = own.wrapping_add(number & mask);
        }
    }
}

impl<const L: usize> LaneMask<L> {
    #[inline(always)]
    fn combine(self, other: Self, f: impl Fn(u32, u32) -> u32) -> Self {
        let mut out = self;
        for (out, other) in out.0.iter_mut().zip(other.0) {
            *out = f(*out, other);
        }
        out
    }
}

/// Arithmetic lane by lane.
macro_rules! arithmetic {
    ($($trait:ident $method:ident |$x:ident, $y:ident| $body:expr;)*) => {
        $(impl<const L: usize> $trait for Lanes<L> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.zip(other, |$x, $y| $body)
            }
        })*
    };
}
arithmetic! {
    Add add |x, y| x + y;
    Sub sub |x, y| x - y;
    Mul mul |x, y| x * y;
    Div div |x, y| x / y;
}

impl<const L: usize> AddAssign for Lanes<L> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
