//! What resets do, independent of the language.

use super::plan::Plan;

/// A part of the state that a reset sets to its initial value.
#[derive(Debug, Clone, Copy)]
pub(super) enum Part {
    /// Registers of a program.
    Registers(u16),
    /// Slots of a team's memory.
    Slots(u16),
    /// Random streams of a team's memory.
    Streams(u16),
    /// Kept cells of indexed memory.
    Cells,
    /// The random stream of indexed memory.
    CellStream,
}

/// The resets that affect a part of the state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum When {
    Always,
    Agent,
    Episode,
    Never,
}

impl When {
    const fn new(agent: bool, episode: bool) -> Self {
        match (agent, episode) {
            (true, true) => When::Always,
            (true, false) => When::Agent,
            (false, true) => When::Episode,
            (false, false) => When::Never,
        }
    }
}

/// Parts of the state that are reset together.
#[derive(Debug)]
pub(super) struct Reset {
    pub(super) when: When,
    pub(super) parts: Vec<Part>,
}

impl Plan<'_> {
    /// The reset of memory, then the reset of registers and random streams. They run in this order.
    pub(super) fn resets(&self) -> [Reset; 2] {
        let scope = self.policy.header().reset_scope;
        let (agent, episode) = (scope.at_agent(), scope.at_episode());
        let teams = || self.remembering().map(|(team, _)| team);
        let programs = self.stateful_programs().into_iter();
        let indexed = |part| self.is_indexed().then_some(part);
        [
            Reset {
                when: When::new(agent.1, episode.1),
                parts: teams()
                    .map(Part::Slots)
                    .chain(indexed(Part::Cells))
                    .collect(),
            },
            Reset {
                when: When::new(agent.0, episode.0),
                parts: programs
                    .map(Part::Registers)
                    .chain(teams().map(Part::Streams))
                    .chain(indexed(Part::CellStream))
                    .collect(),
            },
        ]
    }
}
