//! Exported C under static analysis: no findings, and no deviation from MISRA C:2012 that docs/safety.md does not list.

use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;
use std::process::Command;

use tpg_runtime::Policy;
use tpg_tests::{firmware, golden, samples};
use tpg_tools::export;

/// Writes champions and golden policies, which have every operation, as C; returns the sources.
fn sources(folder: &std::path::Path) -> Vec<PathBuf> {
    let mut policies: Vec<(String, PathBuf)> = samples::all()
        .into_iter()
        .map(|(name, _)| {
            (
                format!("golden_{name}"),
                golden::path(&format!("v3/{name}.tpg")),
            )
        })
        .collect();
    let champions = firmware::repository().join("docs/champions");
    for entry in fs::read_dir(champions).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.extension().is_some_and(|e| e == "tpg") {
            let name = path.file_stem().expect("a name").display().to_string();
            policies.push((name, path));
        }
    }
    let write = |(name, path): (String, PathBuf)| {
        let name = name.replace('-', "_");
        let bytes = fs::read(path).expect("a policy");
        let c = export::c(&Policy::load(&bytes).expect("valid"), &name, "a test");
        fs::write(folder.join(format!("{name}.h")), c.header).expect("written");
        let source = folder.join(format!("{name}.c"));
        fs::write(&source, c.source).expect("written");
        source
    };
    policies.into_iter().map(write).collect()
}

/// What cppcheck says of the sources, to standard error; none if it is missing.
fn cppcheck(options: &[&str], sources: &[PathBuf]) -> Option<String> {
    if !firmware::runs("cppcheck", &["--version"]) {
        firmware::skip(
            "exported C",
            "cppcheck is missing: apt-get install cppcheck",
        );
        return None;
    }
    let mut command = Command::new("cppcheck");
    command
        .args(["--quiet", "--std=c99"])
        .args(options)
        .args(sources);
    let output = command.output().expect("cppcheck runs");
    Some(String::from_utf8(output.stderr).expect("text"))
}

#[test]
fn cppcheck_finds_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let sources = sources(folder.path());
    if let Some(found) = cppcheck(&["--enable=warning,performance,portability"], &sources) {
        assert_eq!(found, "");
    }
}

#[test]
fn deviations_from_misra_are_those_of_the_document() {
    let folder = tempfile::tempdir().expect("a folder");
    let sources = sources(folder.path());
    let Some(found) = cppcheck(&["--addon=misra"], &sources) else {
        return;
    };
    let rules: BTreeSet<&str> = found
        .split("misra-c2012-")
        .skip(1)
        .filter_map(|rest| rest.split(']').next())
        .collect();
    assert!(rules.len() > 5, "the addon did not run: {found}");
    let document = firmware::repository().join("docs/safety.md");
    let document = fs::read_to_string(document).expect("a document");
    let missing = rules
        .iter()
        .filter(|rule| !document.contains(&format!("| {rule} |")));
    let missing: Vec<_> = missing.collect();
    assert!(
        missing.is_empty(),
        "docs/safety.md lists no rule {missing:?}"
    );
}

#[test]
fn clang_warns_of_nothing_in_c_and_cpp() {
    if !firmware::runs("clang", &["--version"]) {
        firmware::skip("exported C", "clang is missing: apt-get install clang");
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let sources = sources(folder.path());
    let warnings = [
        "-Wall",
        "-Wextra",
        "-Werror",
        "-Wpedantic",
        "-Wconversion",
        "-Wshadow",
    ];
    for language in [
        &["-std=c99"][..],
        &["-std=c11"],
        &["-x", "c++", "-std=c++17"],
    ] {
        let mut clang = Command::new("clang");
        clang
            .args(language)
            .args(warnings)
            .args(["-ffp-contract=off", "-fsyntax-only"]);
        let output = clang.args(&sources).output().expect("clang runs");
        assert!(
            output.status.success(),
            "{language:?}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
    }
}
