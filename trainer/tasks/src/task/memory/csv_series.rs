//! Series of numbers that a user has in a CSV file.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::sync::Arc;

use sha2::{Digest as _, Sha256};

use super::forecast::{Forecast, LONGEST_FORECAST};
use super::series::{Series, training_part};
use crate::task::UnknownTask;

/// What `series:FILE.csv:COLUMN:HORIZON` names.
pub(in crate::task) struct CsvSeries<'a> {
    /// What stands before the file: `series` or `series-validation`.
    family: &'static str,
    /// The file, as the name has it.
    pub(in crate::task) path: &'a Path,
    /// What follows the file in the name, its colon included.
    pub(in crate::task) rest: &'a str,
    column: &'a str,
    horizon: u32,
}

impl<'a> CsvSeries<'a> {
    const TRAINING: &'static str = "series";
    const VALIDATION: &'static str = "series-validation";

    /// Whether a name means such a series, well written or not.
    pub(in crate::task) fn is_meant(name: &str) -> bool {
        let family = name.split_once(':').map_or(name, |(family, _)| family);
        [Self::TRAINING, Self::VALIDATION].contains(&family)
    }

    /// Reads a name; `None` if it means something else.
    ///
    /// The file ends at the first `.csv:`. Where a column's name ends in a colon and a number, the horizon has to follow.
    pub(in crate::task) fn of(name: &'a str) -> Option<Result<Self, UnknownTask>> {
        if !Self::is_meant(name) {
            return None;
        }
        let (family, given) = name.split_once(':').unwrap_or((name, ""));
        let (family, default) = match family {
            Self::TRAINING => (Self::TRAINING, 50),
            _ => (Self::VALIDATION, 100),
        };
        let bad = || UnknownTask::BadParameter {
            family,
            given: given.into(),
            wanted: format!(
                "{family}:FILE.csv:COLUMN and {family}:FILE.csv:COLUMN:HORIZON, with a horizon from 1 to \
                 {LONGEST_FORECAST}, {default} where none is given"
            ),
        };
        Some(Self::parse(family, given, default).ok_or_else(bad))
    }

    fn parse(family: &'static str, given: &'a str, default: u32) -> Option<Self> {
        let end = given.to_ascii_lowercase().find(".csv:")? + ".csv".len();
        let (path, rest) = given.split_at_checked(end)?;
        let all = rest.strip_prefix(':')?;
        let digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
        let (column, horizon) = match all.rsplit_once(':') {
            Some((column, number)) if digits(number) => {
                let horizon: u32 = number.parse().ok()?;
                // A task has one name: no leading zero.
                (horizon.to_string() == number).then_some((column, horizon))?
            }
            _ => (all, default),
        };
        let fits = !column.is_empty() && (1..=LONGEST_FORECAST).contains(&horizon);
        fits.then_some(CsvSeries {
            family,
            path: Path::new(path),
            rest,
            column,
            horizon,
        })
    }

    /// Reads the file and makes the task.
    ///
    /// # Errors
    /// [`UnknownTask::BadFile`] says what is wrong with the file, and where.
    pub(in crate::task) fn load(&self) -> Result<Forecast, UnknownTask> {
        let bytes = self.bytes()?;
        let bad = |why| self.bad(why);
        let values = self.values(&bytes).map_err(bad)?;
        let (len, validation) = (values.len(), self.family == Self::VALIDATION);
        if Forecast::starts(len, self.horizon, validation).is_none() {
            let enough = |len: &usize| Forecast::starts(*len, self.horizon, validation).is_some();
            let needed = (len..).find(enough).unwrap_or(usize::MAX);
            return Err(bad(format!(
                "column {:?} has {len} values; with a horizon of {}, the task {} needs {needed}: take a longer file or a \
                 shorter horizon",
                self.column, self.horizon, self.family
            )));
        }
        let known = training_part(len);
        let series = Series::scaled(values, known).ok_or_else(|| {
            bad(format!(
                "column {:?} is constant in the first {known} of its {len} values, by which it is scaled, or its range is no \
                 finite number: take another column",
                self.column
            ))
        })?;
        let far = |x: &f64| x.abs() > f64::from(f32::MAX);
        if let Some(at) = series.values.iter().position(far) {
            return Err(bad(format!(
                "value {} of column {:?} is too far from the first {known}, by which it is scaled: correct it",
                at + 1,
                self.column
            )));
        }
        let name = self.full_name(&bytes).map_err(bad)?;
        Forecast::continuing(name, Arc::new(series), self.horizon, validation)
            .ok_or_else(|| bad("too few values".into()))
    }

    /// The task's name: without the folder, and with the beginning of the file's hash as its version.
    fn full_name(&self, bytes: &[u8]) -> Result<String, String> {
        /// The most bytes of a task's name in a policy's file.
        const LONGEST_NAME: usize = 255;
        let file = self.path.file_name().unwrap_or_default().to_string_lossy();
        let version = hex(&Sha256::digest(bytes)[..4]);
        let (family, column, horizon) = (self.family, self.column, self.horizon);
        let name = format!("{family}:{file}:{column}:{horizon}-{version}");
        match name.len() {
            ..=LONGEST_NAME => Ok(name),
            len => Err(format!(
                "the task's name, {name:?}, has {len} bytes, of which a policy holds {LONGEST_NAME}: give the file or the \
                 column a shorter name"
            )),
        }
    }

    /// What fixes the task wherever its file lies.
    pub(in crate::task) fn identity(&self) -> Result<String, UnknownTask> {
        let digest = hex(&Sha256::digest(self.bytes()?));
        Ok(format!(
            "{}:{digest}:{}:{}",
            self.family, self.column, self.horizon
        ))
    }

    /// The file's name without its folder, and its SHA-256.
    pub(in crate::task) fn source(&self) -> Result<(String, [u8; 32]), UnknownTask> {
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        Ok((name.into_owned(), Sha256::digest(self.bytes()?).into()))
    }

    fn bytes(&self) -> Result<Vec<u8>, UnknownTask> {
        fs::read(self.path).map_err(|error| self.bad(format!("cannot be read: {error}")))
    }

    fn bad(&self, why: String) -> UnknownTask {
        UnknownTask::BadFile {
            path: self.path.to_owned(),
            why,
        }
    }

    /// The numbers of the column, in the order of the file.
    fn values(&self, bytes: &[u8]) -> Result<Vec<f64>, String> {
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .from_reader(bytes);
        let headers = reader.headers().map_err(|error| error.to_string())?;
        let places: Vec<usize> = (headers.iter().enumerate())
            .filter_map(|(k, name)| (name == self.column).then_some(k))
            .collect();
        let [at] = places.as_slice() else {
            return Err(self.no_column(headers, places.len()));
        };
        let mut values = Vec::new();
        for record in reader.records() {
            let record = record.map_err(|error| error.to_string())?;
            let cell = record.get(*at).unwrap_or_default();
            let value = cell.parse().ok().filter(|x: &f64| x.is_finite());
            values.push(value.ok_or_else(|| {
                let line = record.position().map_or(0, csv::Position::line);
                format!(
                    "line {line}, column {:?}: {cell:?} is no finite number: correct it, or leave the line out",
                    self.column
                )
            })?);
        }
        Ok(values)
    }

    /// Says that none of the columns has the name, or that several have it.
    fn no_column(&self, headers: &csv::StringRecord, found: usize) -> String {
        /// Columns that are listed.
        const MANY: usize = 40;
        if found > 1 {
            return format!(
                "{found} columns are called {:?}: rename all but one",
                self.column
            );
        }
        let names: Vec<String> = (headers.iter().take(MANY))
            .map(|name| format!("{name:?}"))
            .collect();
        let more = match headers.len().saturating_sub(MANY) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        format!(
            "no column is called {:?}; the first line names {}{more}",
            self.column,
            names.join(", ")
        )
    }
}

/// Bytes as text.
fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

#[cfg(test)]
mod tests {
    use super::super::forecast::tests::mean_return;
    use super::*;
    use crate::task::{Rng, Task as _, create, identity, is_from_file, locate_in, sources};
    use tpg_runtime::Action;

    /// A file with these lines, in a folder that lives as long as the first part.
    fn file(lines: &[String]) -> (tempfile::TempDir, String) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("data.csv");
        fs::write(&path, lines.join("\n")).unwrap();
        let path = path.to_str().unwrap().to_owned();
        (folder, path)
    }

    /// A column `x` of these values between two others.
    fn column(values: impl IntoIterator<Item = f64>) -> (tempfile::TempDir, String) {
        let lines = values.into_iter().map(|x| format!("7,{x},a"));
        file(&[vec!["t, x,note".to_owned()], lines.collect()].concat())
    }

    fn load(name: &str) -> Forecast {
        CsvSeries::of(name).unwrap().unwrap().load().unwrap()
    }

    fn refusal(name: &str) -> String {
        create(name).err().unwrap().to_string()
    }

    #[test]
    fn a_name_has_a_file_a_column_and_a_horizon() {
        for (name, path, column, horizon) in [
            ("series:a.csv:x", "a.csv", "x", 50),
            ("series:a/b.CSV:x:1", "a/b.CSV", "x", 1),
            ("series:C:\\d\\a.csv:x y:500", "C:\\d\\a.csv", "x y", 500),
            ("series:a.csv:5", "a.csv", "5", 50),
            ("series:a.csv:5:6", "a.csv", "5", 6),
            ("series:a.csv:x:5:6", "a.csv", "x:5", 6),
            ("series:a.csv:x:y", "a.csv", "x:y", 50),
            ("series:a.csv:x.toml", "a.csv", "x.toml", 50),
            ("series-validation:a.csv:x", "a.csv", "x", 100),
        ] {
            let series = CsvSeries::of(name).unwrap().unwrap();
            assert_eq!(series.path, Path::new(path), "{name}");
            assert_eq!((series.column, series.horizon), (column, horizon), "{name}");
            assert!(is_from_file(name));
        }
        for name in [
            "series",
            "series:",
            "series:a.csv",
            "series:a.csv:",
            "series:a.txt:x",
            "series:a.csv:x:0",
            "series:a.csv:x:501",
            "series:a.csv:x:05",
            "series:a.csv:x:99999999999",
        ] {
            let error = refusal(name);
            assert!(error.contains("series:FILE.csv:COLUMN:HORIZON"), "{error}");
        }
        assert!(!is_from_file("serie:a.csv:x"));
        assert!(CsvSeries::of("lorenz:50").is_none());
    }

    #[test]
    fn a_name_keeps_its_meaning_in_another_folder() {
        let name = locate_in(Path::new("/some/where"), "series:a.csv:x:7");
        assert_eq!(name, "series:/some/where/a.csv:x:7");
        assert_eq!(locate_in(Path::new("/some/where"), "lorenz:7"), "lorenz:7");
        let (_folder, path) = column((0..400).map(|k| f64::from(k % 9)));
        let (_other, same) = column((0..400).map(|k| f64::from(k % 9)));
        let (_third, other) = column((0..400).map(|k| f64::from(k % 8)));
        let full = |path: &str| load(&format!("series:{path}:x:7")).spec().name.clone();
        let fixed = |path: &str| identity(&format!("series:{path}:x:7")).unwrap();
        assert_eq!(full(&path), full(&same));
        assert_eq!(fixed(&path), fixed(&same));
        assert_ne!(full(&path), full(&other));
        assert_ne!(fixed(&path), fixed(&other));
        let horizon = identity(&format!("series:{path}:x:8")).unwrap();
        assert_ne!(fixed(&path), horizon);
        let (name, hash) = sources(&format!("series:{path}:x")).unwrap().remove(0);
        assert_eq!(name, "data.csv");
        assert!(full(&path).starts_with("series:data.csv:x:7-"));
        assert!(full(&path).ends_with(&hex(&hash[..4])));
    }

    /// Values of the last quarter do not change how those of the first three are scaled.
    #[test]
    fn the_training_part_scales_the_whole_series() {
        let (_folder, path) = column((0..800).map(|k| match k {
            0..600 => 20.0 + f64::from(k % 5),
            _ => 32.0,
        }));
        let mut task = load(&format!("series:{path}:x:1"));
        let seen = |task: &mut Forecast| {
            let mut all = Vec::new();
            for seed in 0..50 {
                task.reset(&mut Rng::new(seed));
                for _ in 0..50 {
                    let mut observation = [f32::NAN];
                    task.observe(&mut observation);
                    all.push(observation[0]);
                    task.step(Action::Continuous(&[0.0]));
                }
            }
            all.sort_by(f32::total_cmp);
            all.dedup();
            all
        };
        assert_eq!(seen(&mut task), [0.0, 0.25, 0.5, 0.75, 1.0]);
        let mut task = load(&format!("series-validation:{path}:x:1"));
        assert_eq!(seen(&mut task), [3.0]);
    }

    /// A sine obeys an autoregression of order 2; a constant at the mean has −1 by the definition of variance.
    #[test]
    fn simple_forecasts_score_as_they_should() {
        let turn = 0.3f64;
        let (_folder, path) = column((0..1200).map(|k| 5.0 + 2.0 * (turn * f64::from(k)).sin()));
        for (family, horizon) in [("series", 1), ("series", 50), ("series-validation", 50)] {
            let mut task = load(&format!("{family}:{path}:x:{horizon}"));
            let line = mean_return(&mut task, |seen| match seen {
                [last, before, ..] => 2.0 * turn.cos() * (last - 0.5) - (before - 0.5) + 0.5,
                _ => 0.5,
            });
            assert!((-1e-4..=0.0).contains(&line), "{family} {horizon}: {line}");
            let mean = mean_return(&mut task, |_| 0.5);
            assert!((mean + 1.0).abs() < 0.1, "{family} {horizon}: {mean}");
            let persistence = mean_return(&mut task, |seen| seen[0]);
            // 2 (1 − cos 0.3) one step ahead; twice the variance where the phase no longer matters.
            let expected = if horizon == 1 { -0.089 } else { -2.0 };
            let ratio = persistence / expected;
            assert!((0.8..1.2).contains(&ratio), "{family} {horizon}: {ratio}");
        }
    }

    #[test]
    fn what_is_wrong_with_a_file_is_said_with_its_place() {
        let says = |lines: &[&str], rest: &str, words: &[&str]| {
            let lines: Vec<String> = lines.iter().map(ToString::to_string).collect();
            let (_folder, path) = file(&lines);
            let error = refusal(&format!("series:{path}{rest}"));
            assert!(error.contains("data.csv: "), "{error}");
            for word in words {
                assert!(error.contains(word), "{word:?}: {error}");
            }
        };
        says(
            &["t,load", "1,2"],
            ":laod",
            &["no column is called \"laod\"", "\"t\", \"load\""],
        );
        says(&["x,x", "1,2"], ":x", &["2 columns are called \"x\""]);
        says(&[], ":x", &["no column is called \"x\""]);
        for cell in ["abc", "", "nan", "inf", "1e999"] {
            let bad = format!("2,{cell}");
            let found = format!("line 3, column \"x\": {cell:?} is no finite number");
            says(&["t,x", "1,2", &bad, "3,4"], ":x", &[&found]);
        }
        says(&["t,x", "1,2", "3"], ":x", &["line: 3"]);
        says(
            &["t,x", "1,2"],
            ":x",
            &["\"x\" has 1 values", "horizon of 50", "series needs 135"],
        );
        let error = refusal("series:no/such.csv:x");
        assert!(
            error.starts_with("no/such.csv: cannot be read: "),
            "{error}"
        );
        let (_folder, path) = column((0..400).map(|k| if k < 300 { 2.5 } else { 3.0 }));
        let error = refusal(&format!("series:{path}:x"));
        assert!(error.contains("constant in the first 300 of"), "{error}");
        let far = (0..400).map(|k| if k == 390 { 1e300 } else { f64::from(k % 7) });
        let (_folder, path) = column(far);
        let error = refusal(&format!("series:{path}:x"));
        assert!(
            error.contains("value 391 of column \"x\" is too far"),
            "{error}"
        );
    }

    /// The number that a message names is enough, and one less is not.
    #[test]
    fn as_many_values_as_are_said_to_be_needed_are_enough() {
        for (family, horizon, needed) in [
            ("series", 1, 70),
            ("series", 50, 135),
            ("series-validation", 50, 408),
            ("series-validation", 500, 2208),
        ] {
            let rest = format!("x:{horizon}");
            let (_folder, path) = column((0..needed).map(|k| f64::from(k % 7)));
            let mut task = load(&format!("{family}:{path}:{rest}"));
            assert!(mean_return(&mut task, |_| 0.5) < 0.0);
            let (_folder, path) = column((0..needed - 1).map(|k| f64::from(k % 7)));
            let error = refusal(&format!("{family}:{path}:{rest}"));
            assert!(error.contains(&format!("needs {needed}:")), "{error}");
        }
    }

    #[test]
    fn a_name_that_no_policy_holds_is_refused() {
        let title = "x".repeat(240);
        let lines = (0..200).map(|k| format!("{}", k % 7));
        let (_folder, path) = file(&[vec![title.clone()], lines.collect()].concat());
        let error = refusal(&format!("series:{path}:{title}:1"));
        assert!(error.contains("has 267 bytes"), "{error}");
    }
}
