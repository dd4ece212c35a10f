//! What an experiment writes of each run, as tables that any tool reads: the result, the learning curve, and the
//! champion's memory accesses.
//!
//! Floats stand in their shortest form that reads back as the same bits. Every file is written as a whole.

use std::fs;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use tpg_trainer::columns::columns;
use tpg_trainer::files;

/// A finished run: the columns of `rows/CELL.csv`, in order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// Bare name of the task.
    pub task: String,
    /// Name of the variant; the preset's name is `TASK-VARIANT`.
    pub variant: String,
    /// Number of the repeat, from 1.
    pub repeat: u32,
    /// The run's seed: the experiment's + `repeat` − 1.
    pub seed: u64,
    /// 16 hexadecimal digits: hash of the resolved configuration.
    pub config: String,
    /// Version of the trainer.
    pub tpg: String,
    /// 8 hexadecimal digits: fingerprint of the instruction set.
    pub fingerprint: String,
    /// When training ended, such as `generations:40`.
    pub budget: String,
    /// Threads that scored.
    pub threads: usize,
    /// Generations trained.
    pub generations: u64,
    /// Environment steps of all training episodes.
    pub steps: u64,
    /// Seconds of training; differs between equal runs.
    pub train_seconds: f64,
    /// CPU seconds of training; differs between equal runs.
    pub cpu_seconds: f64,
    /// The champion's training score.
    pub train_best: f64,
    /// The champion's team number.
    pub champion_id: u64,
    /// Size of the champion's file.
    pub champion_bytes: usize,
    /// Teams that the champion can reach.
    pub champion_teams: u16,
    /// Programs of those teams.
    pub champion_programs: u16,
    /// Effective instructions of those programs.
    pub champion_instructions: u32,
    /// Instructions executed per decision in the test episodes, ineffective ones included; NaN where the champion as
    /// evolved is too large to be run.
    pub instructions_mean: f64,
    /// Number of test episodes.
    pub test_episodes: u32,
    /// Mean return of the test episodes.
    pub test_mean: f64,
    /// Sample standard deviation of those returns.
    pub test_sd: f64,
    /// Their median.
    pub test_median: f64,
    /// Each of those returns, in order.
    #[serde(with = "spaced")]
    pub test_returns: Vec<f64>,
    /// Test episodes that an unstable simulation ended.
    pub unstable: u32,
}

impl Row {
    /// The name of its files.
    #[must_use]
    pub fn cell(&self) -> String {
        cell_name(&self.task, &self.variant, self.repeat)
    }
}

/// One generation of a learning curve: the columns of `curves/CELL.csv`, in order.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    /// Generations completed.
    pub generation: u64,
    /// Environment steps so far.
    pub steps: u64,
    /// Seconds of training so far; differs between equal runs.
    pub seconds: f64,
    /// The champion's training score.
    pub best: f64,
    /// Mean training score of the surviving roots.
    pub mean: f64,
    /// Instructions that the champion executed per decision in training.
    pub instructions_mean: f64,
    /// Teams that the champion can reach.
    pub champion_teams: u16,
    /// Programs of those teams.
    pub champion_programs: u16,
    /// Effective instructions of those programs.
    pub champion_instructions: u32,
}

/// How a program used a place of memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AccessKind {
    /// It read the place, or a part of it.
    Read,
    /// It wrote the place.
    Write,
}

/// The part of memory that a place belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MemorySection {
    /// Team memory, slots of one scalar.
    Scalar,
    /// Team memory, slots of a vector.
    Vector,
    /// Team memory, slots of a matrix.
    Matrix,
    /// Indexed memory; its slots are rows.
    Indexed,
}

/// How often a program of the champion accessed a slot: the columns of `accesses/CELL.csv`, in order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Access {
    /// Number of the program in the champion as evolved.
    pub program: u16,
    /// Read or write.
    pub access: AccessKind,
    /// Which part of memory.
    pub section: MemorySection,
    /// Slot of team memory, or row of indexed memory.
    pub slot: u16,
    /// Accesses over all test episodes.
    pub count: u64,
    /// Decisions of all test episodes.
    pub decisions: u64,
}

/// What a champion forgets before every decision: it is then as the evolved constants make it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Forgets {
    /// Its registers.
    Registers,
    /// Shared memory.
    Memory,
    /// Both.
    All,
}

/// What the champion scores in the test episodes if it forgets: the columns of `ablations/CELL.csv`, in order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ablation {
    /// What it forgets.
    pub forgets: Forgets,
    /// Mean return of the test episodes.
    pub test_mean: f64,
    /// Each of those returns, in the order of the row's.
    #[serde(with = "spaced")]
    pub test_returns: Vec<f64>,
}

/// The name of a run's files: `TASK.VARIANT.REPEAT`.
#[must_use]
pub fn cell_name(task: &str, variant: &str, repeat: u32) -> String {
    format!("{task}.{variant}.{repeat}")
}

/// The files of one run in an experiment's folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CellFiles {
    /// The finished run: one [`Row`].
    pub row: PathBuf,
    /// Its learning curve: [`CurvePoint`]s.
    pub curve: PathBuf,
    /// Its champion's memory accesses: [`Access`]es; only where there is memory.
    pub accesses: PathBuf,
    /// What it scores if it forgets: [`Ablation`]s; only where something outlives a decision.
    pub ablations: PathBuf,
}

impl CellFiles {
    /// The files of the run of this name, see [`cell_name`], in the experiment's folder.
    #[must_use]
    pub fn new(folder: &Path, cell: &str) -> Self {
        let file = |kind: &str| folder.join(kind).join(format!("{cell}.csv"));
        CellFiles {
            row: file("rows"),
            curve: file("curves"),
            accesses: file("accesses"),
            ablations: file("ablations"),
        }
    }
}

/// Why a table of results could not be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TableError {
    /// The file system said no.
    #[error("cannot {action} {path}")]
    Io {
        /// What was tried.
        action: &'static str,
        /// On which path.
        path: PathBuf,
        /// What came of it.
        source: std::io::Error,
    },
    /// The file is half-written, or none of ours.
    #[error("{path} is half-written or damaged: {why}")]
    Malformed {
        /// Which file.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
}

fn malformed(path: &Path, why: impl ToString) -> TableError {
    TableError::Malformed {
        path: path.to_owned(),
        why: why.to_string(),
    }
}

/// Reads `rows/CELL.csv` and checks that it is whole.
///
/// # Errors
/// [`TableError::Malformed`] unless it is one complete row of the run that its name tells.
pub fn read_row(path: &Path) -> Result<Row, TableError> {
    let mut rows: Vec<Row> = read_table(path)?;
    let row = match (rows.pop(), rows.len()) {
        (Some(row), 0) => row,
        (_, more) => {
            let why = format!("it must hold one row, not {more}");
            return Err(malformed(path, why));
        }
    };
    let (announced, found) = (row.test_episodes as usize, row.test_returns.len());
    if announced != found {
        let why = format!("test_returns holds {found} returns, test_episodes is {announced}");
        return Err(malformed(path, why));
    }
    if path.file_stem().and_then(|stem| stem.to_str()) != Some(&row.cell()) {
        return Err(malformed(path, format!("it holds the run {}", row.cell())));
    }
    Ok(row)
}

/// Reads all rows of a table: [`CurvePoint`]s, [`Access`]es or [`Ablation`]s.
///
/// # Errors
/// [`TableError::Malformed`] if a column is missing, a field is none of its kind, or the last line has no end.
pub fn read_table<T: DeserializeOwned>(path: &Path) -> Result<Vec<T>, TableError> {
    let text = fs::read_to_string(path).map_err(|source| TableError::Io {
        action: "read",
        path: path.to_owned(),
        source,
    })?;
    if !text.ends_with('\n') {
        return Err(malformed(path, "its last line has no end"));
    }
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let rows = reader.deserialize().collect::<Result<_, _>>();
    rows.map_err(|e| malformed(path, e))
}

/// Writes a table with its header, which stands even where there are no rows; no crash leaves it half-written.
fn write_table<T: Serialize + DeserializeOwned>(path: &Path, rows: &[T]) -> Result<(), TableError> {
    let mut writer = csv::WriterBuilder::new()
        .has_headers(false)
        .from_writer(Vec::new());
    let written = writer
        .write_record(columns::<T>())
        .and_then(|()| rows.iter().try_for_each(|row| writer.serialize(row)))
        .map_err(|e| malformed(path, e));
    written?;
    let bytes = writer.into_inner().map_err(|e| malformed(path, e))?;
    write_synced(path, &bytes)
}

/// Writes `rows/CELL.csv`; written last, it marks the run as finished.
///
/// # Errors
/// [`TableError::Io`].
pub fn write_row(path: &Path, row: &Row) -> Result<(), TableError> {
    write_table(path, std::slice::from_ref(row))
}

/// Writes `curves/CELL.csv`.
///
/// # Errors
/// [`TableError::Io`].
pub fn write_curve(path: &Path, points: &[CurvePoint]) -> Result<(), TableError> {
    write_table(path, points)
}

/// Writes `accesses/CELL.csv`.
///
/// # Errors
/// [`TableError::Io`].
pub fn write_accesses(path: &Path, accesses: &[Access]) -> Result<(), TableError> {
    write_table(path, accesses)
}

/// Writes `ablations/CELL.csv`.
///
/// # Errors
/// [`TableError::Io`].
pub fn write_ablations(path: &Path, ablations: &[Ablation]) -> Result<(), TableError> {
    write_table(path, ablations)
}

/// Replaces a file as a whole; neither a crash nor a power cut leaves a part of it.
///
/// # Errors
/// [`TableError::Io`].
pub fn write_synced(path: &Path, bytes: &[u8]) -> Result<(), TableError> {
    let written = files::replace_durably(path, &[bytes]);
    written.map_err(|source| TableError::Io {
        action: "write",
        path: path.to_owned(),
        source,
    })
}

/// Lists of numbers in one field, separated by spaces.
mod spaced {
    use serde::de::Error as _;
    use serde::{Deserialize as _, Deserializer, Serializer};

    pub(super) fn serialize<S: Serializer>(list: &[f64], to: S) -> Result<S::Ok, S::Error> {
        let texts: Vec<String> = list.iter().map(ToString::to_string).collect();
        to.serialize_str(&texts.join(" "))
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<f64>, D::Error> {
        let text = String::deserialize(from)?;
        let number = |word: &str| {
            let wrong = || D::Error::custom(format!("{word:?} is no number"));
            word.parse::<f64>().map_err(|_| wrong())
        };
        text.split_ascii_whitespace().map(number).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row() -> Row {
        Row {
            task: "hopper".into(),
            variant: "sr-sm-b23".into(),
            repeat: 2,
            seed: 3,
            config: "0123456789abcdef".into(),
            tpg: "0.1.0".into(),
            fingerprint: "00000001".into(),
            budget: "generations:40".into(),
            threads: 1,
            generations: 40,
            steps: 12345,
            train_seconds: 1.5,
            cpu_seconds: 0.1 + 0.2,
            train_best: -1e-300,
            champion_id: 77,
            champion_bytes: 1000,
            champion_teams: 2,
            champion_programs: 9,
            champion_instructions: 100,
            instructions_mean: 55.25,
            test_episodes: 3,
            test_mean: 1.0 / 3.0,
            test_sd: 0.0,
            test_median: -0.0,
            test_returns: vec![1.0 / 3.0, -7.0, 1e21],
            unstable: 0,
        }
    }

    fn folder() -> tempfile::TempDir {
        tempfile::tempdir().expect("a temporary folder")
    }

    #[test]
    fn what_is_written_reads_back() {
        let folder = folder();
        let path = folder.path().join("hopper.sr-sm-b23.2.csv");
        write_row(&path, &row()).expect("written");
        assert_eq!(read_row(&path).expect("whole"), row());
        let access = Access {
            program: 3,
            access: AccessKind::Read,
            section: MemorySection::Indexed,
            slot: 99,
            count: 5,
            decisions: 10,
        };
        write_accesses(&path, &[access]).expect("written");
        assert_eq!(read_table::<Access>(&path).expect("whole"), [access]);
        write_accesses(&path, &[]).expect("written");
        assert_eq!(read_table::<Access>(&path).expect("whole"), []);
        let point = CurvePoint {
            generation: 1,
            steps: 2,
            seconds: 0.1,
            best: -1.0,
            mean: f64::NEG_INFINITY,
            instructions_mean: 0.3,
            champion_teams: 1,
            champion_programs: 2,
            champion_instructions: 3,
        };
        write_curve(&path, &[point]).expect("written");
        assert_eq!(read_table::<CurvePoint>(&path).expect("whole"), [point]);
    }

    /// Whatever a crash or an editor cuts off.
    #[test]
    fn no_part_of_a_row_counts_as_a_row() {
        let folder = folder();
        let path = folder.path().join("hopper.sr-sm-b23.2.csv");
        write_row(&path, &row()).expect("written");
        let whole = fs::read_to_string(&path).expect("there");
        for end in 0..whole.len() {
            fs::write(&path, &whole[..end]).expect("written");
            assert!(read_row(&path).is_err(), "{}", &whole[..end]);
        }
        fs::write(&path, whole.replace("-7 ", "")).expect("written");
        let why = read_row(&path)
            .expect_err("a return is missing")
            .to_string();
        assert!(why.contains("2 returns"), "{why}");
        let other = folder.path().join("hopper.sr-sm-b23.3.csv");
        fs::write(&other, whole).expect("written");
        assert!(read_row(&other).is_err());
    }
}
