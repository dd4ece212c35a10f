//! Which process does which run of an experiment.

use std::fs::{self, File, TryLockError};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// A run that this process does and no other, until this is dropped.
#[derive(Debug)]
pub(super) struct Claim {
    path: PathBuf,
    /// Holds the lock. The system drops it too when the process is killed.
    _file: File,
}

impl Claim {
    /// Claims what the file stands for; `None` if another process has it.
    ///
    /// The claim is a lock on the file. Where the file system knows no locks, it is the file's creation, and a killed process
    /// leaves its claim behind.
    ///
    /// # Errors
    /// The file cannot be created or opened.
    pub(super) fn take(path: &Path) -> io::Result<Option<Self>> {
        let (file, created) = match File::create_new(path) {
            Ok(file) => (file, true),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {
                match File::options().write(true).open(path) {
                    Ok(file) => (file, false),
                    // Its owner has finished in between.
                    Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
                    Err(error) => return Err(error),
                }
            }
            Err(error) => return Err(error),
        };
        let is_mine = match file.try_lock() {
            Ok(()) => true,
            Err(TryLockError::WouldBlock) => false,
            Err(TryLockError::Error(_)) => created,
        };
        Ok(is_mine.then(|| Claim {
            path: path.to_owned(),
            _file: file,
        }))
    }

    /// Removes the file, since what it stands for is done. An unfinished claim's file stays, so that no two processes can
    /// ever hold locks on two files of one name.
    ///
    /// # Errors
    /// It cannot be removed.
    pub(super) fn finish(self) -> io::Result<()> {
        match fs::remove_file(&self.path) {
            Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_claim_is_one_processs_until_it_is_dropped() {
        let folder = std::env::temp_dir().join(format!("tpg-claim-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder");
        let path = folder.join("cell.claim");
        let first = Claim::take(&path).expect("created").expect("free");
        assert!(Claim::take(&path).expect("opened").is_none());
        // A killed process leaves the file, but not its lock.
        drop(first);
        let second = Claim::take(&path).expect("opened").expect("free again");
        second.finish().expect("removed");
        assert!(!path.exists());
        fs::remove_dir_all(&folder).expect("removed");
    }
}
