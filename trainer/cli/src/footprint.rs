//! `tpg footprint`

use std::fmt;
use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use serde::Serialize;
use tpg_runtime::Policy;

use tpg_tasks::console::{print, print_json};
use tpg_tasks::exit_status::{Failure, Fault as _, Status};
use tpg_tools::footprint::{
    Board, Firmware, FootprintError, Measured, Profile, ProgramShare, TeamShare, boards, shares,
};

/// Arguments of `tpg footprint`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Exported policy.
    #[arg(value_name = "FILE.tpg")]
    file: PathBuf,
    #[arg(long, value_name = "BOARD", value_parser = board, help = target_help())]
    target: Vec<&'static Board>,
    /// Compiled for little flash (opt-level s and feature small-code, as the examples come) or for short decisions
    /// (opt-level 3).
    #[arg(long, default_value = "size", value_parser = profile())]
    profile: Profile,
    /// The repository's folder firmware-examples, if it is not in or above the working directory.
    #[arg(long, value_name = "DIR")]
    firmware: Option<PathBuf>,
    /// Print one JSON object to standard output.
    #[arg(long)]
    json: bool,
}

fn profile() -> impl TypedValueParser<Value = Profile> {
    let find = |name: String| Profile::ALL.into_iter().find(|p| p.name() == name);
    PossibleValuesParser::new(Profile::ALL.map(Profile::name))
        .try_map(move |name| find(name).ok_or("no such profile"))
}

/// Names the boards, and says which of them are not run.
fn target_help() -> String {
    let describe = |board: &Board| {
        let built_only = board.emulation.is_none();
        let note = if built_only { ", built only" } else { "" };
        format!("{} ({}{note})", board.name, board.processor)
    };
    let described: Vec<String> = boards().iter().map(describe).collect();
    format!(
        "Board to build and emulate, the first one unless said, may be repeated: {}",
        described.join(", ")
    )
}

fn board(name: &str) -> Result<&'static Board, String> {
    let names: Vec<&str> = boards().iter().map(|board| board.name.as_str()).collect();
    (boards().iter().find(|board| board.name == name))
        .ok_or_else(|| format!("no such board; there are {}", names.join(", ")))
}

/// What a policy takes; the fields are the keys of `--json`.
#[derive(Debug, Serialize)]
struct Footprint {
    profile: Profile,
    instructions_worst: u32,
    targets: Vec<Measured>,
    teams: Vec<TeamShare>,
    programs: Vec<ProgramShare>,
}

pub(crate) fn run(args: &Args) -> Result<Status, Failure> {
    let file = args.file.display();
    let bytes = std::fs::read(&args.file).or_bad_input(format!("cannot read {file}"))?;
    let policy = Policy::load(&bytes).or_bad_input(format!("cannot use {file}"))?;
    let firmware = Firmware::find(args.firmware.as_deref()).map_err(failure)?;
    let targets = if args.target.is_empty() {
        boards().iter().take(1).collect()
    } else {
        args.target.clone()
    };
    let measured: Result<Vec<_>, _> = (targets.into_iter())
        .map(|board| firmware.measure(board, args.profile, &args.file))
        .collect();
    let (teams, programs) = shares(&policy);
    let footprint = Footprint {
        profile: args.profile,
        instructions_worst: policy.bounds().instructions,
        targets: measured.map_err(failure)?,
        teams,
        programs,
    };
    if args.json {
        print_json(&footprint)?;
    } else {
        print(footprint.to_string().trim_end())?;
    }
    Ok(Status::Fine)
}

/// A number with `places` decimal places; a dash if it is unknown.
fn known(number: Option<impl fmt::Display>, places: usize) -> String {
    number.map_or_else(|| "-".to_owned(), |number| format!("{number:.places$}"))
}

fn failure(error: FootprintError) -> Failure {
    match error {
        FootprintError::NoSources(_)
        | FootprintError::NoPackage(..)
        | FootprintError::NoProgram { .. } => Failure::usage(error),
        FootprintError::Run { .. } => Failure::peer(error),
        _ => error.into(),
    }
}

impl fmt::Display for Footprint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "worst decision    {} instructions of the policy",
            self.instructions_worst
        )?;
        for m in &self.targets {
            let profile = self.profile;
            writeln!(f, "{} ({}), profile {profile}", m.board, m.processor)?;
            writeln!(
                f,
                "  flash           {} bytes of code, {} of policy",
                m.flash_code_bytes, m.flash_blob_bytes
            )?;
            writeln!(
                f,
                "  RAM             {} bytes static, {} of them the agent; {} of stack in a decision, {} at most",
                m.ram_static_bytes,
                known(m.seen.agent_bytes, 0),
                known(m.seen.stack_bytes, 0),
                m.stack_bytes_bound
            )?;
            writeln!(
                f,
                "  {} decisions  {} instructions of the policy; of the processor {} on average, {} at most seen",
                known(m.seen.decisions, 0),
                known(m.seen.instructions_mean, 1),
                known(m.seen.machine_instructions_mean, 0),
                known(m.seen.machine_instructions_worst_seen, 0)
            )?;
        }
        writeln!(f, "            instructions  flash bytes  RAM bytes")?;
        for t in &self.teams {
            let (flash, ram) = (t.flash_bytes, t.ram_bytes);
            writeln!(f, "team {:<7} {:>11} {flash:>12} {ram:>10}", t.team, "")?;
        }
        for p in &self.programs {
            let (flash, ram) = (p.flash_bytes, p.ram_bytes);
            writeln!(
                f,
                "program {:<4} {:>11} {flash:>12} {ram:>10}",
                p.program, p.instructions
            )?;
        }
        Ok(())
    }
}
