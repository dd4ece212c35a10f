//! One process at a time trains in a folder.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::Write as _;
use std::path::Path;

use super::error::{RunFolderError, unwritable};

/// Keeps other processes out of a folder for as long as it lives. The system drops it when the process ends, however it ends.
pub(super) struct Lock {
    _file: File,
}

/// Whether a file is one that [`Lock::take`] wrote, as far as can be told: empty, or the number of a process.
pub(super) fn is_ours(path: &Path) -> bool {
    fs::read_to_string(path)
        .is_ok_and(|text| text.is_empty() || text.trim_end().parse::<u32>().is_ok())
}

impl Lock {
    pub(super) fn take(folder: &Path) -> Result<Self, RunFolderError> {
        let path = folder.join("lock");
        let mut options = OpenOptions::new();
        let opened = options.write(true).create(true).truncate(false).open(&path);
        let mut file = opened.map_err(unwritable(&path))?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => {
                let number = fs::read_to_string(&path).unwrap_or_default();
                let number = number.trim();
                return Err(RunFolderError::Locked {
                    path: folder.to_owned(),
                    pid: match number.parse::<u32>() {
                        Ok(number) => format!(" ({number})"),
                        Err(_) => String::new(),
                    },
                });
            }
            // Where the file system knows no locks, it goes without.
            Err(TryLockError::Error(_)) | Ok(()) => {}
        }
        let written = file.set_len(0);
        let written = written.and_then(|()| writeln!(file, "{}", std::process::id()));
        written.map_err(unwritable(&path))?;
        Ok(Lock { _file: file })
    }
}
