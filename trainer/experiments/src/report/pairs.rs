//! Which variants of a task differ: by the thesis's test, and by the one over seeds that it lacks.

use super::load::{Group, Results};
use super::table::{Column, Field, Table, probability};
use tpg_tasks::stats::{MannWhitney, holm, mann_whitney, smallest_p};

/// The level of significance, the thesis's.
const ALPHA: f64 = 0.05;

/// Two variants of a task and what the tests say.
struct Pair<'a> {
    groups: [&'a Group; 2],
    episodes: Option<MannWhitney>,
    seeds: Option<MannWhitney>,
    seeds_corrected: f64,
}

/// The table of all pairs of variants, task by task.
pub(super) fn pairs(results: &Results, there: &str) -> Table {
    let chapter = results.experiment.chapter;
    let columns = vec![
        Column::new("task", "task"),
        Column::new("first", "first"),
        Column::new("second", "second"),
        Column::new("episodes_u", ""),
        Column::new("episodes_p", "p over episodes"),
        Column::new("episodes_delta", "delta"),
        Column::new("episodes_verdict", "as the thesis tests"),
        Column::new("runs_first", ""),
        Column::new("runs_second", ""),
        Column::new("", "runs"),
        Column::new("seeds_u", ""),
        Column::new("seeds_p", "p over seeds"),
        Column::new("seeds_p_holm", "Holm"),
        Column::new("seeds_delta", "delta"),
        Column::new("seeds_exact", ""),
        Column::new("seeds_verdict", "over seeds"),
    ];
    let mut rows = Vec::new();
    let mut reach = Vec::new();
    for task in results.tasks() {
        let pairs = of_task(results, task);
        if pairs.is_empty() {
            continue;
        }
        reach.push(reachable(task, &pairs));
        rows.extend(pairs.iter().map(|pair| row(task, pair)));
    }
    reach.dedup_by(|b, a| {
        a.1 == b.1 && {
            a.0.push_str(", ");
            a.0.push_str(&b.0);
            true
        }
    });
    let mut notes = vec![there.to_owned(), method(chapter).to_owned()];
    notes.extend(
        reach
            .into_iter()
            .map(|(tasks, text)| format!("{tasks}: {text}")),
    );
    Table {
        name: "pairs".into(),
        title: "Pairs of variants".into(),
        columns,
        rows,
        notes,
    }
}

fn method(chapter: Option<u8>) -> &'static str {
    if chapter == Some(2) {
        "As the thesis tests (T §2.5.5): two-sided Mann-Whitney U test at 0.05 of the test returns of all champions of a variant, pooled over runs, \
         without correction for several tests; the thesis compares with per-episode only. Episodes of one champion are no independent runs, \
         so that test speaks of these champions alone. Over seeds: the same test of one number for each run, its champion's test mean, \
         exact where there are no ties, corrected by Holm over all pairs of the task. Delta is Cliff's: 1 if the first is always greater, −1 if it never is."
    } else {
        "As the thesis tests (T §3.7): two-sided Mann-Whitney U test at 0.05 of the test returns of each variant's best champion in training, \
         without correction for several tests. Episodes of one champion are no independent runs, so that test speaks of these two champions alone. \
         Over seeds: the same test of one number for each run, its champion's test mean, \
         exact where there are no ties, corrected by Holm over all pairs of the task. Delta is Cliff's: 1 if the first is always greater, −1 if it never is."
    }
}

fn of_task<'a>(results: &'a Results, task: &'a str) -> Vec<Pair<'a>> {
    let groups: Vec<&Group> = results.of_task(task).collect();
    let mut pairs = Vec::new();
    for (i, first) in groups.iter().copied().enumerate() {
        for second in groups[i + 1..].iter().copied() {
            let chapter = results.experiment.chapter;
            pairs.push(Pair {
                groups: [first, second],
                episodes: mann_whitney(&episodes(first, chapter), &episodes(second, chapter)),
                seeds: mann_whitney(&first.test_means(), &second.test_means()),
                seeds_corrected: f64::NAN,
            });
        }
    }
    // What cannot be tested is not distinguishable either.
    let p: Vec<f64> = pairs
        .iter()
        .map(|pair| pair.seeds.map_or(1.0, |test| test.p))
        .collect();
    for (pair, corrected) in pairs.iter_mut().zip(holm(&p)) {
        pair.seeds_corrected = corrected;
    }
    pairs
}

/// The returns that the thesis tests: in chapter 2 of every champion, in chapter 3 of the best one.
fn episodes(group: &Group, chapter: Option<u8>) -> Vec<f64> {
    if chapter == Some(2) {
        let runs = group.runs.iter();
        runs.flat_map(|run| run.row.test_returns.iter().copied())
            .collect()
    } else {
        let best = group.best_trained();
        best.map(|run| run.row.test_returns.clone())
            .unwrap_or_default()
    }
}

/// The least p-values that the runs of a task can reach, and what follows.
fn reachable(task: &str, pairs: &[Pair]) -> (String, String) {
    let sizes = pairs
        .iter()
        .map(|pair| pair.groups.map(|group| group.runs.len()));
    let least = sizes.map(|[n, m]| smallest_p(n, m)).fold(1.0, f64::min);
    let fewest = pairs
        .iter()
        .flat_map(|pair| pair.groups)
        .map(|group| group.runs.len())
        .min();
    let most = pairs
        .iter()
        .flat_map(|pair| pair.groups)
        .map(|group| group.runs.len())
        .max();
    let runs = match (fewest, most) {
        (Some(fewest), Some(most)) if fewest != most => format!("{fewest} to {most}"),
        (_, most) => most.unwrap_or(0).to_string(),
    };
    let corrected = (least * pairs.len() as f64).min(1.0);
    let mut text = format!(
        "over {runs} runs a side no p can be below {}, nor the least of {} pairs below {} after Holm's correction",
        probability(least),
        pairs.len(),
        probability(corrected),
    );
    text += if corrected >= ALPHA {
        "; **this budget has too few runs to tell any pair apart over seeds**."
    } else {
        "."
    };
    (task.to_owned(), text)
}

fn row(task: &str, pair: &Pair) -> Vec<Field> {
    let [first, second] = pair.groups;
    let value = |test: Option<MannWhitney>, of: fn(MannWhitney) -> f64| test.map_or(f64::NAN, of);
    let (n, m) = (first.runs.len(), second.runs.len());
    let runs = if n == m {
        n.to_string()
    } else {
        format!("{n}, {m}")
    };
    vec![
        Field::text(task),
        Field::text(&first.variant),
        Field::text(&second.variant),
        Field::Number(value(pair.episodes, |test| test.u), 1),
        Field::P(value(pair.episodes, |test| test.p)),
        Field::Number(value(pair.episodes, |test| test.delta), 2),
        Field::text(match pair.episodes {
            None => "not tested",
            Some(test) if test.p >= ALPHA => "no difference shown",
            Some(test) => greater(test),
        }),
        Field::Count(n as u64),
        Field::Count(m as u64),
        Field::Shown(runs),
        Field::Number(value(pair.seeds, |test| test.u), 1),
        Field::P(value(pair.seeds, |test| test.p)),
        Field::P(pair.seeds_corrected),
        Field::Number(value(pair.seeds, |test| test.delta), 2),
        Field::text(
            pair.seeds
                .map_or("", |test| if test.exact { "yes" } else { "no" }),
        ),
        Field::text(match pair.seeds {
            Some(test) if pair.seeds_corrected < ALPHA => greater(test),
            _ => "not distinguishable at this budget",
        }),
    ]
}

fn greater(test: MannWhitney) -> &'static str {
    if test.delta > 0.0 {
        "first is greater"
    } else {
        "second is greater"
    }
}
