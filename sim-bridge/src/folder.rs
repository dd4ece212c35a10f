//! The folder of all runs of a user, which no other user may have a hand in.
//!
//! Whoever could write there, or name the folder first, could have this user create and remove files elsewhere.

use std::env;
use std::fs::{self, DirBuilder, File, Metadata, OpenOptions};
use std::io;
use std::os::unix::fs::{DirBuilderExt as _, MetadataExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};

use nix::errno::Errno;
use nix::fcntl::OFlag;
use nix::unistd::geteuid;

use crate::error::BridgeError;

/// Rights of group and others.
const OTHERS: u32 = 0o077;

/// Whose files this process makes.
pub(crate) fn user() -> u32 {
    geteuid().as_raw()
}

/// Opens a file, but none that a symbolic link names.
pub(crate) fn options() -> OpenOptions {
    let mut options = OpenOptions::new();
    options.custom_flags(OFlag::O_NOFOLLOW.bits());
    options
}

/// The folder, made if need be.
///
/// It lies in `$XDG_RUNTIME_DIR` if that is a folder of this user's alone, else in `/tmp`.
///
/// # Errors
/// [`BridgeError::Folder`] if it is not this user's alone.
pub(crate) fn base() -> Result<PathBuf, BridgeError> {
    let runtime = env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from);
    let runtime = runtime.filter(|path| path.is_absolute() && check(path).is_ok());
    let path = match runtime {
        Some(runtime) => runtime.join("tpg-bridge"),
        None => PathBuf::from(format!("/tmp/tpg-bridge-{}", user())),
    };
    secure(&path)?;
    Ok(path)
}

/// Makes a folder of this user's alone, or checks that the one of this name is.
fn secure(path: &Path) -> Result<(), BridgeError> {
    let refused = |problem: String| BridgeError::Folder {
        path: path.display().to_string(),
        problem,
    };
    match DirBuilder::new().mode(0o700).create(path) {
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => {
            return Err(refused(error.to_string()));
        }
        _ => {}
    }
    check(path).map_err(refused)
}

/// Checks that a path is a folder of this user's alone. Nobody else can then change what lies in it.
fn check(path: &Path) -> Result<(), String> {
    // What is checked is what was opened, and not what has its name later.
    let metadata =
        open_folder(path).map_err(|error| match error.raw_os_error().map(Errno::from_raw) {
            Some(Errno::ENOTDIR | Errno::ELOOP) => "it is no folder, or a symbolic link".to_owned(),
            _ => error.to_string(),
        })?;
    let (owner, mode) = (metadata.uid(), metadata.mode() & 0o777);
    if owner != user() {
        return Err(format!(
            "it belongs to user {owner}, not to user {}",
            user()
        ));
    }
    if mode & OTHERS != 0 {
        return Err(format!("others may use it (mode {mode:o}, 700 is safe)"));
    }
    Ok(())
}

fn open_folder(path: &Path) -> io::Result<Metadata> {
    let mut options = OpenOptions::new();
    let flags = OFlag::O_NOFOLLOW | OFlag::O_DIRECTORY;
    let folder: File = options.read(true).custom_flags(flags.bits()).open(path)?;
    folder.metadata()
}

/// Whether a file is a regular one of this user's. Links are not followed.
pub(crate) fn is_ours(path: &Path) -> io::Result<bool> {
    let metadata = fs::symlink_metadata(path)?;
    Ok(metadata.is_file() && metadata.uid() == user())
}

/// Takes all rights to a file from others.
pub(crate) fn restrict(path: &Path) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt as _;
    let metadata = fs::symlink_metadata(path)?;
    if metadata.is_file() && metadata.mode() & OTHERS != 0 {
        fs::set_permissions(path, fs::Permissions::from_mode(0o600))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::{PermissionsExt as _, chown, symlink};

    use super::*;

    /// A user with no rights to this one's files.
    const NOBODY: u32 = 65_534;

    fn problem(path: &Path) -> String {
        match secure(path) {
            Err(error @ BridgeError::Folder { .. }) => error.to_string(),
            other => panic!("{} is not refused: {other:?}", path.display()),
        }
    }

    #[test]
    fn a_folder_is_made_for_its_user_alone_and_taken_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("runs");
        secure(&path).unwrap();
        assert_eq!(path.metadata().unwrap().mode() & 0o777, 0o700);
        secure(&path).unwrap();
    }

    #[test]
    fn what_others_could_use_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let (target, link) = (folder.path().join("target"), folder.path().join("link"));
        secure(&target).unwrap();
        symlink(&target, &link).unwrap();
        assert!(problem(&link).contains("symbolic link"));
        let file = folder.path().join("file");
        fs::write(&file, "").unwrap();
        assert!(problem(&file).contains("no folder"));
        fs::set_permissions(&target, fs::Permissions::from_mode(0o777)).unwrap();
        assert!(problem(&target).contains("mode 777"));
        assert!(problem(&folder.path().join("no/parent")).contains("No such file"));
    }

    #[test]
    fn another_users_folder_is_refused_with_both_users() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("squatted");
        secure(&path).unwrap();
        if chown(&path, Some(NOBODY), None).is_err() {
            crate::note(format_args!("skipped: only root can give a folder away"));
            return;
        }
        let text = problem(&path);
        assert!(
            text.contains("belongs to user 65534, not to user 0"),
            "{text}"
        );
        assert!(text.contains("XDG_RUNTIME_DIR"), "{text}");
    }
}
