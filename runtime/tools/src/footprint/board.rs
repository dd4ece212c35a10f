//! The boards that firmware is built for.

use std::sync::LazyLock;

use serde::Deserialize;

/// A board, as `firmware-examples/boards.toml` describes it.
#[derive(Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub struct Board {
    /// Name of the board and of its folder below `firmware-examples/`.
    pub name: String,
    /// Its processor.
    pub processor: String,
    /// The compiler's target.
    pub target: String,
    /// How it is emulated; `None` where nothing emulates it.
    pub emulation: Option<Emulation>,
}

/// How a board is emulated.
#[derive(Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub struct Emulation {
    /// The emulator and the options that choose the board; never empty.
    pub command: Vec<String>,
    /// Options with which the emulator's clock counts instructions.
    pub count: Vec<String>,
    /// Address of memory that the board's programs leave free.
    pub spare: u32,
    /// Decisions of each policy in the test that compares the board with the host.
    pub test_decisions: u32,
}

/// The boards, the default one first; never empty.
///
/// # Panics
/// If the table that this crate was built with is none; a test reads it.
#[must_use]
pub fn boards() -> &'static [Board] {
    #[derive(Deserialize)]
    struct Table {
        board: Vec<Board>,
    }
    static TABLE: LazyLock<Table> = LazyLock::new(|| {
        toml::from_str(include_str!("../../../../firmware-examples/boards.toml"))
            .expect("firmware-examples/boards.toml is a table of boards")
    });
    &TABLE.board
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_of_boards_is_complete() {
        assert!(!boards().is_empty());
        for board in boards() {
            let alike = boards().iter().filter(|other| other.name == board.name);
            assert_eq!(alike.count(), 1, "{}", board.name);
            if let Some(emulation) = &board.emulation {
                assert!(!emulation.command.is_empty(), "{}", board.name);
            }
        }
    }
}
