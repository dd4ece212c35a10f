//! How much of a genome reaches the tables.

/// How much of a genome reaches the tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// Everything that the root can reach, as evolved.
    Whole,
    /// Every instruction, slot and cell as evolved, but only registers that matter or that an instruction names.
    ///
    /// It executes and accesses what [`Mode::Whole`] does. It needs so much less room that wide policies of many programs fit
    /// the format.
    Counting,
    /// Only instructions, registers, slots and cells that can influence an action.
    Compact,
}
