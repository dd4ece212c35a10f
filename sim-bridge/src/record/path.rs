//! Where a recording goes, and in which form.

use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Form of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// A table with a line a step.
    Csv,
    /// A log for Foxglove and other viewers, with its schema.
    Mcap,
}

/// A file whose name says in which form it is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordPath {
    /// The file.
    pub path: PathBuf,
    /// What its name ends in.
    pub format: Format,
}

impl FromStr for RecordPath {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let extension = Path::new(text).extension().and_then(|e| e.to_str());
        let format = match extension {
            Some("csv") => Format::Csv,
            Some("mcap") => Format::Mcap,
            _ => {
                return Err(format!(
                    "{text:?} names no form: end the name in .mcap or .csv"
                ));
            }
        };
        Ok(RecordPath {
            path: PathBuf::from(text),
            format,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_says_the_form() {
        let format = |text: &str| text.parse::<RecordPath>().map(|place| place.format);
        assert_eq!(format("runs/a.mcap"), Ok(Format::Mcap));
        assert_eq!(format("a.b.csv"), Ok(Format::Csv));
        for nonsense in ["", "a", "mcap", "a.bag", "a.CSV.gz"] {
            assert!(format(nonsense).is_err(), "{nonsense}");
        }
    }
}
