//! The process at the other end: who it is and what has become of it.

use std::thread;
use std::time::{Duration, Instant};

use iceoryx2::identifiers::UniqueNodeId;
use iceoryx2::node::NodeView as _;
use iceoryx2::prelude::*;

use crate::error::BridgeError;
use crate::message::Role;

/// Longest time for which a process that clears up looks dead.
const CLEARING_UP: Duration = Duration::from_millis(200);
/// Time between two looks at it.
const LOOK_INTERVAL: Duration = Duration::from_millis(5);

/// A process that has been met.
#[derive(Debug)]
pub(crate) struct Peer {
    role: Role,
    node_id: UniqueNodeId,
    /// Its number, 0 where it cannot be read.
    pub(crate) pid: u32,
}

/// What has become of a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Fate {
    /// It lives, or cannot be looked at.
    Alive,
    /// It ended without clearing up.
    Dead,
    /// It has cleared up.
    Gone,
}

impl Peer {
    pub(crate) fn meet(role: Role, config: &Config, node_id: UniqueNodeId) -> Self {
        let details = match Node::<ipc::Service>::state_of(config, node_id) {
            Ok(Some(NodeState::Alive(view))) => view.details().clone(),
            Ok(Some(NodeState::Dead(view))) => view.details().clone(),
            _ => None,
        };
        let pid = details.and_then(|d| u32::try_from(d.process_id().value()).ok());
        Peer {
            role,
            node_id,
            pid: pid.unwrap_or(0),
        }
    }

    /// Finds out why it is silent, if that must not go on; takes about half a millisecond, longer if it is dead.
    #[cold]
    pub(crate) fn look(
        &self,
        config: &Config,
        waited: Duration,
        timeout: Duration,
    ) -> Result<(), BridgeError> {
        match self.fate(config) {
            Fate::Alive if waited < timeout => Ok(()),
            Fate::Alive => Err(BridgeError::Silent {
                peer: self.role,
                pid: self.pid,
                waited_ms: waited.as_millis(),
            }),
            Fate::Dead | Fate::Gone => Err(self.gone(config)),
        }
    }

    /// Why its port is no longer there; a process counts as dead only if it stays so.
    #[cold]
    pub(crate) fn gone(&self, config: &Config) -> BridgeError {
        let (peer, pid) = (self.role, self.pid);
        let start = Instant::now();
        while self.fate(config) == Fate::Dead {
            if start.elapsed() >= CLEARING_UP {
                return BridgeError::Died { peer, pid };
            }
            thread::sleep(LOOK_INTERVAL);
        }
        BridgeError::Left { peer, pid }
    }

    fn fate(&self, config: &Config) -> Fate {
        match Node::<ipc::Service>::state_of(config, self.node_id) {
            Ok(Some(NodeState::Dead(_))) => Fate::Dead,
            Ok(None) => Fate::Gone,
            _ => Fate::Alive,
        }
    }
}
