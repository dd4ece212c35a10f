//! A word of state: a number of one agent, or one number of each of several agents that run in lock-step.

use core::ops::{Add, AddAssign, Div, Mul, Sub};

/// What the words of a machine's state are: `f32` for one agent.
///
/// The interpreter and every operation are written once for both. An operation on several lanes is the operation on each
/// of them, in the same order, so the bits are those of one lane.
pub trait Word:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + AddAssign
{
    /// Number of agents.
    const LANES: usize;
    /// Zero in every lane.
    const ZERO: Self;
    /// A choice of lanes.
    type Mask: Mask;

    /// A vector of zeros, for good.
    fn zeros<'z, const W: usize>() -> &'z [Self; W];
    /// The same number in every lane.
    fn splat(x: f32) -> Self;
    /// `f` of each lane.
    fn map(self, f: impl Fn(f32) -> f32) -> Self;
    /// `f` of each lane of both.
    fn zip(self, y: Self, f: impl Fn(f32, f32) -> f32) -> Self;
    /// `f` of each lane of a mask, one by one; the others stay as they are.
    fn map_in(self, mask: Self::Mask, f: impl Fn(f32) -> f32) -> Self;
    /// `f` of each lane of a mask of both, one by one; the others stay as they are.
    fn zip_in(self, mask: Self::Mask, y: Self, f: impl Fn(f32, f32) -> f32) -> Self;
    /// `f` of each lane of all three.
    fn zip3(self, x: Self, y: Self, f: impl Fn(f32, f32, f32) -> f32) -> Self;
    /// The lanes of which `f` holds.
    fn test(self, f: impl Fn(f32) -> bool) -> Self::Mask;
    /// The lanes of which `f` holds with the other's.
    fn test2(self, y: Self, f: impl Fn(f32, f32) -> bool) -> Self::Mask;
    /// This in the lanes of the mask, `other` elsewhere.
    fn select(self, mask: Self::Mask, other: Self) -> Self;
    /// What is to be stored over `old` by lanes that run. One agent always runs, so its mask is not looked at.
    fn over(self, old: Self, running: Self::Mask) -> Self;
    /// The number of a lane.
    fn lane(self, lane: usize) -> f32;
}

/// A choice of lanes.
pub trait Mask: Copy {
    /// A whole number for each lane.
    type Numbers: Copy + AsRef<[u32]>;
    /// No lane.
    const NONE: Self;
    /// Every lane.
    const ALL: Self;

    /// The lanes of which `f` holds.
    fn of(f: impl Fn(usize) -> bool) -> Self;
    /// Whether a lane is among them.
    fn has(self, lane: usize) -> bool;
    /// Whether there is any.
    fn any(self) -> bool;
    /// The lanes of both.
    fn and(self, other: Self) -> Self;
    /// The lanes of either.
    fn or(self, other: Self) -> Self;
    /// The lanes of this that the other has not.
    fn without(self, other: Self) -> Self;
    /// The same number for every lane.
    fn numbers(number: u32) -> Self::Numbers;
    /// The lanes that have this number.
    fn having(numbers: &Self::Numbers, number: u32) -> Self;
    /// Gives the lanes of this mask a number.
    fn put(self, numbers: &mut Self::Numbers, number: u32);
    /// Adds to the numbers of the lanes of this mask.
    fn add(self, numbers: &mut Self::Numbers, number: u32);
}

impl Word for f32 {
    const LANES: usize = 1;
    const ZERO: Self = 0.0;
    type Mask = bool;

    #[inline(always)]
    fn zeros<'z, const W: usize>() -> &'z [Self; W] {
        &[0.0; W]
    }

    #[inline(always)]
    fn splat(x: f32) -> Self {
        x
    }

    #[inline(always)]
    fn map(self, f: impl Fn(f32) -> f32) -> Self {
        f(self)
    }

    #[inline(always)]
    fn zip(self, y: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        f(self, y)
    }

    #[inline(always)]
    fn map_in(self, mask: bool, f: impl Fn(f32) -> f32) -> Self {
        if mask { f(self) } else { self }
    }

    #[inline(always)]
    fn zip_in(self, mask: bool, y: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        if mask { f(self, y) } else { self }
    }

    #[inline(always)]
    fn zip3(self, x: Self, y: Self, f: impl Fn(f32, f32, f32) -> f32) -> Self {
        f(self, x, y)
    }

    #[inline(always)]
    fn test(self, f: impl Fn(f32) -> bool) -> bool {
        f(self)
    }

    #[inline(always)]
    fn test2(self, y: Self, f: impl Fn(f32, f32) -> bool) -> bool {
        f(self, y)
    }

    #[inline(always)]
    fn select(self, mask: bool, other: Self) -> Self {
        if mask { self } else { other }
    }

    #[inline(always)]
    fn over(self, _: Self, _: bool) -> Self {
        self
    }

    #[inline(always)]
    fn lane(self, _: usize) -> f32 {
        self
    }
}

impl Mask for bool {
    type Numbers = [u32; 1];
    const NONE: Self = false;
    const ALL: Self = true;

    #[inline(always)]
    fn of(f: impl Fn(usize) -> bool) -> Self {
        f(0)
    }

    #[inline(always)]
    fn has(self, _: usize) -> bool {
        self
    }

    #[inline(always)]
    fn any(self) -> bool {
        self
    }

    #[inline(always)]
    fn and(self, other: Self) -> Self {
        self && other
    }

    #[inline(always)]
    fn or(self, other: Self) -> Self {
        self || other
    }

    #[inline(always)]
    fn without(self, other: Self) -> Self {
        self && !other
    }

    #[inline(always)]
    fn numbers(number: u32) -> [u32; 1] {
        [number]
    }

    #[inline(always)]
    fn having([own]: &[u32; 1], number: u32) -> Self {
        *own == number
    }

    #[inline(always)]
    fn put(self, [own]: &mut [u32; 1], number: u32) {
        if self {
            *own = number;
        }
    }

    #[inline(always)]
    fn add(self, [own]: &mut [u32; 1], number: u32) {
        if self {
            *own += number;
        }
    }
}
