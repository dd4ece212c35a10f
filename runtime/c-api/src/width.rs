//! The vector widths that the library is built for.

use tpg_runtime::{AnyWidth, Fixed};

/// The vector width that the environment variable `TPG_WIDTH` named when the library was built.
///
/// It is 0 if the variable was not set. Then the library executes policies of every width.
const ONLY: usize = match option_env!("TPG_WIDTH") {
    Some(text) => match usize::from_str_radix(text, 10) {
        Ok(width @ 1..=32) => width,
        _ => panic!("TPG_WIDTH must be a vector width, 1 to 32"),
    },
    None => 0,
};

/// Turns a number into the type of a width.
pub struct Select<const W: usize>;

pub trait Pick {
    type Width: tpg_runtime::Width;
}

impl Pick for Select<0> {
    type Width = AnyWidth;
}

macro_rules! widths {
    ($($w:literal)*) => {
        $(impl Pick for Select<$w> {
            type Width = Fixed<$w>;
        })*
    };
}

widths!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29 30 31 32);

/// The width that the library is built for.
pub type Built = <Select<ONLY> as Pick>::Width;
