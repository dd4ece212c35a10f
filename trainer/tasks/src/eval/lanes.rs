//! Episodes of one policy side by side, whose agents decide in lock-step.

use tpg_runtime::math::{LaneMask, Lanes as Words, Mask as _, Word as _};
use tpg_runtime::rng::Pcg32;
use tpg_runtime::{Capacities, LaneAgent, LaneSlices, Policy, Reset};

use super::{Arena, Conditions, Episode};
use crate::task::Rng;

/// Episodes that run side by side. Two of the vectors of any x86-64 or AArch64 hold one number of each.
pub const LANES: usize = 8;

/// Arenas for episodes side by side, with the memory of their agents.
pub struct Lanes {
    arenas: Vec<Arena>,
    memory: LaneMemory,
}

/// Memory for the agents of one policy after another, which grows as they need.
#[derive(Default)]
pub struct LaneMemory {
    words: Vec<Words<LANES>>,
    bids: Vec<Words<LANES>>,
    visited: Vec<LaneMask<LANES>>,
    streams: Vec<[Pcg32; LANES]>,
    outputs: Vec<f32>,
}

/// An episode under way: its place among all, its stream of masks, and what it has come to.
struct Running {
    place: usize,
    mask: Rng,
    episode: Episode,
}

impl Lanes {
    /// Lanes like this arena; `None` if its task has no [`twin`](crate::task::Task::twin).
    #[must_use]
    pub fn of(arena: &Arena) -> Option<Self> {
        let arenas = (0..LANES).map(|_| arena.twin()).collect::<Option<_>>()?;
        Some(Lanes {
            arenas,
            memory: LaneMemory::default(),
        })
    }

    /// Whether the policy's episodes can run side by side: [`LaneAgent`] accepts it, and each episode starts from a full reset,
    /// so that none depends on those before it.
    #[must_use]
    pub fn accept(policy: &Policy<'_>) -> bool {
        let header = policy.header();
        header.reset_scope.at_episode() == (true, true) && LaneAgent::<LANES>::accepts(header)
    }

    /// Runs the episodes that follow under these conditions.
    pub fn impose(&mut self, conditions: Conditions) {
        for arena in &mut self.arenas {
            arena.impose(conditions);
        }
    }

    /// Runs an episode of the policy for each seed, until `stopped` says so. Each has the same bits as by itself.
    ///
    /// Returns the episodes in the order of their seeds, `None` for those that were not finished. Returns `None` alone if lanes do
    /// not [accept](Self::accept) the policy, or if it sees another number of inputs than the arena shows.
    pub fn run(
        &mut self,
        policy: Policy<'_>,
        seeds: &[u64],
        stopped: impl Fn() -> bool,
    ) -> Option<Vec<Option<Episode>>> {
        let Lanes { arenas, memory } = self;
        let mut agents = LaneAgent::new_in(policy, memory.slices(&policy)).ok()?;
        let mut episodes = vec![None; seeds.len()];
        let mut coming = seeds.iter().enumerate();
        let mut running: [Option<Running>; LANES] = [const { None }; LANES];
        loop {
            for (lane, (running, arena)) in running.iter_mut().zip(arenas.iter_mut()).enumerate() {
                if running.is_none() {
                    *running = coming.next().map(|(place, seed)| {
                        let seeds = arena.begin(*seed);
                        agents.reset(lane, Reset::Episode, seeds.agent);
                        Running {
                            place,
                            mask: seeds.mask,
                            episode: Episode::BEGUN,
                        }
                    });
                }
                if let Some(running) = running {
                    agents.observe(lane, arena.see(&mut running.mask)).ok()?;
                }
            }
            if stopped() || running.iter().all(Option::is_none) {
                return Some(episodes);
            }
            agents.decide(LaneMask::of(|lane| running[lane].is_some()));
            for (lane, (slot, arena)) in running.iter_mut().zip(arenas.iter_mut()).enumerate() {
                let Some(running) = slot else { continue };
                let decision = agents.decision(lane);
                running.episode.instructions += u64::from(decision.instructions);
                let ended = arena.act(decision.action, &mut running.episode);
                if ended || running.episode.steps >= arena.max_steps() {
                    episodes[running.place] = Some(running.episode);
                    *slot = None;
                }
            }
        }
    }
}

impl LaneMemory {
    /// Room for a policy's agents.
    pub fn slices(&mut self, policy: &Policy<'_>) -> LaneSlices<'_, LANES> {
        let needed = Capacities::needed_by(policy.header());
        let streams = [(); LANES].map(|()| Pcg32::new(0, 0));
        grow(&mut self.words, needed.words, Words::ZERO);
        grow(&mut self.bids, needed.programs, Words::ZERO);
        grow(&mut self.visited, needed.teams, LaneMask::NONE);
        grow(&mut self.streams, needed.streams, streams);
        grow(&mut self.outputs, policy.header().outputs(), 0.0);
        LaneSlices {
            words: &mut self.words,
            bids: &mut self.bids,
            visited: &mut self.visited,
            streams: &mut self.streams,
            outputs: &mut self.outputs,
        }
    }
}

/// Makes a list at least so long.
fn grow<T: Clone>(list: &mut Vec<T>, len: usize, value: T) {
    if list.len() < len {
        list.resize(len, value);
    }
}
