//! Golden files with an explicit switch to accept changes.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

/// Set this environment variable to `1` to overwrite golden files with what the tests computed.
pub const ACCEPT: &str = "TPG_ACCEPT";

/// A file below `tests/golden`.
#[must_use]
pub fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("golden")
        .join(name)
}

/// Compares text with a golden file, line by line.
///
/// # Panics
/// If they differ, with the lines that do; if the file cannot be read or, when accepting, written.
pub fn assert_text(name: &str, computed: &str) {
    let Some(golden) = read_or_accept(name, computed.as_bytes()) else {
        return;
    };
    let golden = String::from_utf8(golden).expect("golden text is UTF-8");
    if golden == computed {
        return;
    }
    let (old, new): (Vec<_>, Vec<_>) = (golden.lines().collect(), computed.lines().collect());
    let removed = old.iter().filter(|line| !new.contains(line));
    let added = new.iter().filter(|line| !old.contains(line));
    let diff: Vec<String> = removed
        .map(|line| format!("- {line}"))
        .chain(added.map(|line| format!("+ {line}")))
        .collect();
    panic!("{}\n{}", complaint(name), diff.join("\n"));
}

/// Compares bytes with a golden file.
///
/// # Panics
/// As [`assert_text`], with the place of the first difference.
pub fn assert_bytes(name: &str, computed: &[u8]) {
    let Some(golden) = read_or_accept(name, computed) else {
        return;
    };
    if golden != computed {
        let same = golden.iter().zip(computed).take_while(|(x, y)| x == y);
        let (at, lengths) = (same.count(), (golden.len(), computed.len()));
        panic!(
            "{}\nfirst difference at byte {at}; lengths (golden, computed) = {lengths:?}",
            complaint(name)
        );
    }
}

fn complaint(name: &str) -> String {
    format!("golden/{name} differs; set {ACCEPT}=1 to accept what was computed")
}

fn read_or_accept(name: &str, computed: &[u8]) -> Option<Vec<u8>> {
    let path = path(name);
    if env::var(ACCEPT).is_ok_and(|value| value == "1") {
        let folder = path.parent().expect("below golden");
        fs::create_dir_all(folder).expect("golden folder can be made");
        fs::write(&path, computed).expect("golden file can be written");
        return None;
    }
    match fs::read(&path) {
        Ok(bytes) => Some(bytes),
        Err(fault) => panic!("golden/{name}: {fault}; set {ACCEPT}=1 to make it"),
    }
}
