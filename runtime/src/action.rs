//! What a decision tells the plant to do.

/// The atomic action of one decision, already clamped to the policy's action range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Action<'a> {
    /// Index of the chosen action of a discrete task.
    Discrete(u16),
    /// One value for each output of a continuous task.
    Continuous(&'a [f32]),
}
