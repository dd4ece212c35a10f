//! Exported C under static analysis: no findings, no deviation from MISRA C:2012 that docs/safety.md does not list, and no more
//! stack than its header says.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use tpg_runtime::Policy;
use tpg_tests::{firmware, golden, samples};
use tpg_tools::export;

/// Writes champions and golden policies, which have every operation, as C; returns the sources.
fn sources(folder: &Path) -> Vec<PathBuf> {
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

/// The most bytes of stack below a function in GCC's call graph, by its file `.ci`: nodes with frames, and edges.
fn deepest(graph: &str, from: &str) -> u64 {
    let (mut frames, mut calls) = (BTreeMap::new(), BTreeMap::<&str, Vec<&str>>::new());
    for line in graph.lines() {
        let words: Vec<&str> = line.split('"').collect();
        if line.starts_with("node:") {
            let bytes = words[3]
                .split("\\n")
                .find_map(|part| part.split_once(" bytes ("));
            frames.insert(words[1], bytes.and_then(|(bytes, _)| bytes.parse().ok()));
        } else if line.starts_with("edge:") {
            calls.entry(words[1]).or_default().push(words[3]);
        }
    }
    fn below<'g>(
        name: &'g str,
        frames: &BTreeMap<&'g str, Option<u64>>,
        calls: &BTreeMap<&'g str, Vec<&'g str>>,
    ) -> u64 {
        let called = calls.get(name).into_iter().flatten();
        let called = called.map(|next| below(next, frames, calls)).max();
        // The compiler's own functions, such as memset, have no frame of their own here.
        frames.get(name).copied().flatten().unwrap_or(0) + called.unwrap_or(0)
    }
    let start = frames.keys().find(|name| name.ends_with(from));
    below(start.expect("the function"), &frames, &calls)
}

#[test]
fn a_decision_takes_no_more_stack_than_the_header_says() {
    const GCC: &str = "arm-none-eabi-gcc";
    if !firmware::runs(GCC, &["--version"]) {
        firmware::skip(
            "exported C",
            "arm-none-eabi-gcc is missing: apt-get install gcc-arm-none-eabi",
        );
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let processors = [
        &["-mcpu=cortex-m4", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"][..],
        &["-mcpu=cortex-m0", "-mfloat-abi=soft"],
    ];
    for source in sources(folder.path()) {
        let name = source.file_stem().expect("a name").display().to_string();
        let header = fs::read_to_string(source.with_extension("h")).expect("a header");
        let said = header.split("_STACK_BYTES ").nth(1).expect("a stack");
        let said: u64 = said.lines().next().expect("a line").parse().expect("bytes");
        for processor in processors {
            let object = folder.path().join("object.o");
            let mut gcc = Command::new(GCC);
            gcc.args([
                "-std=c99",
                "-Os",
                "-mthumb",
                "-ffreestanding",
                "-fcallgraph-info=su",
                "-c",
            ]);
            gcc.args(processor).arg(&source).arg("-o").arg(&object);
            assert!(gcc.status().expect("gcc runs").success(), "{name}");
            let graph = fs::read_to_string(object.with_extension("ci")).expect("a graph");
            let taken = deepest(&graph, &format!("{name}_decide"));
            println!("{name} {}: {taken} of {said} bytes", processor[0]);
            assert!(
                taken > 0 && taken <= said,
                "{name}: {taken} of {said} bytes with {processor:?}"
            );
        }
    }
}
