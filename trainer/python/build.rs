//! The commit that the package is built from.

#[path = "../tasks/commit.rs"]
mod commit;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let _ = commit::main();
}
