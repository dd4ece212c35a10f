//! For which vector widths the interpreter is compiled.

use crate::exec::Vectors;

/// Which vector widths an [`Agent`](crate::Agent) is compiled for.
pub trait Width: sealed::Sealed {}

pub(crate) mod sealed {
    use super::Vectors;

    pub trait Sealed {
        /// The only width, or `None` for every width up to the limit.
        const ONLY: Option<u16>;
        /// The instructions on vectors and matrices of this width.
        fn vectors(width: u16) -> Vectors<f32>;
    }
}

/// One width `W`: the interpreter is compiled once, for firmware.
#[derive(Debug, Clone, Copy)]
pub struct Fixed<const W: usize>;

/// Any width up to [`MAX_WIDTH`](crate::MAX_WIDTH): one copy of the interpreter for each, for hosts.
#[derive(Debug, Clone, Copy)]
pub struct AnyWidth;

impl<const W: usize> Width for Fixed<W> {}
impl Width for AnyWidth {}

impl<const W: usize> sealed::Sealed for Fixed<W> {
    const ONLY: Option<u16> = Some(W as u16);

    #[inline(always)]
    fn vectors(_: u16) -> Vectors<f32> {
        Vectors::of::<W>()
    }
}

impl sealed::Sealed for AnyWidth {
    const ONLY: Option<u16> = None;

    #[inline(always)]
    fn vectors(width: u16) -> Vectors<f32> {
        any_width(width)
    }
}

/// Neither generic nor inlined, so that with the feature `any-width` this crate holds the copies for all widths, and programs
/// that are built of many crates compile them once. Without the feature they are compiled where they are used, and firmware
/// never does. A compiler inlines so small a function across crates by itself, and each crate would have all copies.
#[cfg_attr(feature = "any-width", inline(never))]
#[cfg_attr(not(feature = "any-width"), inline)]
fn any_width(width: u16) -> Vectors<f32> {
    macro_rules! dispatch {
        ($($w:literal)*) => {
            match width {
                $($w => Vectors::of::<$w>(),)*
                // The verifier has refused every other width.
                _ => Vectors::of::<1>(),
            }
        };
    }
    dispatch!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29 30 31 32)
}
