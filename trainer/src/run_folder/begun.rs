//! Where, when and by what a run was begun.

use std::time::SystemTime;

use serde::{Deserialize, Serialize};

/// What a run's folder says of its beginning; no part of it changes a result.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct Begun {
    /// UTC, as RFC 3339 writes it.
    date: String,
    host: String,
    /// Threads that score, or ranks of an MPI job.
    threads: usize,
    /// The commit that the program was built from, where it is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    commit: Option<String>,
}

impl Begun {
    /// Here and now.
    pub(super) fn now(threads: usize, commit: Option<&str>) -> Self {
        Begun {
            date: humantime::format_rfc3339_seconds(SystemTime::now()).to_string(),
            host: gethostname::gethostname().to_string_lossy().into_owned(),
            threads,
            commit: commit.map(str::to_owned),
        }
    }

    /// Names and values, as a page shows them.
    pub(super) fn facts(&self) -> Vec<(&'static str, String)> {
        let commit = self.commit.clone().map(|commit| ("commit", commit));
        let mut facts = vec![
            ("begun", self.date.clone()),
            ("host", self.host.clone()),
            ("threads", self.threads.to_string()),
        ];
        facts.extend(commit);
        facts
    }
}
