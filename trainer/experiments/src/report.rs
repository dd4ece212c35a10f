//! Tables and figures of an experiment, beside what the thesis reports.
//!
//! The same results give the same bytes in every file.

mod ablations;
mod canvas;
mod curves;
mod figure;
mod load;
mod memory;
mod page;
mod pairs;
mod scores;
mod table;
mod thesis;

use std::fs;
use std::path::{Path, PathBuf};

use super::row::{TableError, write_synced};

pub use page::write_page;

/// What a report was made of, and where it is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Summary {
    /// "36 of 75 runs; missing: …".
    pub runs: String,
    /// The files written, in order.
    pub files: Vec<PathBuf>,
}

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReportError {
    /// The folder is none that `tpg experiment run` made.
    #[error("{folder} is no experiment's folder: {why}; `tpg experiment run FILE.toml` makes one")]
    NoExperiment {
        /// The folder that was given.
        folder: PathBuf,
        /// What is wrong.
        why: String,
    },
    /// No run is finished.
    #[error("{folder} has no finished run yet; `tpg experiment run` makes them")]
    Empty {
        /// The experiment's folder.
        folder: PathBuf,
    },
    /// A file of a finished run is missing, half-written or damaged.
    #[error("a finished run is not whole; `tpg experiment run` mends it by running it again")]
    Damaged {
        /// Which file, and what is wrong with it.
        source: TableError,
    },
    /// A row that the experiment does not ask for.
    #[error("{path} is no run of this experiment; move it away")]
    Stranger {
        /// The row.
        path: PathBuf,
    },
    /// A row of another configuration or version.
    #[error(
        "{path} is of another experiment or version: {column} is {value}, of this experiment {expected}; \
         delete it, and `tpg experiment run` makes it anew"
    )]
    Differs {
        /// The row.
        path: PathBuf,
        /// The column that differs.
        column: &'static str,
        /// What the row holds.
        value: String,
        /// What `experiment.toml` says.
        expected: String,
    },
    /// A file of the report cannot be written.
    #[error("cannot write the report")]
    Write {
        /// Which file, and why.
        source: TableError,
    },
    /// The drawing or table library failed, which is a defect.
    #[error("cannot make {file}: {why}")]
    Defect {
        /// The file.
        file: String,
        /// What the library says.
        why: String,
    },
}

/// Missing runs that are named one by one.
const NAMED: usize = 8;

/// Writes tables and figures of an experiment's finished runs to the folder `report` within its folder.
///
/// # Errors
/// [`ReportError`] if the folder is no experiment's, if a finished run is damaged, or if a file cannot be written.
pub fn write(folder: &Path) -> Result<Summary, ReportError> {
    let results = load::read(folder)?;
    let runs = completeness(&results);
    let there = format!("{runs}.");
    let mut files: Vec<(String, Vec<u8>)> = Vec::new();
    let tables = [
        Some(scores::scores(&results, &there)),
        Some(pairs::pairs(&results, &there)),
        ablations::ablations(&results, &there),
        Some(scores::throughput(&results, &there)),
    ];
    for table in tables.into_iter().flatten() {
        let name = format!("{}.csv", table.name);
        let csv = table.csv().map_err(|error| defect(&name, &error))?;
        files.push((format!("{}.md", table.name), table.markdown().into_bytes()));
        files.push((name, csv));
    }
    let figures = [curves::figures(&results), memory::figures(&results)].concat();
    for (name, figure) in figures {
        for (extension, draw) in [
            ("svg", canvas::svg as fn(&figure::Figure) -> _),
            ("png", canvas::png),
        ] {
            let name = format!("{name}.{extension}");
            let bytes = draw(&figure).map_err(|error| defect(&name, &error))?;
            files.push((name, bytes));
        }
    }
    let into = folder.join("report");
    fs::create_dir_all(&into).map_err(|source| ReportError::Write {
        source: TableError::Io {
            action: "create",
            path: into.clone(),
            source,
        },
    })?;
    let mut paths = Vec::new();
    for (name, bytes) in files {
        let path = into.join(name);
        write_synced(&path, &bytes).map_err(|source| ReportError::Write { source })?;
        paths.push(path);
    }
    Ok(Summary { runs, files: paths })
}

fn defect(file: &str, error: &anyhow::Error) -> ReportError {
    ReportError::Defect {
        file: file.to_owned(),
        why: format!("{error:#}"),
    }
}

/// How many of the runs are there, and which are missing.
fn completeness(results: &load::Results) -> String {
    let found = results.found();
    let missing = &results.missing;
    let mut text = format!("{found} of {} runs", found + missing.len());
    if !missing.is_empty() {
        text += "; missing: ";
        text += &missing[..missing.len().min(NAMED)].join(", ");
    }
    if missing.len() > NAMED {
        text += &format!(" and {} more", missing.len() - NAMED);
    }
    text
}
