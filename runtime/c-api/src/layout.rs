//! Where the parts of an agent lie in its memory.

use core::mem::{align_of, size_of};

use tpg_runtime::Capacities;
use tpg_runtime::rng::Pcg32;

use crate::agent::AGENT_BYTES;

/// Offsets from the start of the memory, in the order of falling alignment, and the bytes of all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    pub streams: usize,
    pub words: usize,
    pub bids: usize,
    pub visited: usize,
    pub bytes: usize,
}

// The header's fields are small enough that no sum below can overflow 32 bits.
const _: () = assert!(align_of::<Pcg32>() >= align_of::<f32>() && size_of::<bool>() == 1);

impl Layout {
    pub const fn new(needed: &Capacities) -> Self {
        let streams = AGENT_BYTES.next_multiple_of(align_of::<Pcg32>());
        let words = streams + needed.streams * size_of::<Pcg32>();
        let bids = words + needed.words * size_of::<f32>();
        let visited = bids + needed.programs * size_of::<f32>();
        Layout {
            streams,
            words,
            bids,
            visited,
            bytes: visited + needed.teams,
        }
    }
}
