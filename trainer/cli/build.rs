//! Where the executable finds MuJoCo, and the commit that it is built from.

#[path = "../tasks/commit.rs"]
mod commit;
#[path = "../tasks/rpath.rs"]
mod rpath;

fn main() {
    rpath::main();
    println!("cargo::rerun-if-changed=build.rs");
    let version = env!("CARGO_PKG_VERSION");
    match commit::main() {
        Some(commit) => println!("cargo::rustc-env=TPG_VERSION={version} ({commit})"),
        None => println!("cargo::rustc-env=TPG_VERSION={version}"),
    }
}
