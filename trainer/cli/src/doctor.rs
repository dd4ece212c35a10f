//! `tpg doctor`

mod checks;

use serde::Serialize;

use tpg_tasks::console::{print, print_json};
use tpg_tasks::exit_status::{Failure, Status};

/// Arguments of `tpg doctor`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  tpg doctor\n  tpg doctor --need loop --need boards\n  tpg doctor --json\n\n\
    Status 0: all that is needed works. Status 5: something that is needed does not."
)]
pub(crate) struct Args {
    /// A part that has to work, beside tasks; may be repeated.
    #[arg(long, value_name = "PART", value_enum)]
    need: Vec<Part>,
    /// Print one JSON object to standard output.
    #[arg(long)]
    json: bool,
}

/// What can work or not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
enum Part {
    /// Training and scoring: the simulator, and each task.
    Tasks,
    /// A policy in the loop: the bridge's programs and shared memory.
    Loop,
    /// Building from source, and native policies.
    Build,
    /// Firmware on emulated boards.
    Boards,
    /// The Python package.
    Python,
    /// Tests of pages; every browser shows them.
    Browser,
    /// Animations of episodes.
    Drawing,
}

impl Part {
    const fn name(self) -> &'static str {
        match self {
            Part::Tasks => "tasks",
            Part::Loop => "loop",
            Part::Build => "build",
            Part::Boards => "boards",
            Part::Python => "python",
            Part::Browser => "browser",
            Part::Drawing => "drawing",
        }
    }
}

/// What was found of one thing.
#[derive(Debug, Serialize)]
struct Finding {
    part: Part,
    /// What was looked at.
    what: String,
    works: bool,
    /// What is there, or what is wrong.
    found: String,
    /// What to do about it.
    #[serde(skip_serializing_if = "Option::is_none")]
    fix: Option<String>,
}

pub(crate) fn run(args: &Args) -> Result<Status, Failure> {
    let findings = checks::all();
    let needed = |part| part == Part::Tasks || args.need.contains(&part);
    let well = findings.iter().all(|f| f.works || !needed(f.part));
    if args.json {
        print_json(&serde_json::json!({ "well": well, "findings": findings }))?;
    } else {
        let lines: Vec<String> = findings.iter().map(line).collect();
        print(lines.join("\n"))?;
    }
    Ok(match well {
        true => Status::Fine,
        false => Status::Unmet,
    })
}

fn line(finding: &Finding) -> String {
    let Finding {
        part,
        what,
        works,
        found,
        fix,
    } = finding;
    let state = if *works { "works" } else { "MISSING" };
    let line = format!("{:<8} {state:<8} {what:<24} {found}", part.name());
    match fix {
        Some(fix) => format!("{line}\n{:18}to do: {fix}", ""),
        None => line,
    }
}
