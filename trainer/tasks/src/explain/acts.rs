//! Which programs of a policy act when, and which memory they touch.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;
use tpg_runtime::tables::{ProgramId, Target, TeamId};
use tpg_runtime::trace::{MemoryAddress, Observer};
use tpg_runtime::{HostAgent, ObservationError, Reset};

use crate::eval::{Controller, Reply};
use crate::trace::place_name;

/// Inputs that are named for each program.
const NAMED: usize = 3;
/// Least distance from an input's mean, in standard deviations, at which it is named.
const FAR: f64 = 0.1;

/// An agent of which is noted what its programs do, and what they see then.
#[derive(Debug)]
pub struct Explained<'p> {
    agent: Box<HostAgent<'p>>,
    notes: Notes,
    decisions: u64,
    inputs: Vec<Moments>,
    programs: BTreeMap<Role, Acts>,
    last: Vec<Role>,
}

/// What a program acts as: in which team, and for which output if outputs have programs of their own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Role {
    team: u16,
    program: u16,
    output: Option<u16>,
}

/// Sums of what an input was, where it was not missing.
#[derive(Debug, Default, Clone, Copy)]
struct Moments {
    count: u64,
    sum: f64,
    squares: f64,
}

impl Moments {
    fn add(&mut self, value: f32) {
        if value.is_finite() {
            self.count += 1;
            self.sum += f64::from(value);
            self.squares += f64::from(value) * f64::from(value);
        }
    }

    fn mean(&self) -> f64 {
        self.sum / self.count.max(1) as f64
    }

    fn deviation(&self) -> f64 {
        let variance = self.squares / self.count.max(1) as f64 - self.mean() * self.mean();
        variance.max(0.0).sqrt()
    }
}

/// When a program acted.
#[derive(Debug, Default)]
struct Acts {
    decisions: u64,
    /// Times that it took over from another program.
    spells: u64,
    inputs: Vec<Moments>,
}

/// Who read and wrote a place of memory, and how often.
#[derive(Debug, Default)]
struct Access {
    reads: u64,
    writes: u64,
    readers: BTreeSet<u16>,
    writers: BTreeSet<u16>,
}

/// What the runtime tells of decisions.
#[derive(Debug, Default)]
struct Notes {
    team: u16,
    program: u16,
    acted: Vec<Role>,
    memory: BTreeMap<(u16, String), Access>,
}

impl Notes {
    fn access(&mut self, place: MemoryAddress) -> &mut Access {
        // Cells of indexed memory belong to no team.
        let team = match place {
            MemoryAddress::Slot(..) => self.team,
            _ => 0,
        };
        let place = place_name(place);
        self.memory.entry((team, place)).or_default()
    }
}

impl Observer for Notes {
    fn enter(&mut self, TeamId(team): TeamId) {
        self.team = team;
    }

    fn run(&mut self, ProgramId(program): ProgramId, _: u16) {
        self.program = program;
    }

    fn read(&mut self, place: MemoryAddress) {
        let program = self.program;
        let access = self.access(place);
        access.reads += 1;
        access.readers.insert(program);
    }

    fn write(&mut self, place: MemoryAddress) {
        let program = self.program;
        let access = self.access(place);
        access.writes += 1;
        access.writers.insert(program);
    }

    fn choose(&mut self, ProgramId(program): ProgramId, target: Target) {
        if matches!(target, Target::Atomic(_)) {
            let (team, output) = (self.team, None);
            self.acted = vec![Role {
                team,
                program,
                output,
            }];
        }
    }

    fn give(&mut self, ProgramId(program): ProgramId, output: u16) {
        // The highest bidder of all is of no interest where the programs give the outputs.
        self.acted.retain(|role| role.output.is_some());
        self.acted.push(Role {
            team: self.team,
            program,
            output: Some(output),
        });
    }
}

/// What a policy did in the episodes that were watched.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Explanation {
    /// Decisions.
    pub decisions: u64,
    /// Inputs, in the order of the observation.
    pub inputs: Vec<InputSeen>,
    /// Programs that acted, those that did so most often first.
    pub programs: Vec<ProgramActs>,
    /// Places of shared memory that were read or written.
    pub memory: Vec<MemoryUse>,
}

/// What an input was, where it was not missing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InputSeen {
    /// Its name.
    pub name: String,
    /// Its mean, in its unit.
    pub mean: f64,
    /// Its standard deviation, in its unit.
    pub sd: f64,
}

/// When a program acted.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ProgramActs {
    /// The team in which it won.
    pub team: u16,
    /// Its number.
    pub program: u16,
    /// The output that it gave, where outputs have programs of their own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub output: Option<u16>,
    /// Share of the decisions, 0 to 1.
    pub share: f64,
    /// Mean number of decisions in a row.
    pub spell: f64,
    /// The inputs that were farthest from their means while it acted; three at most.
    pub when: Vec<When>,
}

/// How an input was while a program acted.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct When {
    /// Its name.
    pub input: String,
    /// Its mean then less its mean in all decisions, in standard deviations.
    pub shift: f64,
}

/// How a place of memory was used.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MemoryUse {
    /// The team whose memory it is in; 0 for indexed memory, which is the policy's.
    pub team: u16,
    /// Its name, as in a disassembly.
    pub place: String,
    /// Reads for each decision.
    pub reads: f64,
    /// Writes for each decision.
    pub writes: f64,
    /// Programs that read it.
    pub readers: Vec<u16>,
    /// Programs that wrote it.
    pub writers: Vec<u16>,
}

impl<'p> Explained<'p> {
    /// Nothing has been seen yet.
    #[must_use]
    pub fn new(agent: Box<HostAgent<'p>>) -> Self {
        let inputs = vec![Moments::default(); usize::from(agent.policy().header().observation_len)];
        Explained {
            agent,
            notes: Notes::default(),
            decisions: 0,
            inputs,
            programs: BTreeMap::new(),
            last: Vec::new(),
        }
    }

    /// What was seen so far.
    #[must_use]
    pub fn finish(&self) -> Explanation {
        let names: Vec<&str> = self.agent.policy().inputs().map(|(name, _)| name).collect();
        let all = self.decisions.max(1) as f64;
        let seen = self.inputs.iter().zip(&names);
        let when = |acts: &Acts| {
            let inputs = acts.inputs.iter().zip(&self.inputs).zip(&names);
            let mut when: Vec<When> = inputs
                .filter(|((then, all), _)| then.count > 0 && all.deviation() > 0.0)
                .map(|((then, all), name)| When {
                    input: (*name).to_owned(),
                    shift: (then.mean() - all.mean()) / all.deviation(),
                })
                .filter(|when| when.shift.abs() >= FAR)
                .collect();
            when.sort_by(|a, b| b.shift.abs().total_cmp(&a.shift.abs()));
            when.truncate(NAMED);
            when
        };
        let mut programs: Vec<ProgramActs> = (self.programs.iter())
            .map(|(role, acts)| ProgramActs {
                team: role.team,
                program: role.program,
                output: role.output,
                share: acts.decisions as f64 / all,
                spell: acts.decisions as f64 / acts.spells.max(1) as f64,
                when: when(acts),
            })
            .collect();
        programs.sort_by(|a, b| {
            (a.output, -a.share)
                .partial_cmp(&(b.output, -b.share))
                .unwrap_or(std::cmp::Ordering::Equal)
        });
        let memory = self.notes.memory.iter();
        Explanation {
            decisions: self.decisions,
            inputs: seen
                .map(|(moments, name)| InputSeen {
                    name: (*name).to_owned(),
                    mean: moments.mean(),
                    sd: moments.deviation(),
                })
                .collect(),
            programs,
            memory: memory
                .map(|((team, place), access)| MemoryUse {
                    team: *team,
                    place: place.clone(),
                    reads: access.reads as f64 / all,
                    writes: access.writes as f64 / all,
                    readers: access.readers.iter().copied().collect(),
                    writers: access.writers.iter().copied().collect(),
                })
                .collect(),
        }
    }
}

impl Controller for Explained<'_> {
    type Error = ObservationError;

    fn reset(&mut self, what: Reset, agent_seed: u64) -> Result<(), ObservationError> {
        self.last.clear();
        Controller::reset(&mut *self.agent, what, agent_seed)
    }

    fn decide(&mut self, observation: &[f32]) -> Result<Reply<'_>, ObservationError> {
        self.notes.acted.clear();
        let decision = self.agent.decide_traced(observation, &mut self.notes)?;
        self.decisions += 1;
        for (moments, value) in self.inputs.iter_mut().zip(observation) {
            moments.add(*value);
        }
        for role in &self.notes.acted {
            let acts = self.programs.entry(*role).or_default();
            acts.decisions += 1;
            acts.spells += u64::from(!self.last.contains(role));
            acts.inputs.resize(observation.len(), Moments::default());
            for (moments, value) in acts.inputs.iter_mut().zip(observation) {
                moments.add(*value);
            }
        }
        std::mem::swap(&mut self.last, &mut self.notes.acted);
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
    fn moments_leave_out_what_is_missing() {
        let mut moments = Moments::default();
        for value in [1.0, f32::NAN, 3.0] {
            moments.add(value);
        }
        assert_eq!(moments.count, 2);
        assert!((moments.mean() - 2.0).abs() < 1e-12 && (moments.deviation() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_programs_memory_is_that_of_the_team_that_runs_it() {
        let mut notes = Notes::default();
        let slot = MemoryAddress::Slot(tpg_runtime::tables::Section::Scalar, 4);
        for (team, program) in [(0, 1), (1, 1)] {
            notes.enter(TeamId(team));
            notes.run(ProgramId(program), 1);
            notes.read(slot);
        }
        notes.write(slot);
        let of_team = |team| &notes.memory[&(team, "sm4".to_owned())];
        assert_eq!((of_team(0).reads, of_team(0).writes), (1, 0));
        assert_eq!((of_team(1).reads, of_team(1).writes), (1, 1));
    }
}
