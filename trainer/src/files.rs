//! Files that are replaced as a whole: whatever happens, the old one is there or the new one.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::Path;

/// Replaces the file at `path` by the parts, one after another. A crash of the process leaves the old file or the new one.
///
/// # Errors
/// The file system's; the old file is then still there.
pub fn replace(path: &Path, parts: &[&[u8]]) -> io::Result<()> {
    write_and_rename(path, parts, |_| Ok(()))
}

/// Replaces a file like [`replace`], and leaves the old one or the new one after a power cut too.
///
/// The bytes reach the disk before the name does, and the name before this returns.
///
/// # Errors
/// The file system's; the old file is then still there, or the new one in its place.
pub fn replace_durably(path: &Path, parts: &[&[u8]]) -> io::Result<()> {
    write_and_rename(path, parts, File::sync_all)?;
    sync_folder(path.parent())
}

fn write_and_rename(
    path: &Path,
    parts: &[&[u8]],
    finish: impl FnOnce(&File) -> io::Result<()>,
) -> io::Result<()> {
    let temporary = path.with_extension("tmp");
    let written = File::create(&temporary).and_then(|mut file| {
        for part in parts {
            file.write_all(part)?;
        }
        finish(&file)
    });
    let replaced = written.and_then(|()| fs::rename(&temporary, path));
    if replaced.is_err() {
        // What is half-written would only take room on a disk that may be full.
        let _ = fs::remove_file(&temporary);
    }
    replaced
}

/// Makes sure that the names in a folder reach the disk.
fn sync_folder(folder: Option<&Path>) -> io::Result<()> {
    let folder = folder.filter(|folder| !folder.as_os_str().is_empty());
    // Only Unix opens folders; elsewhere a rename is as safe as the system makes it.
    if cfg!(unix) {
        File::open(folder.unwrap_or(Path::new(".")))?.sync_all()?;
    }
    Ok(())
}
