//! The commit that a program is built from; part of the build scripts of programs that make runs.

use std::process::Command;

/// Hands the commit to the compiler as `TPG_COMMIT`: 12 hexadecimal digits. `None` for sources without a repository, such as a
/// package's.
pub(crate) fn main() -> Option<String> {
    let commit = git(&["rev-parse", "--short=12", "HEAD"])?;
    println!("cargo::rustc-env=TPG_COMMIT={commit}");
    // This file grows with every commit and checkout. A file that is not there would make each build run this again.
    if let Some(log) = git(&[
        "rev-parse",
        "--path-format=absolute",
        "--git-path",
        "logs/HEAD",
    ]) && std::path::Path::new(&log).exists()
    {
        println!("cargo::rerun-if-changed={log}");
    }
    Some(commit)
}

/// What Git says, or nothing if it fails or is not there.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    let text = text.trim();
    (output.status.success() && !text.is_empty()).then(|| text.to_owned())
}
