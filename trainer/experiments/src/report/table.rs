//! Tables as Markdown for people and as CSV for programs.

use std::fmt::Write as _;

use tpg_tasks::stats::{bootstrap_mean_95, mean};

/// A table with what must be said of it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Table {
    /// Name of its files, without an extension.
    pub(super) name: String,
    pub(super) title: String,
    pub(super) columns: Vec<Column>,
    pub(super) rows: Vec<Vec<Field>>,
    /// Sentences below the Markdown table.
    pub(super) notes: Vec<String>,
}

/// A column: its name for programs, and its heading for people.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Column {
    pub(super) key: &'static str,
    /// Empty: people do not need it, or see it in another column.
    pub(super) heading: String,
}

/// A field of a table.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Field {
    Text(String),
    Count(u64),
    /// A number, with this many digits after the point in Markdown; NaN: there is none.
    Number(f64, usize),
    /// A probability.
    P(f64),
    /// Both, for people; the parts have columns of their own.
    Shown(String),
}

impl Column {
    pub(super) fn new(key: &'static str, heading: impl Into<String>) -> Self {
        Column {
            key,
            heading: heading.into(),
        }
    }
}

/// The part of a column's key that says that the column is for people alone.
const SHOWN: &str = "";

impl Table {
    /// Markdown: title, table, notes.
    pub(super) fn markdown(&self) -> String {
        let shown: Vec<usize> = (0..self.columns.len())
            .filter(|&i| !self.columns[i].heading.is_empty())
            .collect();
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let mut text = format!("### {}\n\n", self.title);
        text += &line(
            shown
                .iter()
                .map(|&i| self.columns[i].heading.clone())
                .collect(),
        );
        text += &format!("|{}\n", "---|".repeat(shown.len()));
        for row in &self.rows {
            text += &line(shown.iter().map(|&i| row[i].markdown()).collect());
        }
        for note in &self.notes {
            // Writing to a string cannot fail.
            let _ = write!(text, "\n{note}\n");
        }
        text
    }

    /// CSV with full precision.
    pub(super) fn csv(&self) -> anyhow::Result<Vec<u8>> {
        let kept: Vec<usize> = (0..self.columns.len())
            .filter(|&i| self.columns[i].key != SHOWN)
            .collect();
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(kept.iter().map(|&i| self.columns[i].key))?;
        for row in &self.rows {
            writer.write_record(kept.iter().map(|&i| row[i].csv()))?;
        }
        Ok(writer.into_inner()?)
    }
}

impl Field {
    pub(super) fn text(text: impl Into<String>) -> Self {
        Field::Text(text.into())
    }

    fn markdown(&self) -> String {
        match self {
            Field::Text(text) | Field::Shown(text) => text.replace('|', "\\|"),
            Field::Count(n) => n.to_string(),
            Field::Number(x, digits) => number(*x, *digits),
            Field::P(p) => probability(*p),
        }
    }

    fn csv(&self) -> String {
        match self {
            Field::Text(text) | Field::Shown(text) => text.clone(),
            Field::Count(n) => n.to_string(),
            Field::Number(x, _) | Field::P(x) if x.is_nan() => String::new(),
            Field::Number(x, _) | Field::P(x) => x.to_string(),
        }
    }
}

/// A mean over runs and its 95 % bootstrap interval: mean, bounds, and all three for people. One run has no interval.
pub(super) fn mean_over_runs(values: &[f64]) -> [Field; 4] {
    let mean = mean(values);
    let [low, high] = match values.len() {
        0 | 1 => [f64::NAN; 2],
        _ => bootstrap_mean_95(values),
    };
    let [shown, least, most] = [mean, low, high].map(|x| number(x, 2));
    let shown = match values.len() {
        0 | 1 => shown,
        _ => format!("{shown} [{least}, {most}]"),
    };
    let field = |x| Field::Number(x, 2);
    [field(mean), field(low), field(high), Field::Shown(shown)]
}

/// A number for people.
pub(super) fn number(x: f64, digits: usize) -> String {
    if x.is_nan() {
        return "–".to_owned();
    }
    let text = format!("{x:.digits$}");
    // Rounding leaves a sign on nothing.
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| c == '0' || c == '.') => rest.to_owned(),
        _ => text,
    }
}

/// A p-value for people.
pub(super) fn probability(p: f64) -> String {
    if p.is_nan() {
        "–".to_owned()
    } else if p < 0.0001 {
        format!("{p:.0e}")
    } else {
        format!("{p:.4}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn people_and_programs_each_get_their_columns() {
        let table = Table {
            name: "t".into(),
            title: "Title".into(),
            columns: vec![
                Column::new("a", "A"),
                Column::new("low", ""),
                Column::new("", "both"),
            ],
            rows: vec![vec![
                Field::text("x|y"),
                Field::Number(f64::NAN, 2),
                Field::Shown("–".into()),
            ]],
            notes: vec!["Note.".into()],
        };
        assert_eq!(
            table.markdown(),
            "### Title\n\n| A | both |\n|---|---|\n| x\\|y | – |\n\nNote.\n"
        );
        assert_eq!(table.csv().expect("written"), b"a,low\nx|y,\n");
    }

    #[test]
    fn numbers_are_rounded_for_people() {
        assert_eq!(number(-0.001, 2), "0.00");
        assert_eq!(number(-1.005, 1), "-1.0");
        assert_eq!(probability(0.00789), "0.0079");
        assert_eq!(probability(2.4e-34), "2e-34");
    }
}
