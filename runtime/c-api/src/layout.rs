//! Where the parts of an agent lie in its memory.

use core::mem::{align_of, size_of};

use tpg_runtime::Capacities;
use tpg_runtime::rng::Pcg32;

/// Byte offsets of the parts from the start of the memory, and the number of bytes in all.
///
/// The parts lie in order of decreasing alignment, so that no gap is needed between them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MemoryLayout {
    pub streams: usize,
    pub words: usize,
    pub bids: usize,
    pub visited: usize,
    pub bytes: usize,
}

// The header's fields are small enough that no sum below can overflow 32 bits.
const _: () = assert!(align_of::<Pcg32>() >= align_of::<f32>() && size_of::<bool>() == 1);

impl MemoryLayout {
    /// The layout for `needed`. The agent itself takes the first `agent_bytes`.
    pub const fn new(agent_bytes: usize, needed: &Capacities) -> Self {
        let streams = agent_bytes.next_multiple_of(align_of::<Pcg32>());
        let words = streams + needed.streams * size_of::<Pcg32>();
        let bids = words + needed.words * size_of::<f32>();
        let visited = bids + needed.programs * size_of::<f32>();
        MemoryLayout {
            streams,
            words,
            bids,
            visited,
            bytes: visited + needed.teams,
        }
    }
}
