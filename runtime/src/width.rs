//! For which vector widths the interpreter is compiled.

use crate::exec::{Vectors, vectors};
use crate::trace::Observer;

/// Which vector widths an [`Agent`](crate::Agent) is compiled for.
pub trait Width: sealed::Sealed {}

pub(crate) mod sealed {
    use super::{Observer, Vectors};

    pub trait Sealed {
        /// The only width, or `None` for every width up to the limit.
        const ONLY: Option<u16>;
        /// The instructions on vectors and matrices of this width.
        fn vectors<O: Observer>(width: u16) -> Vectors<O>;
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
    fn vectors<O: Observer>(_: u16) -> Vectors<O> {
        vectors::<W, O>
    }
}

impl sealed::Sealed for AnyWidth {
    const ONLY: Option<u16> = None;

    #[inline(always)]
    fn vectors<O: Observer>(width: u16) -> Vectors<O> {
        macro_rules! dispatch {
            ($($w:literal)*) => {
                match width {
                    $($w => vectors::<$w, O>,)*
                    // The verifier has refused every other width.
                    _ => vectors::<1, O>,
                }
            };
        }
        dispatch!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29 30 31 32)
    }
}
