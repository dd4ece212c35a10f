//! The log of a run: a row for each generation.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read as _, Write as _};
use std::path::{Path, PathBuf};

use sha2::{Digest as _, Sha256};

use super::error::{RunFolderError, unwritable};
use crate::columns::columns;
use crate::session::{GenerationReport, LogMark};

/// An open log, which knows the hash of all that it holds.
pub(super) struct Log {
    path: PathBuf,
    file: File,
    bytes: u64,
    hasher: Sha256,
}

impl Log {
    /// A new log with nothing but the names of its columns.
    pub(super) fn create(path: &Path) -> Result<Self, RunFolderError> {
        let mut log = Log {
            path: path.to_owned(),
            file: File::create(path).map_err(unwritable(path))?,
            bytes: 0,
            hasher: Sha256::new(),
        };
        let header = format!("{}\n", columns::<GenerationReport>().join(","));
        log.write(header.as_bytes())?;
        Ok(log)
    }

    /// A log to go on with behind a mark. What lies behind it was written after the checkpoint, and is dropped.
    pub(super) fn reopen(path: &Path, mark: LogMark) -> Result<Self, RunFolderError> {
        let opened = OpenOptions::new().read(true).append(true).open(path);
        let file = opened.map_err(|source| RunFolderError::Read {
            path: path.to_owned(),
            source,
        })?;
        let mut kept = Vec::new();
        let read = (&file).take(mark.bytes).read_to_end(&mut kept);
        read.map_err(|source| RunFolderError::Read {
            path: path.to_owned(),
            source,
        })?;
        let mut hasher = Sha256::new();
        hasher.update(&kept);
        let digest: [u8; 32] = hasher.clone().finalize().into();
        if kept.len() as u64 != mark.bytes || digest != mark.sha256 {
            return Err(RunFolderError::Differs {
                path: path.to_owned(),
                what: format!(
                    "its first {} bytes are not the rows that the run wrote",
                    mark.bytes
                ),
            });
        }
        file.set_len(mark.bytes).map_err(unwritable(path))?;
        Ok(Log {
            path: path.to_owned(),
            file,
            bytes: mark.bytes,
            hasher,
        })
    }

    /// Adds a generation's row.
    pub(super) fn append(&mut self, report: &GenerationReport) -> Result<(), RunFolderError> {
        // A file that was deleted would take its rows with it, without an error.
        let there = fs::metadata(&self.path).map(|found| found.len());
        if there.map_err(unwritable(&self.path))? != self.bytes {
            let changed = io::Error::other("somebody else has changed it");
            return Err(unwritable(&self.path)(changed));
        }
        let mut row = csv::WriterBuilder::new()
            .has_headers(false)
            .from_writer(Vec::new());
        let row = row.serialize(report).and_then(|()| {
            row.into_inner()
                .map_err(|error| io::Error::other(error.to_string()).into())
        });
        let row = row.map_err(|error| unwritable(&self.path)(error.into()))?;
        self.write(&row)
    }

    /// The mark behind all that is in the log, which has then reached the disk.
    pub(super) fn mark(&mut self) -> Result<LogMark, RunFolderError> {
        self.file.sync_all().map_err(unwritable(&self.path))?;
        Ok(LogMark {
            bytes: self.bytes,
            sha256: self.hasher.clone().finalize().into(),
        })
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), RunFolderError> {
        self.file.write_all(bytes).map_err(unwritable(&self.path))?;
        self.bytes += bytes.len() as u64;
        self.hasher.update(bytes);
        Ok(())
    }
}
