//! The command `tpg`.

use std::process::ExitCode;

fn main() -> ExitCode {
    tpg_trainer::cli::main()
}
