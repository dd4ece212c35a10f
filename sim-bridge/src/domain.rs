//! Where on this machine the loops live: file names of their own, apart from other iceoryx2 programs.

use iceoryx2::node::NodeView as _;
use iceoryx2::prelude::*;

use crate::error::BridgeError;

/// Every name in shared memory begins with it.
const PREFIX: &[u8] = b"tpg_";

/// Shared memory that a loop needs at most; a plant's part was measured as a third of it.
#[cfg(target_os = "linux")]
const SHARED_BYTES: usize = 256 * 1024;

/// The configuration of every node; no file of the machine changes it.
///
/// Loops share it, so that each start clears what died before. They are told apart by the names of their services.
pub(crate) fn config() -> Result<Config, BridgeError> {
    let failed = "choose its names";
    let mut config = Config::default();
    config.global.prefix = FileName::new(PREFIX)
        .map_err(|e| BridgeError::transport(failed)(format!("FileName::{e:?}")))?;
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt as _;
        // A folder for each user: another user's would not be writable. Without /proc all share one.
        let user = std::fs::metadata("/proc/self").map_or(0, |m| m.uid());
        let root = Path::new(format!("/tmp/tpg-bridge-{user}").as_bytes())
            .map_err(|e| BridgeError::transport(failed)(format!("Path::{e:?}")))?;
        config.global.set_root_path(&root);
    }
    Ok(config)
}

/// Creates a node; what dead processes left behind is removed on the way.
pub(crate) fn node(name: &str) -> Result<Node<ipc::Service>, BridgeError> {
    // What matters comes back as an error; the library's own account of it would say everything twice.
    set_log_level(LogLevel::Fatal);
    check_space()?;
    let name = NodeName::new(name).map_err(BridgeError::transport("name the process"))?;
    NodeBuilder::new()
        .name(&name)
        .config(&config()?)
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create::<ipc::Service>()
        .map_err(BridgeError::transport("register the process"))
}

/// Removes what dead processes left behind, for a parent whose children had to be killed.
pub fn sweep() {
    set_log_level(LogLevel::Fatal);
    let Ok(config) = config() else { return };
    // Nothing to be done about what cannot be removed; the next start tries again.
    let _ = Node::<ipc::Service>::list(&config, |state| {
        if let NodeState::Dead(dead) = state {
            let _ = dead.try_remove_stale_resources();
        }
        CallbackProgression::Continue
    });
}

/// What has become of a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Fate {
    /// It lives, or cannot be looked at.
    Alive,
    /// It ended without clearing up.
    Dead,
    /// It cleared up, or another process did that for it.
    Gone,
}

/// Looks after a peer; takes about half a millisecond.
pub(crate) fn fate(config: &Config, node_id: iceoryx2::identifiers::UniqueNodeId) -> Fate {
    match Node::<ipc::Service>::state_of(config, node_id) {
        Ok(Some(NodeState::Dead(_))) => Fate::Dead,
        Ok(None) => Fate::Gone,
        _ => Fate::Alive,
    }
}

/// The process number of a node, as far as it can be read.
pub(crate) fn process_of(
    config: &Config,
    node_id: iceoryx2::identifiers::UniqueNodeId,
) -> Option<u32> {
    let details = match Node::<ipc::Service>::state_of(config, node_id) {
        Ok(Some(NodeState::Alive(view))) => view.details().clone(),
        Ok(Some(NodeState::Dead(view))) => view.details().clone(),
        _ => None,
    }?;
    u32::try_from(details.process_id().value()).ok()
}

/// Writes and removes as much as a loop needs: memory that runs out later ends the process with SIGBUS.
#[cfg(target_os = "linux")]
fn check_space() -> Result<(), BridgeError> {
    const PLACE: &str = "/dev/shm";
    let path = format!("{PLACE}/tpg_space_{}", std::process::id());
    let written = std::fs::write(&path, vec![1; SHARED_BYTES]);
    let removed = std::fs::remove_file(&path);
    written.and(removed).map_err(|source| BridgeError::NoSpace {
        place: PLACE,
        needed: SHARED_BYTES,
        source,
    })
}

#[cfg(not(target_os = "linux"))]
fn check_space() -> Result<(), BridgeError> {
    Ok(())
}
