//! For which vector widths the interpreter is compiled.

use crate::exec::{self, Machine, Path};
use crate::trace::Observer;
use crate::verify::Policy;

/// Which vector widths an [`Agent`](crate::Agent) is compiled for.
pub trait Width: sealed::Sealed {}

pub(crate) mod sealed {
    use super::{Machine, Observer, Path, Policy};

    pub trait Sealed {
        /// The only width, or `None` for every width up to the limit.
        const ONLY: Option<u16>;
        fn decide<O: Observer>(policy: &Policy<'_>, machine: &mut Machine<'_, O>) -> Path;
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
    fn decide<O: Observer>(policy: &Policy<'_>, machine: &mut Machine<'_, O>) -> Path {
        exec::decide::<W, O>(policy, machine)
    }
}

impl sealed::Sealed for AnyWidth {
    const ONLY: Option<u16> = None;

    fn decide<O: Observer>(policy: &Policy<'_>, machine: &mut Machine<'_, O>) -> Path {
        macro_rules! dispatch {
            ($($w:literal)*) => {
                match policy.header.width {
                    $($w => exec::decide::<$w, O>(policy, machine),)*
                    // The verifier has refused every other width.
                    _ => exec::decide::<1, O>(policy, machine),
                }
            };
        }
        dispatch!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29 30 31 32)
    }
}
