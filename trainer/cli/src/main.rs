//! The command `tpg`: its verbs, one file each, and what they share.

// These macros panic where the output is closed; `console` does not.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod baselines;
mod completions;
mod config;
mod convert;
mod doctor;
mod eval;
mod experiment;
mod explain;
mod export;
mod external;
mod footprint;
mod health;
mod inspect;
mod interrupt;
mod keygen;
mod man;
mod presets;
mod progress;
mod replay;
mod sign;
mod train;
mod version;

use std::process::ExitCode;

use clap::{CommandFactory as _, Parser, Subcommand};
use tpg_tasks::console::report;
use tpg_tasks::exit_status::Status;

/// Evolve Tangled Program Graphs, score them, run them in the loop.
#[derive(Debug, Parser)]
#[command(
    name = "tpg",
    version = version::VERSION,
    after_help = Status::help("A first run: tpg train cartpole-sr-sm --generations 20 --out runs/first")
)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Evolve a population; writes champion, log, checkpoint and configuration to a folder.
    Train(train::Args),
    /// Score an exported policy on test episodes.
    Eval(eval::Args),
    /// Score a policy in the loop: simulator and controller as two processes.
    Hil(external::Args),
    /// Run the loops of a bench file: policies, scenarios, requirements; with a summary and JUnit XML.
    Bench(external::Args),
    /// Give a board a new policy over its serial line, without flashing it anew, or take one back.
    Update(external::Args),
    /// Make a pair of keys for signed policies.
    Keygen(keygen::Args),
    /// Write a policy of an older format version in the newest one.
    Convert(convert::Args),
    /// Sign a policy, or verify its signature.
    Sign(sign::Args),
    /// Say what an exported policy contains and needs.
    Inspect(inspect::Args),
    /// Say which inputs a policy's score owes something to, which programs act when, and which memory they use.
    Explain(explain::Args),
    /// Write a policy as source code, in Rust or C, that decides alike.
    Export(export::Args),
    /// Build firmware for a policy, run it on an emulated board and say what it takes.
    Footprint(footprint::Args),
    /// Compare variants over tasks and seeds, as an experiment's file describes.
    Experiment(experiment::Args),
    /// Decide again what a trace recorded and name the first decision that differs.
    Replay(replay::Args),
    /// List the presets that `tpg train` knows.
    Presets(presets::Args),
    /// Print every key of a configuration with its meaning, its default and its value.
    Config(config::Args),
    /// Say what of this machine works with this program, and what to do about the rest.
    Doctor(doctor::Args),
    /// Print a script that lets a shell complete the words of this command.
    Completions(completions::Args),
    /// Write manual pages, one for each verb.
    Man(man::Args),
}

fn main() -> ExitCode {
    let result = match Cli::parse().verb {
        Verb::Train(args) => train::run(args),
        Verb::Eval(args) => eval::run(args),
        Verb::Hil(args) => external::run("tpg-hil", &args),
        Verb::Bench(args) => external::run("tpg-bench", &args),
        Verb::Update(args) => external::run("tpg-update", &args),
        Verb::Keygen(args) => keygen::run(&args),
        Verb::Convert(args) => convert::run(&args),
        Verb::Sign(args) => sign::run(&args),
        Verb::Inspect(args) => inspect::run(&args),
        Verb::Explain(args) => explain::run(args),
        Verb::Export(args) => export::run(&args),
        Verb::Footprint(args) => footprint::run(&args),
        Verb::Experiment(args) => experiment::run(&args),
        Verb::Replay(args) => replay::run(&args),
        Verb::Presets(args) => presets::run(&args),
        Verb::Config(args) => config::run(&args),
        Verb::Doctor(args) => doctor::run(&args),
        Verb::Completions(args) => completions::run(&args, Cli::command()),
        Verb::Man(args) => man::run(&args, Cli::command()),
    };
    match result {
        Ok(status) => status.into(),
        Err(failure) => report(&failure),
    }
}
