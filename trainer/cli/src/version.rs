//! Which program this is; its build script knows.

/// The commit that it was built from: 12 hexadecimal digits, where sources came from a repository.
pub(crate) const COMMIT: Option<&str> = option_env!("TPG_COMMIT");

/// Version and commit, as `--version` shows them.
pub(crate) const VERSION: &str = env!("TPG_VERSION");
