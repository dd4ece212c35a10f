//! The iceoryx2 domain of a run: names apart from other runs and other programs.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::os::unix::fs::OpenOptionsExt as _;
use std::time::{SystemTime, UNIX_EPOCH};

use iceoryx2::prelude::*;

use crate::error::BridgeError;
use crate::folder::{is_ours, options, restrict};
use crate::run::{RunName, SHARED_MEMORY, shared_files};

/// Shared memory that must be free; a loop was measured to take a tenth of it.
const SHARED_BYTES: usize = 256 * 1024;

/// Creates a node in a run's domain, whose files lie in `folder`; no file of the machine changes its configuration.
pub(crate) fn node(
    run: &RunName,
    folder: &std::path::Path,
    name: &str,
) -> Result<Node<ipc::Service>, BridgeError> {
    // Failures come back as errors; the library's own log would repeat them.
    set_log_level(LogLevel::Fatal);
    check_space(run, name).map_err(no_space)?;
    check_owners(run)?;
    let mut config = Config::default();
    let prefix = run.prefix();
    let failed = "name its files";
    config.global.prefix =
        FileName::new(prefix.as_bytes()).map_err(BridgeError::transport(failed))?;
    let root =
        Path::new(folder.as_os_str().as_encoded_bytes()).map_err(BridgeError::transport(failed))?;
    config.global.set_root_path(&root);
    let name = NodeName::new(name).map_err(BridgeError::transport("name the process"))?;
    let node = NodeBuilder::new()
        .name(&name)
        .config(&config)
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create::<ipc::Service>()
        .map_err(BridgeError::transport("register the process"))?;
    // The library lets every user write to the file that counts its nodes; both processes of a run are one user's.
    for file in shared_files(run) {
        // The peer may have removed its own meanwhile.
        let _ = restrict(&file);
    }
    Ok(node)
}

/// Checks that what has the names of the run's shared memory is this user's, and memory.
///
/// The library would wait for ever for a pipe of such a name.
fn check_owners(run: &RunName) -> Result<(), BridgeError> {
    for file in shared_files(run) {
        match is_ours(&file) {
            Ok(true) => {}
            Ok(false) => {
                return Err(BridgeError::NotOurs {
                    path: file.display().to_string(),
                });
            }
            // The peer has removed it.
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(BridgeError::transport("look at its files")(error)),
        }
    }
    Ok(())
}

fn no_space(source: io::Error) -> BridgeError {
    BridgeError::NoSpace {
        place: SHARED_MEMORY,
        needed: SHARED_BYTES,
        source,
    }
}

/// Writes as much as a loop needs, since memory that runs out later would end the process with SIGBUS.
fn check_space(run: &RunName, name: &str) -> io::Result<()> {
    if !fs::exists(SHARED_MEMORY)? {
        return Ok(());
    }
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    let nanos = now.map_or(0, |now| now.as_nanos());
    let name = format!("{}{name}_{}_{nanos:x}", run.prefix(), std::process::id());
    let path = std::path::Path::new(SHARED_MEMORY).join(name);
    // A name that somebody has taken is an error: the file behind it may be another user's.
    let mut file = options()
        .write(true)
        .create_new(true)
        .mode(0o600)
        .open(&path)?;
    // The file has no name from here on, so that closing it frees the memory in any case.
    fs::remove_file(path)?;
    fill(&mut file)
}

fn fill(file: &mut File) -> io::Result<()> {
    file.write_all(&vec![0; SHARED_BYTES])
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;
    use crate::Status;

    #[test]
    fn memory_that_is_full_is_told_with_the_bytes_needed() {
        // A device that is always full.
        let mut full = File::options().write(true).open("/dev/full").unwrap();
        let error = fill(&mut full).map_err(no_space).unwrap_err();
        assert_eq!(
            error.to_string(),
            "/dev/shm has no 262144 bytes of shared memory left: free some, or enlarge it"
        );
        assert_eq!(error.status(), Status::OurFault);
        let cause = std::error::Error::source(&error).map(ToString::to_string);
        assert!(cause.is_some_and(|cause| cause.contains("space")));
    }
}
