//! The main table and the table of throughput.

use super::load::{Group, Results};
use super::table::{Column, Field, Table, mean_over_runs};
use super::thesis;
use crate::row::Row;
use tpg_tasks::stats::median;

/// Scores of every variant of every task, the mean over fresh episodes first.
pub(super) fn scores(results: &Results, there: &str) -> Table {
    let thesis = results.experiment.chapter == Some(3);
    let repeats = results.experiment.repeats;
    let mut columns = vec![
        Column::new("task", "task"),
        Column::new("variant", "variant"),
        Column::new("runs", "runs"),
        Column::new("test_mean", ""),
        Column::new("test_mean_low", ""),
        Column::new("test_mean_high", ""),
        Column::new("", "test mean [95 %]"),
        Column::new("test_median", "median run"),
        Column::new("test_best", format!("best of {repeats} repeats")),
        Column::new("train_best", "best in training"),
        Column::new("instructions_per_decision", "instructions per decision"),
        Column::new("champion_instructions", ""),
        Column::new("unstable", ""),
    ];
    if thesis {
        columns.push(Column::new(
            "thesis_train_best",
            "thesis, best in training of 10",
        ));
    }
    let rows = results.groups.iter().map(|group| {
        let mut row = score_row(group);
        if thesis {
            let theirs = thesis::best_fitness(&group.task, &group.variant);
            row.push(Field::Number(theirs.unwrap_or(f64::NAN), 2));
        }
        row
    });
    let rows = rows.collect();
    let mut notes = vec![
        there.to_owned(),
        format!(
            "Test: each run's champion on {} fresh episodes. The mean over runs of those means comes first, with its 95 % bootstrap interval over runs \
             (none of a single run); median and best are of the same means. Best in training: the highest training score of any run, \
             as the thesis reports it; the episodes it was chosen on make it too high. Instructions are executed ones, over the test episodes.",
            results.experiment.test_episodes
        ),
    ];
    if thesis {
        notes.push(
            "Thesis: T Tab 3.3, the best training fitness of 10 runs under blackouts, beside `best in training` and nothing else, \
             and only where the physics agree: tasks with one step of physics in a control step, whose names end in skip1 (docs/training.md). \
             Which share of observations it hides its own sections tell differently (T §3.5.4)."
                .to_owned(),
        );
    }
    let runs = || results.groups.iter().flat_map(|group| &group.runs);
    let uncounted = runs()
        .filter(|run| run.row.instructions_mean.is_nan())
        .count();
    if uncounted > 0 {
        notes.push(format!(
            "The champions of {uncounted} runs are too large to be run as evolved: their instructions are not counted."
        ));
    }
    let unstable: u64 = runs().map(|run| u64::from(run.row.unstable)).sum();
    if unstable > 0 {
        notes.push(format!("An unstable simulation ended {unstable} of the test episodes; their returns up to there count."));
    }
    Table {
        name: "scores".into(),
        title: "Scores".into(),
        columns,
        rows,
        notes,
    }
}

fn score_row(group: &Group) -> Vec<Field> {
    let means = group.test_means();
    let [test_mean, low, high, shown] = mean_over_runs(&means);
    let greatest = |values: &[f64]| values.iter().copied().fold(f64::NAN, f64::max);
    let trained: Vec<f64> = group.runs.iter().map(|run| run.row.train_best).collect();
    vec![
        Field::text(&group.task),
        Field::text(&group.variant),
        Field::Count(group.runs.len() as u64),
        test_mean,
        low,
        high,
        shown,
        Field::Number(median(&means), 2),
        Field::Number(greatest(&means), 2),
        Field::Number(greatest(&trained), 2),
        Field::Number(group.mean(|row| row.instructions_mean), 1),
        Field::Number(group.mean(|row| f64::from(row.champion_instructions)), 1),
        Field::Count(
            group
                .runs
                .iter()
                .map(|run| u64::from(run.row.unstable))
                .sum(),
        ),
    ]
}

/// Generations and steps per hour of every variant of every task.
pub(super) fn throughput(results: &Results, there: &str) -> Table {
    let columns = vec![
        Column::new("task", "task"),
        Column::new("variant", "variant"),
        Column::new("runs", "runs"),
        Column::new("threads", "threads"),
        Column::new("generations_per_hour", "generations per hour"),
        Column::new("generations_per_cpu_hour", "generations per core and hour"),
        Column::new("steps_per_cpu_second", "steps per core and second"),
        Column::new("train_hours", "hours trained"),
        Column::new("cpu_hours", "core hours"),
    ];
    let rows = results.groups.iter().map(|group| {
        let total = |column: fn(&Row) -> f64| -> f64 {
            group.runs.iter().map(|run| column(&run.row)).sum()
        };
        let generations = total(|row| row.generations as f64);
        let hours = total(|row| row.train_seconds) / 3600.0;
        let cpu_hours = total(|row| row.cpu_seconds) / 3600.0;
        let mut threads: Vec<usize> = group.runs.iter().map(|run| run.row.threads).collect();
        threads.sort_unstable();
        threads.dedup();
        let threads: Vec<String> = threads.iter().map(ToString::to_string).collect();
        vec![
            Field::text(&group.task),
            Field::text(&group.variant),
            Field::Count(group.runs.len() as u64),
            Field::text(threads.join(" ")),
            Field::Number(generations / hours, 1),
            Field::Number(generations / cpu_hours, 1),
            Field::Number(total(|row| row.steps as f64) / (cpu_hours * 3600.0), 0),
            Field::Number(hours, 3),
            Field::Number(cpu_hours, 3),
        ]
    });
    Table {
        name: "throughput".into(),
        title: "Throughput of training".into(),
        columns,
        rows: rows.collect(),
        notes: vec![
            there.to_owned(),
            "Totals over runs: generations over seconds of training, and over the CPU seconds of all its threads. \
             What else the machine did shows in the first more than in the second."
                .to_owned(),
        ],
    }
}
