//! Files that are replaced as a whole: whatever happens, the old one is there or the new one.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

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

/// Makes a folder and those above it, whose names are on the disk when this returns.
///
/// # Errors
/// The file system's.
pub fn create_folder_durably(path: &Path) -> io::Result<()> {
    let missing: Vec<&Path> = path
        .ancestors()
        .take_while(|folder| !folder.as_os_str().is_empty() && !folder.exists())
        .collect();
    fs::create_dir_all(path)?;
    missing
        .into_iter()
        .rev()
        .try_for_each(|folder| sync_folder(folder.parent()))
}

/// Makes sure that these files, and their names in the folder that holds them, are on the disk. One that is gone is left out.
///
/// # Errors
/// The file system's.
pub fn sync(folder: &Path, files: &[PathBuf]) -> io::Result<()> {
    for file in files {
        match File::open(file) {
            Ok(file) => file.sync_all()?,
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(error),
        }
    }
    match files.is_empty() {
        true => Ok(()),
        false => sync_folder(Some(folder)),
    }
}

/// Makes sure that the names in a folder are on the disk.
fn sync_folder(folder: Option<&Path>) -> io::Result<()> {
    let folder = folder.filter(|folder| !folder.as_os_str().is_empty());
    // Only Unix opens folders; elsewhere a rename is as safe as the system makes it.
    if cfg!(unix) {
        match File::open(folder.unwrap_or(Path::new(".")))?.sync_all() {
            // Some file systems over a network sync no folders; what they do is all that can be had.
            Err(error)
                if matches!(
                    error.kind(),
                    io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported
                ) => {}
            synced => synced?,
        }
    }
    Ok(())
}
