//! `tpg bench`: the loops of a bench file, one after another, with a summary.

mod file;
mod summary;

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::anyhow;
use clap::Parser;
use serde_json::Value;
use tpg_tasks::console::{one_line, print, print_json};
use tpg_tasks::exit_status::{Failure, Fault as _, Status};

use crate::hil::{self, HilArgs};
use crate::interrupt;
use crate::junit;
use crate::note;
use crate::outcome::failure;
use file::{BenchFile, Case};
use summary::{End, Summary};

/// Run every policy of a bench file through every scenario of it, and say which requirements hold.
///
/// Each case is a loop of `tpg hil`. Ends with status 5 if a requirement does not hold.
#[derive(Debug, Parser)]
#[command(
    name = "tpg-bench",
    bin_name = "tpg bench",
    version,
    after_help = Status::help(
        "Example:\n  tpg bench acceptance.toml --junit result.xml --out runs/acceptance"
    )
)]
pub struct BenchFileArgs {
    /// Policies, scenarios and requirements; docs/bench.md describes it.
    #[arg(value_name = "FILE.toml")]
    file: PathBuf,
    /// Write the results to this file, as JUnit XML.
    #[arg(long, value_name = "FILE.xml")]
    junit: Option<PathBuf>,
    /// Record each case to this folder: CASE.mcap with its steps, CASE.hgrm with its latencies, CASE.json with its result.
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Print one JSON object to standard output.
    #[arg(long)]
    json: bool,
}

/// A case with its checked arguments.
struct Prepared {
    case: Case,
    args: HilArgs,
    forwarded: Vec<OsString>,
}

/// Runs a bench file.
///
/// # Errors
/// A [`Failure`] if the file or a case in it is wrong, which is found before anything runs, or if the user interrupts.
pub fn run(args: &BenchFileArgs) -> Result<Status, Failure> {
    let bench = BenchFile::read(&args.file)?;
    if let Some(folder) = &args.out {
        std::fs::create_dir_all(folder).or_unwritable(folder)?;
    }
    let cases = bench.cases(&args.file)?;
    let cases = cases.into_iter().map(|case| prepare(case, args));
    let cases = cases.collect::<Result<Vec<_>, _>>()?;
    interrupt::install().map_err(failure)?;
    let mut summary = Summary::new(bench.name(&args.file));
    for (k, prepared) in cases.iter().enumerate() {
        note(format_args!(
            "case {} of {}: {}",
            k + 1,
            cases.len(),
            prepared.case.name
        ));
        let start = Instant::now();
        let end = run_case(prepared, args)?;
        summary.add(&prepared.case, end, start.elapsed().as_secs_f64());
    }
    if let Some(path) = &args.junit {
        junit::write(path, &summary.suites())?;
    }
    if args.json {
        print_json(&summary.to_json())?;
    } else {
        print(&summary)?;
    }
    Ok(summary.status())
}

/// Reads the arguments of a case as `tpg hil` does.
fn prepare(case: Case, args: &BenchFileArgs) -> Result<Prepared, Failure> {
    let mut forwarded = case.arguments.clone();
    if let Some(folder) = &args.out {
        for (flag, extension) in [("--record", "mcap"), ("--latency-histogram", "hgrm")] {
            forwarded.push(flag.into());
            forwarded.push(case.path(folder, extension).into());
        }
    }
    forwarded.push("--json".into());
    let all = std::iter::once(OsString::from("tpg hil")).chain(forwarded.clone());
    let wrong = |status, text: String| {
        let (path, name) = (args.file.display(), &case.name);
        Failure::new(status, anyhow!("{path}: case {name}: {text}"))
    };
    let parsed = HilArgs::try_parse_from(all).map_err(|error| {
        // What clap adds after the first paragraph is about a command line that nobody typed.
        let text = error.to_string();
        let text = text.trim_start_matches("error: ");
        let first = text.split("\n\n").next().unwrap_or(text);
        wrong(Status::BadInput, one_line(first))
    })?;
    (parsed.check()).map_err(|error| wrong(error.status, format!("{:#}", error.error)))?;
    Ok(Prepared {
        case,
        args: parsed,
        forwarded,
    })
}

/// Runs a case; a loop that broke off is a result, an interruption ends the bench.
fn run_case(prepared: &Prepared, args: &BenchFileArgs) -> Result<End, Failure> {
    let (status, text) = match hil::run_loop(&prepared.args, &prepared.forwarded) {
        Ok(ended) => ended,
        Err(failure) if failure.status == Status::Interrupted => return Err(failure),
        Err(failure) => return Ok(End::Broken(failure)),
    };
    let outcome: Value = serde_json::from_str(&text)?;
    if let Some(folder) = &args.out {
        write(&prepared.case.path(folder, "json"), &text)?;
    }
    Ok(End::Ran {
        met: status == Status::Fine,
        outcome,
    })
}

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    std::fs::write(path, text).or_unwritable(path)
}
