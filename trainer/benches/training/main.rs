//! What training costs, beside what the simulator alone costs.
//!
//! `cargo bench -p tpg-trainer --bench training [-- SECTION...]` prints Markdown tables; sections: `tasks`,
//! `physics`, `run`, `growth`, `native`; all without one. CPU time, except where a table says otherwise. Ratios are medians of rounds that
//! take turns, so that a busy machine touches both sides alike.

#[cfg(feature = "mujoco")]
mod fixture;
#[cfg(feature = "mujoco")]
mod growth;
mod native;
#[cfg(feature = "mujoco")]
mod physics;
#[cfg(feature = "mujoco")]
mod replay;
#[cfg(feature = "mujoco")]
mod run;
#[cfg(feature = "mujoco")]
mod tasks;

use std::time::Duration;

use tpg_trainer::config::{Config, Preset, resolve};

/// A section's name and what prints it.
type Section = (&'static str, fn());

const SECTIONS: &[Section] = &[
    #[cfg(feature = "mujoco")]
    ("tasks", tasks::print),
    #[cfg(feature = "mujoco")]
    ("physics", physics::print),
    #[cfg(feature = "mujoco")]
    ("run", run::print),
    #[cfg(feature = "mujoco")]
    ("growth", growth::print),
    ("native", native::print),
];

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    #[cfg(feature = "mujoco")]
    if let [first, rest @ ..] = args.as_slice()
        && first == growth::POINT
    {
        return growth::point(rest);
    }
    // Cargo adds `--bench`.
    let wanted: Vec<&String> = args.iter().filter(|a| !a.starts_with("--")).collect();
    for name in &wanted {
        if !SECTIONS.iter().any(|(section, _)| section == name) {
            let names: Vec<&str> = SECTIONS.iter().map(|(section, _)| *section).collect();
            eprintln!(
                "no section is called {name}; there are {}",
                names.join(", ")
            );
            std::process::exit(2);
        }
    }
    for (name, print) in SECTIONS {
        if wanted.is_empty() || wanted.iter().any(|w| w == name) {
            print();
        }
    }
}

/// A preset's configuration with some keys set.
fn config(preset: &str, sets: &[String]) -> Config {
    let preset = Preset::find(preset).expect("a preset of this project");
    resolve(&preset, None, sets).expect("keys of the configuration")
}

/// The middle value.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Events per second.
fn rate(count: u64, time: Duration) -> f64 {
    count as f64 / time.as_secs_f64()
}
