//! `tpg convert`

use std::path::PathBuf;

use serde_json::json;
use tpg_runtime::Policy;
use tpg_runtime::blob::VERSION;
use tpg_tasks::console::{note, print, print_json};
use tpg_tasks::exit_status::{Failure, Fault as _, Status};
use tpg_tools::convert::convert;

/// Arguments of `tpg convert`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  \
    tpg convert docs/champions/hopper-b23.tpg --out hopper.tpg")]
pub(crate) struct Args {
    /// Exported policy, of any format version.
    #[arg(value_name = "FILE.tpg")]
    file: PathBuf,
    /// Where to write the policy in the newest format version. A file that has it already is copied, signature and all.
    #[arg(long, value_name = "OUT.tpg")]
    out: PathBuf,
    /// Print one JSON object to standard output.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<Status, Failure> {
    let (file, out) = (args.file.display(), args.out.display());
    let bytes = std::fs::read(&args.file).or_bad_input(format!("cannot read {file}"))?;
    let policy = Policy::load(&bytes).or_bad_input(format!("cannot use {file}"))?;
    let from = policy.header().version;
    let new = if from == VERSION {
        bytes.clone()
    } else {
        convert(&policy).or_bad_input(format!("cannot convert {file}, which stays usable"))?
    };
    std::fs::write(&args.out, &new).or_unwritable(&args.out)?;
    if from < VERSION && policy.header().front_end.is_some() {
        note(format_args!(
            "{file} has format version {from} and a front end: in version {VERSION} each missing element is filled in by \
             itself, and an observation of zeros is not missing but zero; whoever sent zeros for a lost one sends NaN"
        ));
    }
    let contract = policy.contract();
    if args.json {
        print_json(&json!({
            "from_version": from,
            "version": VERSION,
            "bytes": new.len(),
            "contract": format!("{contract:016x}"),
        }))?;
    } else if from == VERSION {
        print(format_args!(
            "{out}: {} bytes, a copy of {file}, which has version {VERSION} already",
            new.len()
        ))?;
    } else {
        print(format_args!(
            "{out}: {} bytes, version {VERSION} of a policy of version {from}, contract {contract:016x}",
            new.len()
        ))?;
    }
    Ok(Status::Fine)
}
