//! Policies for tests and benchmarks: made by hand, or drawn in a given shape.

pub mod draft;
pub mod hostile;
pub mod shapes;
