//! What champions lose when they forget.

use super::load::{Group, Results};
use super::table::{Column, Field, Table, mean_over_runs};
use crate::row::{Ablation, Forgets};
use tpg_tasks::stats::{bootstrap_mean_95, mean};

const KINDS: [(Forgets, &str); 3] = [
    (Forgets::Registers, "registers"),
    (Forgets::Memory, "shared memory"),
    (Forgets::All, "both"),
];

/// The drop of each variant's champions when they forget; `None` if nothing of them outlives a decision.
pub(super) fn ablations(results: &Results, there: &str) -> Option<Table> {
    let columns = vec![
        Column::new("task", "task"),
        Column::new("variant", "variant"),
        Column::new("forgets", "what is forgotten"),
        Column::new("runs", "runs"),
        Column::new("test_mean", "test mean"),
        Column::new("forgetful_mean", "mean if forgotten"),
        Column::new("drop", ""),
        Column::new("drop_low", ""),
        Column::new("drop_high", ""),
        Column::new("", "drop [95 %]"),
        Column::new("losers", "champions that lose"),
    ];
    let rows: Vec<Vec<Field>> = (results.groups.iter())
        .flat_map(|group| {
            KINDS
                .into_iter()
                .filter_map(|(kind, name)| row(group, kind, name))
        })
        .collect();
    if rows.is_empty() {
        return None;
    }
    Some(Table {
        name: "ablations".into(),
        title: "What champions lose when they forget".into(),
        columns,
        rows,
        notes: vec![
            there.to_owned(),
            "Registers, shared memory or both are at their evolved constants before every decision, as with `tpg eval --ablate`. The drop is that of \
             each run's mean over its test episodes, and its interval a 95 % bootstrap over runs (none of a single run). A champion loses if the 95 % \
             bootstrap interval of its own drop, over paired episodes, lies above zero."
                .to_owned(),
        ],
    })
}

fn row(group: &Group, kind: Forgets, name: &str) -> Option<Vec<Field>> {
    let runs: Vec<(&[f64], &Ablation)> = (group.runs.iter())
        .filter_map(|run| {
            let ablation = run.ablations.iter().find(|a| a.forgets == kind)?;
            Some((run.row.test_returns.as_slice(), ablation))
        })
        .collect();
    if runs.is_empty() {
        return None;
    }
    let of_episodes = |(whole, ablation): &(&[f64], &Ablation)| -> Vec<f64> {
        whole
            .iter()
            .zip(&ablation.test_returns)
            .map(|(a, b)| a - b)
            .collect()
    };
    let drops: Vec<f64> = runs.iter().map(|run| mean(&of_episodes(run))).collect();
    let losers = runs
        .iter()
        .filter(|run| bootstrap_mean_95(&of_episodes(run))[0] > 0.0);
    let [drop, low, high, shown] = mean_over_runs(&drops);
    let whole: Vec<f64> = runs.iter().map(|(returns, _)| mean(returns)).collect();
    let forgetful: Vec<f64> = runs
        .iter()
        .map(|(_, ablation)| ablation.test_mean)
        .collect();
    Some(vec![
        Field::text(&group.task),
        Field::text(&group.variant),
        Field::text(name),
        Field::Count(runs.len() as u64),
        Field::Number(mean(&whole), 2),
        Field::Number(mean(&forgetful), 2),
        drop,
        low,
        high,
        shown,
        Field::Text(format!("{} of {}", losers.count(), runs.len())),
    ])
}
