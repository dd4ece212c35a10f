//! Where the executable finds MuJoCo, and the commit that it is built from.

#[path = "../tasks/rpath.rs"]
mod rpath;

use std::process::Command;

fn main() {
    rpath::main();
    println!("cargo::rerun-if-changed=build.rs");
    let version = env!("CARGO_PKG_VERSION");
    // Sources without a repository, such as a package's, have no commit.
    let Some(commit) = git(&["rev-parse", "--short=12", "HEAD"]) else {
        println!("cargo::rustc-env=TPG_VERSION={version}");
        return;
    };
    println!("cargo::rustc-env=TPG_VERSION={version} ({commit})");
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
}

/// What Git says, or nothing if it fails or is not there.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    let text = text.trim();
    (output.status.success() && !text.is_empty()).then(|| text.to_owned())
}
