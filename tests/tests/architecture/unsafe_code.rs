//! Where `unsafe` may stand. Clippy's `undocumented_unsafe_blocks` knows the language better, but the boards are
//! workspaces of their own, where it runs only if their target is installed.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// The files that may hold `unsafe`, and what for.
const ALLOWED: &[(&str, &str)] = &[
    ("runtime/c-api/src/agent.rs", "pointers of a C program"),
    ("runtime/c-api/src/status.rs", "names that C links to"),
    (
        "trainer/tasks/src/task/mujoco/custom/names.rs",
        "MuJoCo's table of names",
    ),
    (
        "trainer/tasks/src/task/mujoco/custom/randomize.rs",
        "gains of actuators",
    ),
    (
        "trainer/tasks/src/task/mujoco/sim.rs",
        "MuJoCo's log handler",
    ),
    ("tests/tests/no_allocation.rs", "an allocator that counts"),
];
/// Folders whose files all may: boards, which reach their devices and memory in no other way.
const ALLOWED_FOLDERS: &[&str] = &["firmware-examples/"];
/// Folders with Rust files.
const FOLDERS: &[&str] = &[
    "runtime",
    "trainer",
    "sim-bridge",
    "tests",
    "firmware-examples",
];
/// How far above an `unsafe` its reason may begin, in lines.
const REACH: usize = 12;

/// Every file that holds `unsafe` without being listed, or is listed without it, and every `unsafe` without a reason.
pub fn faults(root: &Path) -> Vec<String> {
    let mut faults = Vec::new();
    let mut unused: BTreeSet<&str> = ALLOWED.iter().map(|(path, _)| *path).collect();
    for folder in FOLDERS {
        for path in files(root, folder) {
            let source = fs::read_to_string(root.join(&path)).expect("text");
            let blocks = lines_with_unsafe(&source);
            if blocks.is_empty() {
                continue;
            }
            let listed = unused.remove(path.as_str());
            if !listed
                && !ALLOWED_FOLDERS
                    .iter()
                    .any(|folder| path.starts_with(folder))
            {
                faults.push(format!(
                    "{path} holds `unsafe`: list it here, with what for"
                ));
            }
            let lines: Vec<&str> = source.lines().collect();
            for at in blocks {
                let above = &lines[at.saturating_sub(REACH)..=at];
                let block = needs_reason(lines[at]);
                if block && !above.iter().any(|line| line.contains("SAFETY:")) {
                    faults.push(format!(
                        "{path}:{}: `unsafe` without a comment SAFETY:",
                        at + 1
                    ));
                }
            }
        }
    }
    faults.extend(
        unused
            .iter()
            .map(|path| format!("{path} holds no `unsafe`: it need not be listed")),
    );
    faults
}

/// A block or an implementation; a function's duty stands in its documentation, an attribute's in its name.
fn needs_reason(line: &str) -> bool {
    ["unsafe {", "unsafe impl"]
        .iter()
        .any(|start| line.contains(start))
}

fn files(root: &Path, folder: &str) -> Vec<String> {
    let mut found = Vec::new();
    for entry in fs::read_dir(root.join(folder)).expect("a folder") {
        let entry = entry.expect("an entry");
        let path = format!("{folder}/{}", entry.file_name().to_string_lossy());
        if entry.path().is_dir() && !path.ends_with("/target") {
            found.extend(files(root, &path));
        } else if path.ends_with(".rs") {
            found.push(path);
        }
    }
    found
}

/// The lines, from 0, with the word `unsafe` outside comments and strings.
fn lines_with_unsafe(source: &str) -> Vec<usize> {
    let is_unsafe = |line: &str| {
        let mut words = line.split(|c: char| !c.is_alphanumeric() && c != '_');
        words.any(|word| word == "unsafe")
    };
    let code = without_text(source);
    let lines = code.lines().enumerate();
    lines
        .filter(|(_, line)| is_unsafe(line))
        .map(|(at, _)| at)
        .collect()
}

/// The source with strings and line comments blanked out.
fn without_text(source: &str) -> String {
    let (mut code, mut rest) = (String::new(), source);
    while let Some(at) = rest.find(['/', '"', '\'', 'r']) {
        let (before, from) = rest.split_at(at);
        code.push_str(before);
        let len = if from.starts_with("//") {
            from.find('\n').unwrap_or(from.len())
        } else if from.starts_with('"') {
            string_len(from)
        } else if let Some(hashes) = raw_hashes(from, before) {
            let end = format!("\"{}", "#".repeat(hashes));
            let start = hashes + 2;
            from[start..]
                .find(&end)
                .map_or(from.len(), |at| start + at + end.len())
        } else if from.starts_with("'\"'") || from.starts_with("'\\\"'") {
            from[1..].find("'").map_or(1, |at| at + 2)
        } else {
            let first = from.chars().next().map_or(1, char::len_utf8);
            code.push_str(&from[..first]);
            rest = &from[first..];
            continue;
        };
        code.extend(from[..len].chars().filter(|c| *c == '\n'));
        rest = &from[len..];
    }
    code.push_str(rest);
    code
}

fn string_len(from: &str) -> usize {
    let mut escaped = false;
    for (at, c) in from.char_indices().skip(1) {
        if c == '"' && !escaped {
            return at + 1;
        }
        escaped = c == '\\' && !escaped;
    }
    from.len()
}

/// Number of hashes of a raw string that begins here, if one does.
fn raw_hashes(from: &str, before: &str) -> Option<usize> {
    let joined = before.ends_with(|c: char| c.is_alphanumeric() || c == '_');
    let rest = from.strip_prefix('r').filter(|_| !joined)?;
    let hashes = rest.chars().take_while(|c| *c == '#').count();
    rest[hashes..].starts_with('"').then_some(hashes)
}

#[test]
fn words_in_text_do_not_count() {
    let source = r##"// unsafe
        let a = "unsafe \" unsafe"; let b = r#"unsafe " "#;
        let c = '"'; unsafe { f() }"##;
    assert_eq!(lines_with_unsafe(source), [2]);
}
