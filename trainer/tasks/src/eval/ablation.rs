//! What of a policy its score owes to memory, and what to its graph.

use std::collections::BTreeMap;

use tpg_runtime::tables::{ProgramId, Target, TeamId};
use tpg_runtime::trace::Observer;
use tpg_runtime::{HostAgent, ObservationError, Reset, Restore};

use super::{Controller, Reply};

/// An agent that forgets before every decision: registers, shared memory or both are then at their evolved constants.
///
/// Everything else is the agent's own, its random streams and its front end included.
#[derive(Debug)]
pub struct Forgetful<'p> {
    agent: Box<HostAgent<'p>>,
    what: Restore,
}

impl<'p> Forgetful<'p> {
    /// Lets an agent forget.
    #[must_use]
    pub const fn new(agent: Box<HostAgent<'p>>, what: Restore) -> Self {
        Forgetful { agent, what }
    }
}

impl Controller for Forgetful<'_> {
    type Error = ObservationError;

    fn reset(&mut self, what: Reset, agent_seed: u64) -> Result<(), ObservationError> {
        Controller::reset(&mut *self.agent, what, agent_seed)
    }

    fn decide(&mut self, observation: &[f32]) -> Result<Reply<'_>, ObservationError> {
        self.agent.restore(self.what);
        Controller::decide(&mut *self.agent, observation)
    }
}

/// An agent that counts which of its programs act.
#[derive(Debug)]
pub struct CountingWinners<'p> {
    agent: Box<HostAgent<'p>>,
    winners: Winners,
}

/// How often which program acted, in which team and for which output.
#[derive(Debug, Default)]
struct Winners {
    team: u16,
    /// By output, then by team and program. Without programs for each output all counts are those of output 0.
    counts: BTreeMap<u16, BTreeMap<(u16, u16), u64>>,
    gave: bool,
}

impl Winners {
    fn count(&mut self, output: u16, ProgramId(program): ProgramId) {
        let of_output = self.counts.entry(output).or_default();
        *of_output.entry((self.team, program)).or_default() += 1;
    }
}

impl Observer for Winners {
    fn enter(&mut self, TeamId(team): TeamId) {
        self.team = team;
    }

    fn choose(&mut self, program_id: ProgramId, target: Target) {
        if matches!(target, Target::Atomic(_)) && !self.gave {
            self.count(0, program_id);
        }
    }

    fn give(&mut self, program_id: ProgramId, output: u16) {
        if !self.gave {
            // The programs give all outputs; the highest bidder of all is of no interest.
            self.gave = true;
            self.counts.clear();
        }
        self.count(output, program_id);
    }
}

/// The programs that act most often.
#[derive(Debug, Clone, PartialEq)]
pub struct MostUsed {
    /// The team that they belong to.
    pub team: TeamId,
    /// The program, or one for each output where outputs have programs of their own.
    pub programs: Vec<ProgramId>,
    /// Share of the decisions, or of the outputs given, that are theirs: 0 to 1.
    pub share: f64,
}

impl<'p> CountingWinners<'p> {
    /// Counts from 0.
    #[must_use]
    pub fn new(agent: Box<HostAgent<'p>>) -> Self {
        CountingWinners {
            agent,
            winners: Winners::default(),
        }
    }

    /// The most used programs so far, of equals the first; `None` before the first decision.
    #[must_use]
    pub fn most_used(&self) -> Option<MostUsed> {
        let (mut team, mut programs) = (0, Vec::new());
        let (mut theirs, mut all) = (0, 0);
        for counts in self.winners.counts.values() {
            let most = counts.iter().rev().max_by_key(|(_, count)| **count)?;
            let ((of_team, program), count) = most;
            team = *of_team;
            programs.push(ProgramId(*program));
            theirs += count;
            all += counts.values().sum::<u64>();
        }
        (all > 0).then(|| MostUsed {
            team: TeamId(team),
            programs,
            share: theirs as f64 / all as f64,
        })
    }
}

impl Controller for CountingWinners<'_> {
    type Error = ObservationError;

    fn reset(&mut self, what: Reset, agent_seed: u64) -> Result<(), ObservationError> {
        Controller::reset(&mut *self.agent, what, agent_seed)
    }

    fn decide(&mut self, observation: &[f32]) -> Result<Reply<'_>, ObservationError> {
        let decision = self.agent.decide_traced(observation, &mut self.winners)?;
        Ok(Reply {
            action: decision.action,
            instructions: decision.instructions,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_program_that_acts_most_often_is_found_in_its_team() {
        let mut winners = Winners::default();
        for (team, program, times) in [(0, 3, 2), (1, 4, 5), (1, 2, 5)] {
            for _ in 0..times {
                winners.enter(TeamId(0));
                winners.choose(ProgramId(9), Target::Team(TeamId(team)));
                winners.enter(TeamId(team));
                winners.choose(ProgramId(program), Target::Atomic(0));
            }
        }
        let counts = &winners.counts[&0];
        assert_eq!(counts[&(0, 3)], 2);
        assert_eq!(counts[&(1, 2)], 5);
        assert!(!counts.contains_key(&(0, 9)), "it never acts");
    }

    #[test]
    fn where_outputs_have_programs_each_is_counted_for_its_own() {
        let mut winners = Winners::default();
        winners.enter(TeamId(0));
        winners.choose(ProgramId(1), Target::Atomic(1));
        winners.give(ProgramId(0), 0);
        winners.give(ProgramId(1), 1);
        assert_eq!(winners.counts.len(), 2);
        assert_eq!(winners.counts[&0][&(0, 0)], 1);
        assert_eq!(winners.counts[&1][&(0, 1)], 1);
    }
}
