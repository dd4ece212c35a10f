//! Runs: their names, and the folder in which the files of each lie apart from all others.
//!
//! Each process of a run holds a shared lock in the run's folder. If no process holds it, all of them have died. The
//! next process to start then removes the folder and what the run left in shared memory.

use std::fmt;
use std::fs::{self, DirBuilder, File, TryLockError};
use std::io;
use std::os::unix::fs::{DirBuilderExt as _, MetadataExt as _};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::thread;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use crate::error::BridgeError;
use crate::folder;
use crate::hash;

/// Where Linux keeps shared memory; on other systems the folder does not exist, and nothing is removed by name.
pub(crate) const SHARED_MEMORY: &str = "/dev/shm";
/// File in a run's folder on which the lock is held.
const LOCK: &str = "alive";
/// First character of a folder that is being removed; no name of a run begins with it.
const REMOVED: char = '.';
/// Longest wait for another process to finish removing the folder, which takes far less.
const ENTER_DEADLINE: Duration = Duration::from_secs(2);

/// Name of a run, which both of its processes must be given.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunName(String);

impl RunName {
    /// A name that no other run on this machine has.
    #[must_use]
    pub fn unique() -> Self {
        let now = SystemTime::now().duration_since(UNIX_EPOCH);
        let nanos = now.map_or(0, |d| d.as_nanos());
        RunName(format!("{}-{nanos:x}", std::process::id()))
    }

    /// First part of the name of everything that the run has in shared memory; as long for every run.
    pub(crate) fn prefix(&self) -> String {
        format!("tpg_{:016x}_", hash::bytes(hash::START, self.0.as_bytes()))
    }
}

impl FromStr for RunName {
    type Err = BridgeError;

    fn from_str(name: &str) -> Result<Self, BridgeError> {
        let allowed = |b: u8| b.is_ascii_alphanumeric() || b"-_.".contains(&b);
        let fits = name.len() <= 64 && name.bytes().all(allowed);
        // The first character keeps a name from being the folder itself or the one above.
        if fits && name.starts_with(|c: char| c.is_ascii_alphanumeric()) {
            Ok(RunName(name.into()))
        } else {
            Err(BridgeError::RunName { name: name.into() })
        }
    }
}

impl fmt::Display for RunName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// The run's files in shared memory, whoever made them.
pub(crate) fn shared_files(run: &RunName) -> impl Iterator<Item = PathBuf> + use<> {
    let prefix = run.prefix();
    let files = fs::read_dir(SHARED_MEMORY).into_iter().flatten().flatten();
    let ours = move |name: &std::ffi::OsStr| name.as_encoded_bytes().starts_with(prefix.as_bytes());
    files
        .filter(move |file| ours(&file.file_name()))
        .map(|file| file.path())
}

/// A process's membership of a run; the last process to leave removes the run's files.
#[derive(Debug)]
pub(crate) struct Presence {
    run: RunName,
    base: PathBuf,
    lock: Option<File>,
}

impl Presence {
    /// Enters a run, after what dead processes left behind is removed.
    pub(crate) fn enter(run: &RunName) -> Result<Self, BridgeError> {
        let base = folder::base()?;
        sweep_in(&base);
        let start = Instant::now();
        let failed = BridgeError::transport("enter the run's folder");
        loop {
            match hold(&base.join(&run.0)) {
                Ok(Some(lock)) => {
                    return Ok(Presence {
                        run: run.clone(),
                        base,
                        lock: Some(lock),
                    });
                }
                // Somebody is about to remove the folder, or just has.
                Ok(None) if start.elapsed() < ENTER_DEADLINE => {
                    thread::sleep(Duration::from_millis(1));
                }
                Ok(None) => return Err(failed(io::ErrorKind::TimedOut.into())),
                Err(error) => return Err(failed(error)),
            }
        }
    }

    /// Folder of the run's files.
    pub(crate) fn folder(&self) -> PathBuf {
        self.base.join(&self.run.0)
    }
}

impl Drop for Presence {
    fn drop(&mut self) {
        self.lock = None;
        // If another process is still in the run, or removal fails, a later start does it.
        let _ = remove(&self.base, &self.run);
    }
}

/// Takes the shared lock of a folder, which is made if need be; `None` if the folder is being removed.
fn hold(folder: &Path) -> io::Result<Option<File>> {
    DirBuilder::new()
        .recursive(true)
        .mode(0o700)
        .create(folder)?;
    let path = folder.join(LOCK);
    let file = match folder::options().create(true).append(true).open(&path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        opened => opened?,
    };
    match file.try_lock_shared() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => return Ok(None),
        Err(TryLockError::Error(error)) => return Err(error),
    }
    // The folder may have been removed, and made again by a third process, before the lock was taken.
    let (held, named) = (file.metadata()?, fs::metadata(&path));
    let same = named.is_ok_and(|named| (named.dev(), named.ino()) == (held.dev(), held.ino()));
    Ok(same.then_some(file))
}

/// Removes what dead runs left behind; a run is dead when all its processes are.
pub fn sweep() {
    // A folder that is not this user's alone has nothing of ours.
    if let Ok(base) = folder::base() {
        sweep_in(&base);
    }
}

fn sweep_in(base: &Path) {
    // What cannot be removed now is tried again at the next start.
    let Ok(folders) = fs::read_dir(base) else {
        return;
    };
    for name in folders.filter_map(|folder| folder.ok()?.file_name().into_string().ok()) {
        if name.starts_with(REMOVED) {
            let _ = fs::remove_dir_all(base.join(name));
        } else if let Ok(run) = name.parse() {
            let _ = remove(base, &run);
        }
    }
}

/// Removes a run's files, if nobody is in it.
fn remove(base: &Path, run: &RunName) -> io::Result<()> {
    let folder = base.join(&run.0);
    let path = folder.join(LOCK);
    let lock = folder::options().create(true).append(true).open(path)?;
    if lock.try_lock().is_err() {
        return Ok(());
    }
    for file in shared_files(run) {
        // Another user's file is theirs to remove.
        if folder::is_ours(&file)? {
            fs::remove_file(file)?;
        }
    }
    // Renamed first, so that a folder which another process makes under the old name meanwhile is not touched.
    let removed = base.join(format!("{REMOVED}{run}-{}", std::process::id()));
    fs::rename(&folder, &removed)?;
    fs::remove_dir_all(removed)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(run: &RunName) -> PathBuf {
        folder::base().unwrap().join(&run.0)
    }

    /// Waits until a run's folder is gone: another process's sweep may be at it at this very moment.
    fn assert_removed(run: &RunName) {
        let start = Instant::now();
        while folder(run).exists() {
            assert!(start.elapsed() < Duration::from_secs(60), "{run} is left");
            thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn names_stay_within_their_folder() {
        for name in ["a", "9-b_c.d", &"x".repeat(64)] {
            assert_eq!(name.parse::<RunName>().unwrap().to_string(), name);
        }
        for name in [
            "",
            ".",
            "..",
            ".a",
            "-a",
            "a/b",
            "a b",
            "é",
            &"x".repeat(65),
        ] {
            assert!(name.parse::<RunName>().is_err(), "{name}");
        }
        assert_ne!(RunName::unique(), RunName::unique());
    }

    #[test]
    fn the_last_one_to_leave_removes_the_folder() {
        let run = RunName::unique();
        let one = Presence::enter(&run).unwrap();
        let other = Presence::enter(&run).unwrap();
        sweep();
        drop(one);
        assert!(folder(&run).is_dir());
        drop(other);
        assert_removed(&run);
    }

    #[test]
    fn abandoned_runs_are_swept() {
        let run = RunName::unique();
        let mut presence = Presence::enter(&run).unwrap();
        fs::create_dir_all(folder(&run).join("nodes/1")).unwrap();
        let shared = Path::new(SHARED_MEMORY).join(format!("{}x", run.prefix()));
        let has_shared_memory = fs::write(&shared, "x").is_ok();
        sweep();
        assert!(folder(&run).exists());
        // A process that dies gives up its lock and nothing else.
        presence.lock = None;
        std::mem::forget(presence);
        sweep();
        assert_removed(&run);
        assert!(!has_shared_memory || !shared.exists());
    }
}
