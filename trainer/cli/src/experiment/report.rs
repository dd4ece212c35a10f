//! `tpg experiment report`

use std::path::PathBuf;

use tpg_experiments::report::{self, ReportError};
use tpg_tasks::console::print;
use tpg_tasks::exit_status::{Failure, Status};

/// Arguments of `tpg experiment report`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  tpg experiment report docs/experiments/chapter-2-reduced")]
pub(crate) struct Args {
    /// Folder of the results, as `tpg experiment run` made it; the report goes to DIR/report and DIR/report.html.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

pub(crate) fn run(args: &Args) -> Result<Status, Failure> {
    let failure = |error| match error {
        ReportError::Write { .. } => Failure::usage(error),
        ReportError::Defect { .. } => error.into(),
        error => Failure::bad_input(error),
    };
    let summary = report::write(&args.folder).map_err(failure)?;
    let page = report::write_page(&args.folder).map_err(failure)?;
    print(summary.runs)?;
    for file in summary.files.into_iter().chain([page]) {
        print(file.display())?;
    }
    Ok(Status::Fine)
}
