//! `tpg presets`

use serde_json::json;

use tpg_tasks::console::{print, print_json};
use tpg_tasks::exit_status::{Failure, Status};
use tpg_trainer::config::{Preset, nearest, presets};

/// Arguments of `tpg presets`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  tpg presets\n  tpg presets hopper\n  tpg presets champion-b23"
)]
pub(crate) struct Args {
    /// Only presets with this in their name.
    #[arg(value_name = "PART")]
    part: Option<String>,
    /// Print one JSON object to standard output.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<Status, Failure> {
    let presets = wanted(args.part.as_deref())?;
    if args.json {
        let rows: Vec<_> = presets
            .iter()
            .map(|p| {
                json!({
                    "name": p.name,
                    "task": p.task,
                    "variant": p.variant,
                    "observability": p.observability,
                    "about": p.about,
                })
            })
            .collect();
        print_json(&json!({ "presets": rows }))?;
        return Ok(Status::Fine);
    }
    print(text(&presets))?;
    Ok(Status::Fine)
}

/// The presets with a part in their name, or all.
fn wanted(part: Option<&str>) -> Result<Vec<Preset>, Failure> {
    let all = presets()?;
    let Some(part) = part else { return Ok(all) };
    let suggestion = nearest(part, all.iter().map(|preset| preset.name.as_str()));
    let mut some = all;
    some.retain(|preset| preset.name.contains(part));
    match some.is_empty() {
        true => Err(Failure::usage(anyhow::anyhow!(
            "no preset has {part:?} in its name; the nearest is {suggestion:?}, `tpg presets` lists all"
        ))),
        false => Ok(some),
    }
}

/// A heading for each task, and below it what each preset is. What works best comes first.
fn text(presets: &[Preset]) -> String {
    let mut tasks: Vec<&str> = presets.iter().map(|preset| preset.task).collect();
    tasks.dedup();
    let group = |task: &&str| {
        let mut group: Vec<&Preset> = presets.iter().filter(|p| p.task == *task).collect();
        group.sort_by_key(|preset| preset.variant != "champion");
        let rows = group.iter().map(|preset| {
            let (name, seen, about) = (&preset.name, &preset.observability, &preset.about);
            format!("  {name:<44} {seen:<19} {about}")
        });
        let rows: Vec<String> = rows.collect();
        format!("{task}\n{}", rows.join("\n"))
    };
    let groups: Vec<String> = tasks.iter().map(group).collect();
    groups.join("\n\n")
}
