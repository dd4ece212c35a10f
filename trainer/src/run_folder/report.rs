//! The page of a run: `report.html` in its folder.

use std::path::{Path, PathBuf};

use tpg_runtime::{Capacities, Policy};
use tpg_tasks::console::command_line;

use super::RunFile;
use super::begun::Begun;
use super::history::History;
use crate::config::Config;
use crate::report_page::{Chart, Link, Page, Series, Table, settings};

/// Name of the page in the folder.
pub(super) const NAME: &str = "report.html";
/// Name under which the page looks for a drawing of the champion.
const VIEW: &str = "view.html";

/// What a champion is and takes, from its file's bytes: names and values.
pub(super) fn card(blob: &[u8]) -> Vec<[String; 2]> {
    let Ok(policy) = Policy::load(blob) else {
        return Vec::new();
    };
    let (header, bounds) = (policy.header(), policy.bounds());
    let card = [
        ("teams", header.teams.to_string()),
        ("programs", header.programs.to_string()),
        ("instructions", policy.tables().code.len().to_string()),
        (
            "at most for a decision",
            format!("{} instructions", bounds.instructions),
        ),
        (
            "state",
            format!("{} bytes", Capacities::needed_by(header).state_bytes()),
        ),
        ("file", format!("{} bytes", blob.len())),
        ("registers", header.register_mode.name().to_owned()),
        ("memory", header.memory_model.name().to_owned()),
        (
            "control period",
            format!("{} ms", f64::from(header.control_period_us) / 1000.0),
        ),
    ];
    card.map(|(name, value)| [name.to_owned(), value]).into()
}

/// The page of a run as it stands.
pub(super) fn page(
    folder: &Path,
    run: &RunFile,
    config: &Config,
    history: &History,
    card: &[[String; 2]],
) -> Page {
    let last = history.last();
    let number = |value: Option<u64>| value.unwrap_or(0).to_string();
    let mut facts = vec![
        ("preset", run.preset.clone()),
        ("seed", run.seed.to_string()),
        ("generations", number(last.map(|row| row.generation))),
        ("steps", number(last.map(|row| row.steps))),
        (
            "minutes",
            format!("{:.1}", last.map_or(0.0, |row| row.seconds / 60.0)),
        ),
        ("tpg", run.made_with.tpg.clone()),
        ("MuJoCo", run.made_with.mujoco.clone()),
        (
            "command",
            command_line(run.command.iter().map(String::as_str)),
        ),
    ];
    facts.extend(run.begun.iter().flat_map(Begun::facts));
    let mut tables = Vec::new();
    if let Some(row) = last {
        let mut rows = vec![["training score".to_owned(), format!("{:.2}", row.best)]];
        if let Some(select) = row.select {
            rows.push(["mean of its last race".to_owned(), format!("{select:.2}")]);
        }
        rows.extend_from_slice(card);
        tables.push(Table {
            title: "champion".into(),
            head: vec!["what".into(), "value".into()],
            rows: rows.into_iter().map(Vec::from).collect(),
        });
    }
    let link = |(label, path): (&str, &str)| Link {
        label: label.into(),
        path: path.into(),
    };
    let files = [
        ("view of the champion", VIEW),
        ("champion.tpg", "champion.tpg"),
        ("log.csv", "log.csv"),
        ("config.toml", "config.toml"),
        ("run.toml", "run.toml"),
    ];
    let there = files
        .into_iter()
        .filter(|(_, path)| folder.join(path).exists());
    Page {
        title: format!("{}, seed {}", run.preset, run.seed),
        facts: (facts.into_iter())
            .map(|(name, value)| [name.to_owned(), value])
            .collect(),
        runs: vec![history.run()],
        charts: charts(),
        tables,
        settings: settings(config),
        links: there.map(link).collect(),
    }
}

fn charts() -> Vec<Chart> {
    let chart = |title: &str, note: &str, columns: &[(&str, &'static str)]| Chart {
        title: title.into(),
        note: note.into(),
        series: columns
            .iter()
            .map(|(label, column)| Series {
                label: (*label).into(),
                group: String::new(),
                column,
            })
            .collect(),
    };
    vec![
        chart(
            "score",
            "mean return of training episodes; fresh episodes give less",
            &[
                ("champion", "best"),
                ("champion in races", "select"),
                ("mean of the survivors", "mean"),
            ],
        ),
        chart(
            "instructions of the champion",
            "",
            &[
                ("for a decision, mean", "instructions_mean"),
                ("in its programs", "champion_instructions"),
            ],
        ),
        chart(
            "graph of the champion",
            "",
            &[
                ("programs", "champion_programs"),
                ("teams", "champion_teams"),
            ],
        ),
        chart(
            "population",
            "",
            &[("programs", "programs"), ("teams", "teams")],
        ),
    ]
}

/// The page's file in a run's folder.
pub(super) fn path(folder: &Path) -> PathBuf {
    folder.join(NAME)
}
