//! Builds a co-simulation unit: the host's C compiler makes its shared library.

use std::env::consts::{ARCH, DLL_EXTENSION, OS};
use std::ffi::OsString;
use std::fs;
use std::io::ErrorKind;
use std::path::Path;
use std::process::Command;

use anyhow::anyhow;
use tpg_runtime::Policy;
use tpg_tasks::exit_status::{Failure, Fault as _};
use tpg_tools::export::Fmu;

/// Options that keep the bits, and let the library show nothing but the interface.
const OPTIONS: [&str; 6] = [
    "-std=c99",
    "-O2",
    "-ffp-contract=off",
    "-fPIC",
    "-shared",
    "-fvisibility=hidden",
];

/// The unit of a policy as the bytes of a file. `name` is an identifier of C.
pub(super) fn build(policy: &Policy<'_>, name: &str, command: &str) -> Result<Vec<u8>, Failure> {
    let mut unit = Fmu::new(policy, name, command);
    let folder = tempfile::tempdir().or_usage("cannot make a temporary folder")?;
    let library = compile(&unit, folder.path(), name)?;
    let file = format!("{name}.{DLL_EXTENSION}");
    // The standard's names of systems.
    let system = if OS == "macos" { "darwin" } else { OS };
    unit.add_library(&format!("{ARCH}-{system}"), &file, library);
    Ok(unit.pack())
}

fn compile(unit: &Fmu, folder: &Path, name: &str) -> Result<Vec<u8>, Failure> {
    let library = folder.join(format!("{name}.{DLL_EXTENSION}"));
    let compiler = std::env::var_os("CC").unwrap_or_else(|| OsString::from("cc"));
    let mut cc = Command::new(&compiler);
    cc.current_dir(folder).args(OPTIONS).arg("-o").arg(&library);
    for (file, text) in unit.sources() {
        fs::write(folder.join(file), text).or_unwritable(folder.join(file))?;
        if file.ends_with(".c") {
            cc.arg(file);
        }
    }
    let compiler = compiler.display();
    let output = cc.arg("-lm").output().map_err(|fault| {
        let missing = fault.kind() == ErrorKind::NotFound;
        let advice = if missing {
            "install a C compiler (Debian: apt-get install gcc), or name one in the environment variable CC"
        } else {
            "it could not be started"
        };
        Failure::usage(anyhow!(fault).context(format!(
            "cannot compile the unit's library with {compiler}: {advice}"
        )))
    })?;
    if !output.status.success() {
        let says = String::from_utf8_lossy(&output.stderr);
        return Err(Failure::usage(anyhow!(
            "{compiler} does not compile the unit's library: {}",
            says.trim_end()
        )));
    }
    Ok(fs::read(&library)?)
}
