//! Puts the folder of the MuJoCo library into the executables, so that they find it wherever they are started.

use std::env;

pub(crate) fn main() {
    println!("cargo::rerun-if-env-changed=MUJOCO_DYNAMIC_LINK_DIR");
    let unix = env::var("CARGO_CFG_TARGET_FAMILY").is_ok_and(|family| family == "unix");
    if env::var_os("CARGO_FEATURE_MUJOCO").is_some()
        && unix
        && let Ok(folder) = env::var("MUJOCO_DYNAMIC_LINK_DIR")
    {
        println!("cargo::rustc-link-arg=-Wl,-rpath,{folder}");
    }
}
