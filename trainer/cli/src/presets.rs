//! `tpg presets`

use std::io::Write as _;

use serde_json::json;

use tpg_tasks::exit_status::{Failure, Status};
use tpg_tasks::score::print_json;
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
    let mut out = std::io::stdout().lock();
    for preset in presets {
        writeln!(out, "{:<36} {}", preset.name, preset.observability)?;
    }
    Ok(Status::Fine)
}
