//! Sends and receives the bytes of messages.

use std::time::Duration;

use mpi::Tag;
use mpi::environment::Universe;
use mpi::point_to_point::Status;
use mpi::topology::{Rank, SimpleCommunicator};
use mpi::traits::{Communicator as _, Destination as _, MatchedReceiveVec as _, Source as _};
use serde::Serialize;

use super::wire;

/// The rank that evolves.
pub(super) const HEAD: Rank = 0;

/// This process's end of the job's network.
pub(super) struct Link {
    pub(super) world: SimpleCommunicator,
    /// Dropped last: that ends MPI.
    _universe: Universe,
}

impl Link {
    pub(super) fn new(mut universe: Universe, world: SimpleCommunicator) -> Self {
        // Messages are copied there and leave while this process computes.
        universe.set_buffer_size(wire::BUFFER);
        Link {
            world,
            _universe: universe,
        }
    }

    pub(super) fn size(&self) -> usize {
        self.world.size() as usize
    }

    /// Sends a message without waiting for its receiver, unless it is very long.
    ///
    /// Rank 0 never waits in practice, so two ranks cannot wait for each other.
    pub(super) fn send(&self, to: Rank, tag: Tag, bytes: &[u8]) {
        let process = self.world.process_at_rank(to);
        let short = match to {
            HEAD => wire::SHORT_ANSWER,
            _ => wire::SHORT_PACK,
        };
        if bytes.len() <= short {
            process.buffered_send_with_tag(bytes, tag);
        } else {
            process.send_with_tag(bytes, tag);
        }
    }

    pub(super) fn send_value(&self, to: Rank, tag: Tag, value: &impl Serialize) {
        self.send(to, tag, &wire::encode(value));
    }

    /// A message that is there: its sender, tag and bytes.
    pub(super) fn receive(&self) -> Option<(Rank, Tag, Vec<u8>)> {
        let (message, status): (_, Status) = self.world.any_process().immediate_matched_probe()?;
        let (rank, tag) = (status.source_rank(), status.tag());
        let (bytes, _) = (message, status).matched_receive_vec::<u8>();
        Some((rank, tag, bytes))
    }
}

/// Waits for messages: at first without pause, then with short ones, so that a core that ranks share is not wasted.
#[derive(Debug, Default)]
pub(super) struct Idle {
    looks: u32,
}

impl Idle {
    const WITHOUT_PAUSE: u32 = 200;
    const PAUSE: Duration = Duration::from_micros(20);

    pub(super) fn wait(&mut self) {
        if self.looks < Self::WITHOUT_PAUSE {
            self.looks += 1;
            std::hint::spin_loop();
        } else {
            std::thread::sleep(Self::PAUSE);
        }
    }
}
