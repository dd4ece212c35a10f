//! The files of the task that a run depends on: a run that goes on has to find them as they were.

use sha2::{Digest as _, Sha256};

use super::error::RunFolderError;
use crate::session::{Session, TaskFile};

/// The files that a session's task depends on, as they are now; in place of those of a task that lies elsewhere, its description.
pub(super) fn task_files(session: &Session) -> Result<Vec<TaskFile>, RunFolderError> {
    let hex = |digest: [u8; 32]| digest.iter().map(|byte| format!("{byte:02x}")).collect();
    let settings = session.settings();
    if settings.external {
        let digest = Sha256::digest(&settings.task_identity).into();
        return Ok(vec![(
            format!("the spaces of {}", session.config().task),
            hex(digest),
        )]);
    }
    let sources = tpg_tasks::task::sources(&session.config().task);
    let files = sources.map_err(RunFolderError::Task)?.into_iter();
    Ok(files.map(|(name, digest)| (name, hex(digest))).collect())
}

/// The names of files that are new, changed or gone; `None` if all are as before.
pub(super) fn changed(before: &[TaskFile], now: &[TaskFile]) -> Option<String> {
    let of = |files: &[TaskFile], other: &[TaskFile]| -> Vec<String> {
        let differs = files.iter().filter(|file| !other.contains(file));
        differs.map(|(name, _)| name.clone()).collect()
    };
    let mut names = of(now, before);
    names.extend(of(before, now));
    names.sort();
    names.dedup();
    (!names.is_empty()).then(|| names.join(", "))
}
