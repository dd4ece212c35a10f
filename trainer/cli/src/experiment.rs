//! `tpg experiment`

mod claim;
mod progress;
mod report;
mod run;

use tpg_tasks::exit_status::{Failure, Status};

/// Arguments of `tpg experiment`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, clap::Subcommand)]
enum Verb {
    /// Run what is missing of an experiment: each variant on each task, with each seed.
    Run(run::Args),
    /// Write tables and figures of what is there of an experiment, beside the thesis's.
    Report(report::Args),
}

pub(crate) fn run(args: &Args) -> Result<Status, Failure> {
    match &args.verb {
        Verb::Run(args) => run::run(args),
        Verb::Report(args) => report::run(args),
    }
}
