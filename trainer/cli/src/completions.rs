//! `tpg completions`

use clap::Command;
use clap_complete::{Shell, generate};

use tpg_tasks::console::print;
use tpg_tasks::exit_status::{Failure, Status};

/// Arguments of `tpg completions`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    tpg completions bash > ~/.local/share/bash-completion/completions/tpg\n  \
    tpg completions fish > ~/.config/fish/completions/tpg.fish")]
pub(crate) struct Args {
    /// The shell.
    shell: Shell,
}

pub(crate) fn run(args: &Args, mut command: Command) -> Result<Status, Failure> {
    let mut script = Vec::new();
    generate(args.shell, &mut command, "tpg", &mut script);
    print(String::from_utf8_lossy(&script).trim_end())?;
    Ok(Status::Fine)
}
