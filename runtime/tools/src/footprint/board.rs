//! The boards that firmware can be built for.

use std::sync::LazyLock;

use serde::Deserialize;

/// A board as described in `firmware-examples/boards.toml`.
#[derive(Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub struct Board {
    /// The board's name, which is also the name of its folder in `firmware-examples/`.
    pub name: String,
    /// The name of its processor.
    pub processor: String,
    /// The compiler target.
    pub target: String,
    /// How to emulate the board. `None` if there is no emulator for it.
    pub emulation: Option<Emulation>,
}

/// How to emulate a board.
#[derive(Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub struct Emulation {
    /// The emulator and the options that select the board. Never empty.
    pub command: Vec<String>,
    /// Options that make the emulator's clock count instructions.
    pub count: Vec<String>,
    /// Start address of memory that the board's programs do not use.
    pub spare: u32,
    /// The number of decisions per policy in the test that compares the board with the host.
    pub test_decisions: u32,
}

/// All boards. The first is the default. Never empty.
///
/// # Panics
/// If the table built into this crate is invalid. A test reads it.
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
