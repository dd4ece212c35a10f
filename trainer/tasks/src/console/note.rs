//! Lines for people, on standard error.
//!
//! `tpg-controller` builds without this crate. The bridge then compiles this file as a module of its own, so it may use
//! nothing but the standard library.

use std::fmt;
use std::io::{self, Write as _};

/// Writes a line to standard error; a line that cannot be written is dropped.
///
/// `eprintln!` panics where standard error is closed, which would end a run because its terminal or log is gone.
pub fn note(line: impl fmt::Display) {
    // One write for the whole line, so that the lines of two processes do not mix.
    let _ = io::stderr().write_all(format!("{line}\n").as_bytes());
}
