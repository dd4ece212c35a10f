//! `tpg presets`

use serde_json::json;

use tpg_tasks::console::{print, print_json};
use tpg_tasks::exit_status::{Failure, Status};
use tpg_trainer::config::presets;

/// Arguments of `tpg presets`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Print one JSON object to standard output.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<Status, Failure> {
    let presets = presets()?;
    if args.json {
        let rows: Vec<_> = presets
            .iter()
            .map(|p| {
                json!({
                    "name": p.name,
                    "task": p.task,
                    "variant": p.variant,
                    "observability": p.observability,
                })
            })
            .collect();
        print_json(&json!({ "presets": rows }))?;
        return Ok(Status::Fine);
    }
    for preset in presets {
        print(format_args!("{:<36} {}", preset.name, preset.observability))?;
    }
    Ok(Status::Fine)
}
