//! What a run's page shows of its past: the rows of the log, fewer of them where there are many.

use std::path::Path;

use super::error::{RunFolderError, malformed};
use crate::report_page::{Run, rounded};
use crate::session::GenerationReport;

/// Rows above which every second one is dropped.
const MOST: usize = 3000;

/// Rows of a run, evenly spread over its generations.
#[derive(Debug, Default)]
pub(super) struct History {
    rows: Vec<GenerationReport>,
    /// Only every so many rows is kept; 0 stands for 1.
    stride: u64,
    seen: u64,
    /// The last row, which is shown though it may not be kept.
    last: Option<GenerationReport>,
}

/// A column of the page, and where it comes from.
type Column = (&'static str, fn(&GenerationReport) -> f64);

const COLUMNS: [Column; 9] = [
    ("best", |row| row.best),
    ("select", |row| row.select.unwrap_or(f64::NAN)),
    ("mean", |row| row.mean),
    ("instructions_mean", |row| row.instructions_mean),
    ("champion_instructions", |row| {
        row.champion_instructions.into()
    }),
    ("champion_programs", |row| row.champion_programs.into()),
    ("champion_teams", |row| row.champion_teams.into()),
    ("teams", |row| row.teams as f64),
    ("programs", |row| row.programs as f64),
];

impl History {
    /// The past of a run that goes on, from its log.
    pub(super) fn read(path: &Path) -> Result<Self, RunFolderError> {
        let bad = |error: csv::Error| malformed(path, &error.to_string());
        let mut history = History::default();
        for row in csv::Reader::from_path(path).map_err(bad)?.deserialize() {
            history.push(&row.map_err(bad)?);
        }
        Ok(history)
    }

    pub(super) fn push(&mut self, row: &GenerationReport) {
        if self.seen.is_multiple_of(self.stride.max(1)) {
            self.rows.push(row.clone());
        }
        self.seen += 1;
        self.last = Some(row.clone());
        if self.rows.len() > MOST {
            let mut number = 0;
            self.rows.retain(|_| {
                number += 1;
                number % 2 == 1
            });
            self.stride = 2 * self.stride.max(1);
        }
    }

    /// The last row.
    pub(super) fn last(&self) -> Option<&GenerationReport> {
        self.last.as_ref()
    }

    /// The rows as a page draws them.
    pub(super) fn run(&self) -> Run {
        let kept = self.rows.last().map(|row| row.generation);
        let last = self.last.iter();
        let last = last.filter(|row| Some(row.generation) != kept);
        let rows: Vec<&GenerationReport> = self.rows.iter().chain(last).collect();
        let column = |of: &dyn Fn(&GenerationReport) -> f64| -> Vec<Option<f64>> {
            rows.iter().map(|row| rounded(of(row))).collect()
        };
        Run {
            group: String::new(),
            generations: rows.iter().map(|row| row.generation).collect(),
            steps: rows.iter().map(|row| row.steps).collect(),
            minutes: (rows.iter())
                .filter_map(|row| rounded(row.seconds / 60.0))
                .collect(),
            columns: (COLUMNS.iter())
                .map(|(name, of)| (*name, column(of)))
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(generation: u64) -> GenerationReport {
        GenerationReport {
            generation,
            steps: 10 * generation,
            best: generation as f64,
            fitness: 0.0,
            select: None,
            mean: f64::NEG_INFINITY,
            champion: 0,
            champion_teams: 1,
            champion_programs: 1,
            champion_instructions: 1,
            instructions_mean: 1.0,
            teams: 1,
            programs: 1,
            unscorable: 0,
            unstable: 0,
            episodes: 0,
            seconds: 60.0 * generation as f64,
        }
    }

    #[test]
    fn a_long_run_is_thinned_out_and_keeps_both_ends() {
        let mut history = History::default();
        for generation in 1..=100_001 {
            history.push(&row(generation));
        }
        let run = history.run();
        let count = run.generations.len();
        assert!((MOST / 2..=MOST + 1).contains(&count), "{count}");
        assert_eq!(
            (run.generations[0], run.generations[count - 1]),
            (1, 100_001)
        );
        let gaps = run.generations.windows(2).map(|pair| pair[1] - pair[0]);
        let gaps: Vec<u64> = gaps.collect();
        assert!(
            gaps[..count - 2].iter().all(|gap| *gap == gaps[0]),
            "evenly"
        );
        assert!(run.columns.iter().all(|(_, values)| values.len() == count));
        assert_eq!(run.minutes[count - 1].to_bits(), 100_001f64.to_bits());
    }

    #[test]
    fn what_is_not_finite_is_missing() {
        let mut history = History::default();
        history.push(&row(1));
        let run = history.run();
        let column = |name: &str| {
            let mut columns = run.columns.iter();
            columns.find(|(column, _)| *column == name).expect("it").1[0]
        };
        assert_eq!(
            (column("best"), column("mean"), column("select")),
            (Some(1.0), None, None)
        );
    }
}
