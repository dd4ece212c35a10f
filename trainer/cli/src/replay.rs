//! `tpg replay`

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use tpg_runtime::{HostAgent, Policy};

use tpg_tasks::console::{print, print_json};
use tpg_tasks::exit_status::{Failure, Fault as _, Status};
use tpg_tasks::trace::{Decision, ReplayError, replay_with};

/// Arguments of `tpg replay`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Trace that `tpg eval --trace` recorded.
    #[arg(value_name = "FILE.trace")]
    trace: PathBuf,
    /// The policy that it was recorded from.
    #[arg(value_name = "FILE.tpg")]
    policy: PathBuf,
    /// Write the observations for the firmware's program `cycles`: a line for each, and an empty one between episodes.
    #[arg(long, value_name = "OUT")]
    observations: Option<PathBuf>,
    /// Print one JSON object to standard output.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<Status, Failure> {
    let file = args.policy.display();
    let bytes = std::fs::read(&args.policy).or_bad_input(format!("cannot read {file}"))?;
    let (mut observations, mut episode) = (String::new(), 0);
    let decisions = decide_again(&args.trace, &args.policy, &bytes, |decision| {
        if args.observations.is_some() {
            if decision.episode != episode {
                observations.push('\n');
                episode = decision.episode;
            }
            observations.push_str(&decision.observation.join(" "));
            observations.push('\n');
        }
    })?;
    if let Some(path) = &args.observations {
        std::fs::write(path, observations).or_unwritable(path)?;
    }
    if args.json {
        print_json(&serde_json::json!({ "decisions": decisions }))?;
    } else {
        print(format_args!(
            "{decisions} decisions, all bit for bit as recorded"
        ))?;
    }
    Ok(Status::Fine)
}

/// Decides a trace's decisions again with the policy in `bytes`, shows each, and returns how many there are.
pub(crate) fn decide_again(
    trace: &Path,
    file: &Path,
    bytes: &[u8],
    show: impl FnMut(&Decision),
) -> Result<u64, Failure> {
    let (path, file) = (trace.display(), file.display());
    let policy = Policy::load(bytes).or_bad_input(format!("cannot use {file}"))?;
    let lines = File::open(trace).or_bad_input(format!("cannot read {path}"))?;
    let mut agent = Box::new(HostAgent::new(policy).or_bad_input(format!("cannot run {file}"))?);
    let result = match replay_with(BufReader::new(lines), bytes, &mut agent, show) {
        Err(other @ ReplayError::OtherPolicy { .. }) => {
            Err(other).or_usage(format!("cannot replay {path} with {file}"))?
        }
        other => other.or_bad_input(format!("cannot replay {path}"))?,
    };
    // A decision that comes out differently is a defect: of the build, the machine or the trace.
    result.map_err(|difference| Failure::new(Status::OurFault, difference))
}
