//! What a trace holds, and the agent that writes one while it is scored.

use std::io::{self, Write};

use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use tpg_runtime::isa::CellName;
use tpg_runtime::tables::{ProgramId, Section, Target, TeamId};
use tpg_runtime::trace::{MemoryAddress, Observer};
use tpg_runtime::{Action, HostAgent, ObservationError, Reset};

use crate::eval::{Controller, Reply};

/// The form of a trace; raised when its lines change their meaning.
pub(super) const VERSION: u32 = 1;

/// One line of a trace. The first is the header, the last the end.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Event {
    /// What was recorded.
    Header(Header),
    /// An episode begins.
    Reset {
        /// Number of the episode, from 0.
        episode: u32,
        /// Whether the agent begins too.
        agent: bool,
        /// Seed of the agent's random streams.
        seed: u64,
    },
    /// A decision.
    Decision(Decision),
    /// The trace is complete.
    End {
        /// Number of decisions in it.
        decisions: u64,
    },
}

/// What was recorded.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    /// Version of the form of the trace.
    pub version: u32,
    /// SHA-256 of the policy's file.
    pub policy: String,
    /// Full name of the task.
    pub task: String,
    /// What the policy saw.
    pub observability: String,
    /// Seed of the episodes.
    pub seed: u64,
    /// Number of episodes.
    pub episodes: u32,
}

impl Header {
    /// Describes a recording of a policy, given by its file's bytes.
    #[must_use]
    pub fn new(policy: &[u8], task: &str, observability: String, seed: u64, episodes: u32) -> Self {
        Header {
            version: VERSION,
            policy: digest(policy),
            task: task.to_owned(),
            observability,
            seed,
            episodes,
        }
    }
}

/// SHA-256 in hexadecimal.
pub(super) fn digest(bytes: &[u8]) -> String {
    let digest = Sha256::digest(bytes);
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// One decision. Floats are stored as the eight hexadecimal digits of their bits, so that nothing is rounded.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Decision {
    /// Number of the episode, from 0.
    pub episode: u32,
    /// Number of the step in the episode, from 0.
    pub step: u32,
    /// What the policy saw.
    pub observation: Vec<String>,
    /// The teams visited, in order.
    pub path: Vec<TeamVisit>,
    /// Instructions executed.
    pub instructions: u32,
    /// The action: its values, or the number of a discrete one.
    pub action: Vec<String>,
}

/// What happened in one team.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct TeamVisit {
    /// The team.
    pub team: u16,
    /// Its programs that took part, in order.
    pub programs: Vec<Bid>,
    /// Its programs that lead to visited teams.
    pub skipped: Vec<u16>,
    /// The program that won; where outputs have programs of their own, the highest bidder of all.
    pub winner: u16,
    /// Where it leads: `action N` or `team N`; where outputs have programs of their own, `output N`.
    pub target: String,
    /// For each output that has programs of its own, the one that gave it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub outputs: Vec<u16>,
}

/// What one program did in a team.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Bid {
    /// The program.
    pub program: u16,
    /// Its bid.
    pub bid: String,
    /// Instructions executed here; none if it had run for an earlier team.
    pub instructions: Option<u16>,
    /// Places of shared memory read, in order, named as in a disassembly.
    pub reads: Vec<String>,
    /// Places of shared memory written, in order.
    pub writes: Vec<String>,
}

/// Collects the path of one decision.
#[derive(Debug, Default)]
pub(super) struct Recorder {
    path: Vec<TeamVisit>,
    running: Bid,
}

impl Recorder {
    fn visit(&mut self) -> &mut TeamVisit {
        if self.path.is_empty() {
            self.path.push(TeamVisit::default());
        }
        let last = self.path.len() - 1;
        &mut self.path[last]
    }
}

impl Observer for Recorder {
    fn enter(&mut self, TeamId(team): TeamId) {
        self.path.push(TeamVisit {
            team,
            ..TeamVisit::default()
        });
    }

    fn skip(&mut self, ProgramId(program): ProgramId) {
        self.visit().skipped.push(program);
    }

    fn run(&mut self, _: ProgramId, instructions: u16) {
        self.running.instructions = Some(instructions);
    }

    fn read(&mut self, place: MemoryAddress) {
        self.running.reads.push(place_name(place));
    }

    fn write(&mut self, place: MemoryAddress) {
        self.running.writes.push(place_name(place));
    }

    fn bid(&mut self, ProgramId(program): ProgramId, bid: f32) {
        let ran = std::mem::take(&mut self.running);
        self.visit().programs.push(Bid {
            program,
            bid: bits(bid),
            ..ran
        });
    }

    fn choose(&mut self, ProgramId(program): ProgramId, target: Target) {
        let visit = self.visit();
        visit.winner = program;
        visit.target = match target {
            Target::Atomic(action) => format!("action {action}"),
            Target::Team(TeamId(team)) => format!("team {team}"),
        };
    }

    fn give(&mut self, ProgramId(program): ProgramId, output: u16) {
        let (visit, output) = (self.visit(), usize::from(output));
        if visit.outputs.is_empty() {
            visit.target = visit.target.replacen("action", "output", 1);
        }
        visit.outputs.resize(visit.outputs.len().max(output + 1), 0);
        visit.outputs[output] = program;
    }
}

/// `sm4`, `vm3`, `mm5` or `cell[49,2]`.
pub(crate) fn place_name(place: MemoryAddress) -> String {
    match place {
        MemoryAddress::Slot(Section::Scalar, slot) => format!("sm{slot}"),
        MemoryAddress::Slot(Section::Vector, slot) => format!("vm{slot}"),
        MemoryAddress::Slot(Section::Matrix, slot) => format!("mm{slot}"),
        MemoryAddress::Cell(cell) => CellName(cell).to_string(),
        _ => format!("{place:?}"),
    }
}

fn bits(x: f32) -> String {
    format!("{:08x}", x.to_bits())
}

/// Lets an agent decide and describes the decision.
pub(super) fn decide<'a>(
    agent: &'a mut HostAgent<'_>,
    observation: &[f32],
    episode: u32,
    step: u32,
) -> Result<(Decision, Action<'a>), ObservationError> {
    let mut recorder = Recorder::default();
    let decision = agent.decide_traced(observation, &mut recorder)?;
    let description = Decision {
        episode,
        step,
        observation: observation.iter().copied().map(bits).collect(),
        path: recorder.path,
        instructions: decision.instructions,
        action: match decision.action {
            Action::Discrete(action) => vec![action.to_string()],
            Action::Continuous(values) => values.iter().copied().map(bits).collect(),
        },
    };
    Ok((description, decision.action))
}

/// An agent that writes every decision to a trace.
pub struct TracingController<'p, W> {
    agent: Box<HostAgent<'p>>,
    out: W,
    episodes: u32,
    step: u32,
    decisions: u64,
}

impl<'p, W: Write> TracingController<'p, W> {
    /// Begins a trace.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn new(agent: Box<HostAgent<'p>>, header: Header, mut out: W) -> io::Result<Self> {
        write_event(&mut out, &Event::Header(header))?;
        Ok(TracingController {
            agent,
            out,
            episodes: 0,
            step: 0,
            decisions: 0,
        })
    }

    /// Writes the last line; a trace without it counts as truncated.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn finish(mut self) -> io::Result<()> {
        let decisions = self.decisions;
        write_event(&mut self.out, &Event::End { decisions })?;
        self.out.flush()
    }
}

fn write_event(out: &mut impl Write, event: &Event) -> io::Result<()> {
    serde_json::to_writer(&mut *out, event)?;
    out.write_all(b"\n")
}

/// Why a recording ended.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The agent refused an observation.
    #[error(transparent)]
    Observation(#[from] ObservationError),
    /// The trace cannot be written.
    #[error("failed to write the trace")]
    Write(#[from] io::Error),
}

impl<W: Write> Controller for TracingController<'_, W> {
    type Error = RecordError;

    fn reset(&mut self, what: Reset, agent_seed: u64) -> Result<(), RecordError> {
        self.agent.reset(what, agent_seed);
        let line = Event::Reset {
            episode: self.episodes,
            agent: what == Reset::Agent,
            seed: agent_seed,
        };
        (self.episodes, self.step) = (self.episodes + 1, 0);
        Ok(write_event(&mut self.out, &line)?)
    }

    fn decide(&mut self, observation: &[f32]) -> Result<Reply<'_>, RecordError> {
        let episode = self.episodes.saturating_sub(1);
        let (decision, action) = decide(&mut self.agent, observation, episode, self.step)?;
        let instructions = decision.instructions;
        self.step += 1;
        self.decisions += 1;
        write_event(&mut self.out, &Event::Decision(decision))?;
        Ok(Reply {
            action,
            instructions,
        })
    }
}

/// The float with these bits, if these are eight hexadecimal digits.
pub(super) fn float(text: &str) -> Option<f32> {
    let digits = text.len() == 8 && text.bytes().all(|b| b.is_ascii_hexdigit());
    let bits = u32::from_str_radix(text, 16).ok().filter(|_| digits)?;
    Some(f32::from_bits(bits))
}
