//! Checks that MuJoCo and Gymnasium's models are there, and records where they are.

use sha2::{Digest as _, Sha256};
use std::{
    env, fs,
    path::{Path, PathBuf},
    process::exit,
};

/// The MJCF files and their SHA-256, as `scripts/setup` fetches and checks them.
const PINS: &str = "../../scripts/models.txt";

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed={PINS}");
    println!("cargo::rerun-if-env-changed=MUJOCO_DYNAMIC_LINK_DIR");
    println!("cargo::rerun-if-env-changed=MUJOCO_STATIC_LINK_DIR");
    println!("cargo::rerun-if-env-changed=TPG_MODELS_DIR");
    if env::var_os("CARGO_FEATURE_MUJOCO").is_none() {
        return;
    }
    library();
    println!("cargo::rustc-env=TPG_MODELS_DIR={}", models().display());
}

/// Checks the library's folder and puts it into the executables, so that they find it wherever they are started.
///
/// Where mujoco-rs links statically or asks pkg-config, there is nothing to check.
fn library() {
    if env::var_os("MUJOCO_STATIC_LINK_DIR").is_some() {
        return;
    }
    let Some(folder) = env::var_os("MUJOCO_DYNAMIC_LINK_DIR").map(PathBuf::from) else {
        return;
    };
    let target = |key: &str| env::var(key).unwrap_or_default();
    let name = match target("CARGO_CFG_TARGET_OS").as_str() {
        "windows" => "mujoco.lib",
        "macos" => "libmujoco.dylib",
        _ => "libmujoco.so",
    };
    println!("cargo::rerun-if-changed={}", folder.join(name).display());
    if !folder.join(name).is_file() {
        fail(
            &format!(
                "the MuJoCo library is missing: no {name} in {}",
                folder.display()
            ),
            "MUJOCO_DYNAMIC_LINK_DIR=/path/to/mujoco-3.17.0/lib",
        );
    }
    if target("CARGO_CFG_TARGET_FAMILY") == "unix" {
        println!("cargo::rustc-link-arg=-Wl,-rpath,{}", folder.display());
    }
}

/// The folder with the models, each of them the very file that the versions of the tasks stand for.
fn models() -> PathBuf {
    let here =
        PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets CARGO_MANIFEST_DIR"));
    let folder = env::var_os("TPG_MODELS_DIR")
        .map_or_else(|| here.join("../../third_party/gymnasium"), PathBuf::from);
    let folder = std::path::absolute(&folder).unwrap_or(folder);
    let pins =
        fs::read_to_string(here.join(PINS)).expect("scripts/models.txt is part of the repository");
    for (digest, name) in pins.lines().filter_map(|line| line.split_once("  ")) {
        let path = folder.join(name);
        println!("cargo::rerun-if-changed={}", path.display());
        if let Err(fault) = check(&path, digest) {
            fail(
                &format!("{fault}: {}", path.display()),
                "TPG_MODELS_DIR=/path/to/folder",
            );
        }
    }
    folder
}

fn check(path: &Path, digest: &str) -> Result<(), &'static str> {
    let bytes = fs::read(path).map_err(|_| "a model of Gymnasium 1.4.0 is missing")?;
    let found: String = Sha256::digest(&bytes)
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    if found == digest {
        Ok(())
    } else {
        Err("a model differs from the one of Gymnasium 1.4.0 that scripts/models.txt pins")
    }
}

fn fail(what: &str, own: &str) -> ! {
    println!("cargo::error={what}");
    println!(
        "cargo::error=run scripts/setup, or use your own: {own}, or build without MuJoCo: --no-default-features"
    );
    exit(1)
}
