//! `tpg footprint`

use std::fmt;
use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use serde::Serialize;
use tpg_runtime::Policy;

use tpg_tasks::console::{print, print_json};
use tpg_tasks::exit_status::{Failure, Fault as _, Status};
use tpg_tools::footprint::{
    Board, CYCLES_PER_INSTRUCTION, Clock, Costs, Deadline, Firmware, FootprintError, Measured,
    Profile, ProgramShare, TeamShare, boards, shares,
};
use tpg_tools::worst_path::worst_path;

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
    /// Estimate whether the longest decision fits the control period at so many megahertz; exit status 5 if it does not.
    /// Operations are counted on the emulated board, cycles are assumed.
    #[arg(long, value_name = "F", value_parser = positive)]
    deadline_mhz: Option<f64>,
    /// Cycles of a machine instruction, for --deadline-mhz.
    #[arg(long, value_name = "C", value_parser = positive, default_value_t = CYCLES_PER_INSTRUCTION, requires = "deadline_mhz")]
    cycles_per_instruction: f64,
    /// Control period in microseconds, for --deadline-mhz, in place of the policy's.
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u32).range(1..), requires = "deadline_mhz")]
    period_us: Option<u32>,
    /// Write the worst path to a file: a policy whose every decision runs all programs, for the firmware's `cycles`. Nothing
    /// is measured.
    #[arg(long, value_name = "OUT.tpg", conflicts_with_all = ["target", "deadline_mhz"])]
    worst_path: Option<PathBuf>,
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

fn positive(text: &str) -> Result<f64, String> {
    let number = text.parse().ok();
    (number.filter(|x: &f64| x.is_finite() && *x > 0.0))
        .ok_or_else(|| "not a number above 0".into())
}

/// Whether the longest decision on a board is in time.
#[derive(Debug, Serialize)]
struct InTime {
    board: String,
    #[serde(flatten)]
    deadline: Deadline,
    #[serde(flatten)]
    costs: Costs,
}

/// What a policy takes; the fields are the keys of `--json`.
#[derive(Debug, Serialize)]
struct Footprint {
    profile: Profile,
    instructions_worst: u32,
    targets: Vec<Measured>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    deadlines: Vec<InTime>,
    teams: Vec<TeamShare>,
    programs: Vec<ProgramShare>,
}

pub(crate) fn run(args: &Args) -> Result<Status, Failure> {
    let file = args.file.display();
    let bytes = std::fs::read(&args.file).or_bad_input(format!("cannot read {file}"))?;
    let policy = Policy::load(&bytes).or_bad_input(format!("cannot use {file}"))?;
    if let Some(out) = &args.worst_path {
        let made = worst_path(&policy).or_bad_input(format!(
            "{file} is too large with a program more for each team"
        ))?;
        std::fs::write(out, made).or_unwritable(out)?;
        return Ok(Status::Fine);
    }
    let clock = clock(args, &policy)?;
    let firmware = Firmware::find(args.firmware.as_deref()).map_err(failure)?;
    let targets = if args.target.is_empty() {
        boards().iter().take(1).collect()
    } else {
        args.target.clone()
    };
    let measured: Result<Vec<_>, _> = (targets.iter())
        .map(|board| firmware.measure(board, args.profile, &args.file))
        .collect();
    let measured = measured.map_err(failure)?;
    let mut deadlines = Vec::new();
    if let Some(clock) = clock {
        for (board, seen) in targets.iter().zip(&measured) {
            let costs = firmware.costs(board, args.profile, &args.file);
            let costs = costs.map_err(failure)?;
            // The bound is measured, not proven, so what was seen may not be left out.
            let worst = seen.seen.machine_instructions_worst_seen.unwrap_or(0);
            let most = (costs.machine_instructions_bound)
                .max(costs.machine_instructions_worst_path)
                .max(worst);
            deadlines.push(InTime {
                board: board.name.clone(),
                deadline: Deadline::estimate(most, clock),
                costs,
            });
        }
    }
    let (teams, programs) = shares(&policy);
    let footprint = Footprint {
        profile: args.profile,
        instructions_worst: policy.bounds().instructions,
        targets: measured,
        deadlines,
        teams,
        programs,
    };
    if args.json {
        print_json(&footprint)?;
    } else {
        print(footprint.to_string().trim_end())?;
    }
    let met = footprint.deadlines.iter().all(|d| d.deadline.met);
    Ok(if met { Status::Fine } else { Status::Unmet })
}

/// What to estimate times with, if they are asked for.
fn clock(args: &Args, policy: &Policy<'_>) -> Result<Option<Clock>, Failure> {
    let Some(mhz) = args.deadline_mhz else {
        return Ok(None);
    };
    let stored = policy.header().control_period_us;
    let period_us = args.period_us.unwrap_or(stored);
    if period_us == 0 {
        return Err(Failure::usage(anyhow::anyhow!(
            "{} has no control period, as its task has none: say how long a decision may take, with --period-us T",
            args.file.display()
        )));
    }
    Ok(Some(Clock {
        mhz,
        cycles_per_instruction: args.cycles_per_instruction,
        period_us,
    }))
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
                "  {} decisions  {} instructions of the policy; of the processor {} on average, {} at most seen, in one of {}",
                known(m.seen.decisions, 0),
                known(m.seen.instructions_mean, 1),
                known(m.seen.machine_instructions_mean, 0),
                known(m.seen.machine_instructions_worst_seen, 0),
                known(m.seen.instructions_in_worst_seen, 0)
            )?;
        }
        for d in &self.deadlines {
            write!(f, "{d}")?;
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

impl fmt::Display for InTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (deadline, costs) = (&self.deadline, &self.costs);
        let clock = deadline.clock;
        writeln!(
            f,
            "deadline on {}, an estimate: {}",
            self.board,
            if deadline.met { "met" } else { "NOT MET" }
        )?;
        writeln!(
            f,
            "  {:.0} us of {} us at {} MHz and {} cycles per instruction; {:.1} MHz are needed",
            deadline.estimate_us,
            clock.period_us,
            clock.mhz,
            clock.cycles_per_instruction,
            deadline.mhz_needed
        )?;
        writeln!(
            f,
            "  {} machine instructions at most; with all programs in one decision {} were seen",
            deadline.machine_instructions, costs.machine_instructions_worst_path
        )?;
        writeln!(
            f,
            "  operation             count  machine instructions each, at most seen"
        )?;
        for o in &costs.operations {
            let (name, each) = (o.operation, o.machine_instructions);
            writeln!(f, "  {name:<18} {:>8} {each:>10.1}", o.count)?;
        }
        let (turn, turns, rest) = (costs.turn, costs.turns, costs.rest);
        writeln!(f, "  {:<18} {turns:>8} {turn:>10.1}", "(change of loop)")?;
        writeln!(f, "  {:<18} {:>8} {rest:>10.1}", "(all else)", 1)
    }
}
