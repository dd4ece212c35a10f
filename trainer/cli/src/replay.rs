//! `tpg replay`

use std::fs::File;
use std::io::BufReader;
use std::path::PathBuf;

use tpg_runtime::{HostAgent, Policy};

use tpg_tasks::console::{print, print_json};
use tpg_tasks::exit_status::{Failure, Fault as _, Status};
use tpg_tasks::trace::{ReplayError, replay};

/// Arguments of `tpg replay`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Trace that `tpg eval --trace` recorded.
    #[arg(value_name = "FILE.trace")]
    trace: PathBuf,
    /// The policy that it was recorded from.
    #[arg(value_name = "FILE.tpg")]
    policy: PathBuf,
    /// Print one JSON object to standard output.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<Status, Failure> {
    let (trace, file) = (args.trace.display(), args.policy.display());
    let bytes = std::fs::read(&args.policy).or_bad_input(format!("cannot read {file}"))?;
    let policy = Policy::load(&bytes).or_bad_input(format!("cannot use {file}"))?;
    let lines = File::open(&args.trace).or_bad_input(format!("cannot read {trace}"))?;
    let mut agent = Box::new(HostAgent::new(policy).or_bad_input(format!("cannot run {file}"))?);
    let result = replay(BufReader::new(lines), &bytes, &mut agent);
    let result = match result {
        Err(other @ ReplayError::OtherPolicy { .. }) => {
            Err(other).or_usage(format!("cannot replay {trace} with {file}"))?
        }
        other => other.or_bad_input(format!("cannot replay {trace}"))?,
    };
    // A decision that comes out differently is a defect: of the build, the machine or the trace.
    let decisions = result.map_err(|difference| Failure::new(Status::OurFault, difference))?;
    if args.json {
        print_json(&serde_json::json!({ "decisions": decisions }))?;
    } else {
        print(format_args!(
            "{decisions} decisions, all bit for bit as recorded"
        ))?;
    }
    Ok(Status::Fine)
}
