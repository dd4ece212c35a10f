//! `tpg config`

use std::path::{Path, PathBuf};

use tpg_tasks::console::print;
use tpg_tasks::exit_status::{Failure, Fault as _, Status};
use tpg_tasks::task::locate;
use tpg_trainer::config::{Config, Preset, documented, resolve};

/// Arguments of `tpg config`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    tpg config hopper-champion\n  \
    tpg config hopper-sr-sm > mine.toml    # edit it, then: tpg train hopper-sr-sm --config mine.toml")]
pub(crate) struct Args {
    /// Preset, see `tpg presets`; also a variant alone, such as sr-sm or sl-b13.
    preset: String,
    /// Task in place of the preset's: its name, or the path of the TOML file that describes it.
    #[arg(long, value_name = "TASK")]
    task: Option<String>,
    /// Override a key of the configuration, such as evolution.population=200; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// TOML file whose keys override the preset's.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
}

pub(crate) fn run(args: &Args) -> Result<Status, Failure> {
    let Args { preset, sets, .. } = args;
    let (file, task) = (args.config.as_deref(), args.task.as_deref());
    let config = configuration(preset, file, sets, task)?;
    print(format_args!(
        "# Preset {preset}. Where no default is named, the value is the default.\n\n{}",
        documented(&config).trim_end()
    ))?;
    Ok(Status::Fine)
}

/// A preset with what a file, settings and the name of a task override, in this order.
pub(crate) fn configuration(
    preset: &str,
    file: Option<&Path>,
    sets: &[String],
    task: Option<&str>,
) -> Result<Config, Failure> {
    let preset = Preset::find(preset).or_usage("bad preset")?;
    let text = file.map(|path| {
        let shown = path.display();
        std::fs::read_to_string(path).or_bad_input(format!("cannot read {shown}"))
    });
    let text = text.transpose()?;
    let mut config = resolve(&preset, text.as_deref(), sets).or_usage("bad configuration")?;
    if let Some(task) = task {
        config.task = locate(task);
    }
    Ok(config)
}
