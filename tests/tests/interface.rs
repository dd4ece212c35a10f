//! The public interface of `tpg-runtime`, which firmware is written against, as a golden file.
//!
//! What a change removes or alters there breaks firmware and needs a new number of the version, and a line in the changelog that
//! says what to write instead. What it only adds does not.

#[path = "interface/listing.rs"]
mod listing;

use std::path::Path;

use tpg_tests::golden;

#[test]
fn the_interface_is_the_one_that_is_written_down() {
    let lib = Path::new(env!("CARGO_MANIFEST_DIR")).join("../runtime/src/lib.rs");
    let lines = listing::interface(&lib);
    let mut text = String::new();
    for line in &lines {
        text.push_str(line);
        text.push('\n');
    }
    assert!(
        lines.len() > 300,
        "{} lines: the listing lost something",
        lines.len()
    );
    golden::assert_text("interface.txt", &text);
}
