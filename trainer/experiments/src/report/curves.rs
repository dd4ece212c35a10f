//! Learning curves over runs: T Fig 2.4 to 2.6 and 3.5.

use std::ops::Range;

use super::figure::{Figure, Look, Mark, Panel, Ticks};
use super::load::{Group, Results, Run};
use crate::row::CurvePoint;
use tpg_tasks::stats;

/// Points of a line at most; curves hold about as many.
const POINTS: usize = 101;

/// What a band shows around the mean over runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Band {
    /// From the least to the greatest run, as in chapter 2.
    Range,
    /// One standard deviation each way, as in chapter 3, but not beyond the least and the greatest run.
    Deviation,
}

/// What the x-axis shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Progress {
    Generations,
    Steps,
    Time,
}

/// What the y-axis shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Measure {
    Score,
    Instructions,
}

impl Progress {
    /// In generations, environment steps, or the decimal logarithm of seconds: variants that train as many generations differ in time by orders
    /// of magnitude.
    fn of(self, point: &CurvePoint) -> f64 {
        match self {
            Progress::Generations => point.generation as f64,
            Progress::Steps => point.steps as f64,
            Progress::Time => point.seconds.max(1e-3).log10(),
        }
    }
}

impl Measure {
    fn of(self, point: &CurvePoint) -> f64 {
        match self {
            Measure::Score => point.best,
            Measure::Instructions => point.instructions_mean,
        }
    }

    fn label(self) -> &'static str {
        match self {
            Measure::Score => "training score",
            Measure::Instructions => "instructions per decision",
        }
    }
}

/// More variants than this have a panel each, since no more looks can be told apart.
const MOST_TOGETHER: usize = 7;
/// Panels side by side where each variant has its own.
const COLUMNS: usize = 4;

/// The figures of learning curves, with their names: the thesis's where the experiment repeats a chapter, and always the score over
/// environment steps.
pub(super) fn figures(results: &Results) -> Vec<(String, Figure)> {
    let row = |progress, measure, band| -> Vec<Panel> {
        let tasks = results.tasks().into_iter();
        tasks
            .map(|task| {
                let groups: Vec<&Group> = results.of_task(task).collect();
                panel(task, &groups, progress, measure, band)
            })
            .collect()
    };
    let figure = |name: &str, title: &str, rows| {
        let figure = Figure {
            title: title.to_owned(),
            rows,
            legend: legend(results),
        };
        (name.to_owned(), figure)
    };
    let over_steps =
        "Score over environment steps: mean ± standard deviation over runs, within their range";
    if results.experiment.variants.len() > MOST_TOGETHER {
        return results
            .tasks()
            .into_iter()
            .map(|task| {
                let figure = Figure {
                    title: format!("{task}. {over_steps}"),
                    rows: apart(results, task),
                    legend: reference_legend(results),
                };
                (format!("score-over-steps-{task}"), figure)
            })
            .collect();
    }
    let steps = figure(
        "score-over-steps",
        over_steps,
        vec![row(Progress::Steps, Measure::Score, Band::Deviation)],
    );
    match results.experiment.chapter {
        Some(2) => {
            let range = |progress, measure| vec![row(progress, measure, Band::Range)];
            vec![
                figure(
                    "figure-2.4",
                    "Score over time (as T Fig 2.4): mean over runs, band from least to greatest",
                    range(Progress::Time, Measure::Score),
                ),
                figure(
                    "figure-2.5",
                    "Score over generations (as T Fig 2.5): mean over runs, band from least to greatest",
                    range(Progress::Generations, Measure::Score),
                ),
                figure(
                    "figure-2.6",
                    "Complexity over generations (as T Fig 2.6): mean over runs, band from least to greatest",
                    range(Progress::Generations, Measure::Instructions),
                ),
                steps,
            ]
        }
        Some(_) => {
            let row = |measure| row(Progress::Generations, measure, Band::Deviation);
            let figure = figure(
                "figure-3.5",
                "Score and complexity over generations (as T Fig 3.5): mean ± standard deviation over runs, within their range",
                vec![row(Measure::Score), row(Measure::Instructions)],
            );
            vec![figure, steps]
        }
        None => vec![steps],
    }
}

/// Panels of a task, one for each variant beside the first one, which is what they are compared with.
fn apart(results: &Results, task: &str) -> Vec<Vec<Panel>> {
    let groups: Vec<&Group> = results.of_task(task).collect();
    let ends = groups
        .iter()
        .map(|group| common_end(&[*group], Progress::Steps));
    let end = ends.fold(0.0, f64::max);
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut panels = Vec::new();
    for group in &groups {
        let mut shown = vec![*group];
        shown.extend(groups.iter().filter(|g| g.series == 0 && group.series != 0));
        let mut panel = panel(
            task,
            &shown,
            Progress::Steps,
            Measure::Score,
            Band::Deviation,
        );
        panel.title.clone_from(&group.variant);
        panel.x = axis(panel.x.start, end);
        for mark in &mut panel.marks {
            if let Mark::Line(look, _) = mark {
                *look = Look::new(usize::from(*look == Look::new(0)));
            }
        }
        let range = panel.y_range();
        (low, high) = (low.min(range.start), high.max(range.end));
        panels.push(panel);
    }
    for panel in &mut panels {
        panel.y = Some(low..high);
    }
    let mut panels = panels.into_iter().peekable();
    let mut rows = Vec::new();
    while panels.peek().is_some() {
        rows.push(panels.by_ref().take(COLUMNS).collect());
    }
    rows
}

/// The legend of panels that show one variant each, beside the first of all.
fn reference_legend(results: &Results) -> Vec<(String, Look)> {
    let first = results.experiment.variants.first().cloned();
    vec![
        ("the variant".to_owned(), Look::new(0)),
        (first.unwrap_or_default(), Look::new(1)),
    ]
}

/// The variants that have runs.
fn legend(results: &Results) -> Vec<(String, Look)> {
    let variants = results.experiment.variants.iter().enumerate();
    let drawn = variants.filter(|(series, _)| {
        let mut groups = results.groups.iter();
        groups.any(|group| group.series == *series && !group.runs.is_empty())
    });
    drawn
        .map(|(series, name)| (name.clone(), Look::new(series)))
        .collect()
}

fn panel(task: &str, groups: &[&Group], progress: Progress, measure: Measure, band: Band) -> Panel {
    let end = match progress {
        Progress::Generations => common_end(groups, progress),
        // Each variant is drawn as long as all its runs last.
        Progress::Steps | Progress::Time => {
            let ends = groups.iter().map(|group| common_end(&[*group], progress));
            ends.fold(f64::NEG_INFINITY, f64::max)
        }
    };
    let (unit, x_label, x_ticks) = match progress {
        Progress::Generations => (0.0, "generation", Ticks::Whole),
        Progress::Steps => (0.0, "environment steps", Ticks::Numbers),
        Progress::Time if end >= 3600f64.log10() => {
            (3600f64.log10(), "hours of training", Ticks::Logarithms)
        }
        Progress::Time if end >= 60f64.log10() => {
            (60f64.log10(), "minutes of training", Ticks::Logarithms)
        }
        Progress::Time => (0.0, "seconds of training", Ticks::Logarithms),
    };
    let marks = groups.iter().map(|group| {
        let end = match progress {
            Progress::Generations => end,
            Progress::Steps | Progress::Time => common_end(&[*group], progress),
        };
        let xs = grid(&(start(&group.runs, progress)..end), progress);
        let points = xs.into_iter().filter_map(|x| {
            let values: Vec<f64> = group
                .runs
                .iter()
                .map(|run| interpolated(run, progress, measure, x))
                .filter(|y| y.is_finite())
                .collect();
            let [low, middle, high] = spread(&values, band)?;
            Some([x - unit, low, middle, high])
        });
        Mark::Line(Look::new(group.series), points.collect())
    });
    let marks = marks.collect();
    let starts = groups.iter().map(|group| start(&group.runs, progress));
    let from = starts.fold(f64::INFINITY, f64::min) - unit;
    let to = end - unit;
    let runs = groups.iter().map(|group| group.runs.len());
    let runs = match (runs.clone().min(), runs.max()) {
        (Some(least), Some(most)) if least != most => format!("{least}–{most} runs"),
        (_, Some(1)) => "1 run".to_owned(),
        (_, most) => format!("{} runs", most.unwrap_or(0)),
    };
    Panel {
        title: format!("{task} ({runs})"),
        x_label: x_label.to_owned(),
        y_label: measure.label().to_owned(),
        x: axis(from, to),
        y: None,
        x_ticks,
        marks,
        note: None,
    }
}

/// The ends of an axis; one point alone, or none, still needs one.
fn axis(from: f64, to: f64) -> Range<f64> {
    match (from.is_finite(), from < to && to.is_finite()) {
        (true, true) => from..to,
        (true, false) => from - 0.5..from + 0.5,
        (false, _) => 0.0..1.0,
    }
}

/// Where the last run to begin has its first point.
fn start(runs: &[Run], progress: Progress) -> f64 {
    let firsts = runs.iter().filter_map(|run| run.curve.first());
    let starts = firsts.map(|point| progress.of(point));
    starts.fold(f64::NEG_INFINITY, f64::max)
}

/// Where the first run of these variants ends: the thesis cuts its curves there.
fn common_end(groups: &[&Group], progress: Progress) -> f64 {
    let runs = groups.iter().flat_map(|group| &group.runs);
    let lasts = runs.filter_map(|run| run.curve.last());
    let ends = lasts.map(|point| progress.of(point));
    ends.fold(f64::INFINITY, f64::min)
}

/// Where lines have points.
fn grid(range: &Range<f64>, progress: Progress) -> Vec<f64> {
    let whole = range.start.is_finite() && range.end.is_finite() && range.start <= range.end;
    if !whole {
        return Vec::new();
    }
    let steps = (POINTS - 1) as f64;
    let length = range.end - range.start;
    let mut xs: Vec<f64> = match progress {
        Progress::Generations if length <= steps => (0..=length as u64)
            .map(|i| range.start + i as f64)
            .collect(),
        Progress::Generations => (0..POINTS)
            .map(|i| (range.start + length * i as f64 / steps).round())
            .collect(),
        Progress::Steps | Progress::Time => (0..POINTS)
            .map(|i| range.start + length * i as f64 / steps)
            .collect(),
    };
    xs.dedup();
    xs
}

/// A run's value at a place between two points of its curve; NaN outside.
fn interpolated(run: &Run, progress: Progress, measure: Measure, x: f64) -> f64 {
    let after = run.curve.partition_point(|point| progress.of(point) < x);
    let Some(next) = run.curve.get(after) else {
        // Rounding may put the end of the grid past the last point.
        return run.curve.last().map_or(f64::NAN, |point| measure.of(point));
    };
    let (x1, y1) = (progress.of(next), measure.of(next));
    match after.checked_sub(1).map(|i| &run.curve[i]) {
        Some(previous) if x1 > x => {
            let (x0, y0) = (progress.of(previous), measure.of(previous));
            y0 + (y1 - y0) * (x - x0) / (x1 - x0)
        }
        _ => y1,
    }
}

/// Low, middle and high of a band; nothing without runs.
fn spread(values: &[f64], band: Band) -> Option<[f64; 3]> {
    if values.is_empty() {
        return None;
    }
    let mean = stats::mean(values);
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let greatest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let [low, high] = match band {
        Band::Range => [least, greatest],
        // No run is outside, so the band is not either: a score has bounds that a deviation does not know.
        Band::Deviation => {
            let deviation = stats::standard_deviation(values);
            [
                (mean - deviation).max(least),
                (mean + deviation).min(greatest),
            ]
        }
    };
    Some([low, mean, high])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_are_the_chapters() {
        let range = spread(&[1.0, 2.0, 6.0], Band::Range);
        assert_eq!(range.map(|band| band.map(|x| x as i32)), Some([1, 3, 6]));
        let deviation = spread(&[1.0, 3.0, 3.0, 5.0], Band::Deviation);
        let tenths = deviation.map(|band| band.map(|x| (10.0 * x) as i32));
        assert_eq!(tenths, Some([13, 30, 46]));
        // A deviation of 52 around a mean of 30 would reach below 0 and above 90.
        let skew = spread(&[0.0, 0.0, 90.0], Band::Deviation);
        assert_eq!(skew.map(|band| band.map(|x| x as i32)), Some([0, 30, 81]));
        assert_eq!(spread(&[], Band::Range), None);
    }

    #[test]
    fn the_grid_keeps_whole_generations() {
        assert_eq!(grid(&(1.0..4.0), Progress::Generations).len(), 4);
        let long = grid(&(1.0..1000.0), Progress::Generations);
        assert_eq!(long.len(), POINTS);
        assert!(long.iter().all(|x| (x - x.round()).abs() < 1e-12));
    }
}
