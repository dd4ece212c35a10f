//! `tpg man`

use std::path::PathBuf;

use clap::Command;

use tpg_tasks::console::note;
use tpg_tasks::exit_status::{Failure, Fault as _, Status};

/// Arguments of `tpg man`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  tpg man ~/.local/share/man/man1    # then: man tpg, man tpg-train"
)]
pub(crate) struct Args {
    /// Folder for the pages, which is made if it is not there.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

pub(crate) fn run(args: &Args, command: Command) -> Result<Status, Failure> {
    let folder = &args.folder;
    let made = std::fs::create_dir_all(folder);
    let written = made.and_then(|()| clap_mangen::generate_to(command, folder));
    written.or_unwritable(folder)?;
    let page = folder.join("tpg.1");
    note(format_args!("{}: and a page for each verb", page.display()));
    Ok(Status::Fine)
}
