//! Agents of one policy that run in lock-step, for hosts that simulate many episodes of it at once.

use crate::blob::{ActionKind, Header};
use crate::decision::{Action, Decision, ObservationError, Reset};
use crate::exec::{Machine, Paths, Run, Vectors};
use crate::isa::Group;
use crate::math::{self, LaneMask, Lanes, Mask, Word};
use crate::memory::IndexedStream;
use crate::rng::Pcg32;
use crate::sizing::{Capacities, CapacityError};
use crate::state;
use crate::tables::{ProgramId, Target};
use crate::verify::Policy;

/// Widest vectors for which lanes are compiled; wider policies run one by one.
pub const MAX_LANE_WIDTH: u16 = 8;

/// Memory of its caller for `L` agents in lock-step. [`Capacities`] says how much of each a policy needs; more is not used.
#[derive(Debug)]
pub struct LaneSlices<'s, const L: usize> {
    /// Registers, shared memory, observation and outputs.
    pub words: &'s mut [Lanes<L>],
    /// One for each program.
    pub bids: &'s mut [Lanes<L>],
    /// One for each team.
    pub visited: &'s mut [LaneMask<L>],
    /// Random streams of team memory.
    pub streams: &'s mut [[Pcg32; L]],
    /// The values of one lane's action, one for each continuous output.
    pub outputs: &'s mut [f32],
}

/// `L` agents of one policy, each with a state of its own. They decide together, or some of them.
///
/// Each lane decides as an [`Agent`](crate::Agent) would, in every bit and with the same counts. Walking the graph and
/// decoding its instructions is paid once for all of them.
pub struct LaneAgent<'s, 'p, const L: usize> {
    policy: Policy<'p>,
    slices: LaneSlices<'s, L>,
    indexed: [IndexedStream; L],
    vectors: Vectors<Lanes<L>>,
    paths: Paths<Lanes<L>>,
}

impl<'s, 'p, const L: usize> LaneAgent<'s, 'p, L> {
    /// Whether the policy can run in lanes: it has no front end, no outputs with programs of their own, and no instructions
    /// on vectors wider than [`MAX_LANE_WIDTH`].
    #[must_use]
    pub fn accepts(header: &Header) -> bool {
        header.front_end.is_none()
            && header.action_kind != ActionKind::Each
            && Self::vectors(header).is_some()
    }

    /// Makes the agents, reset with seed 0.
    ///
    /// # Errors
    /// [`CapacityError`] if the policy needs more than there is room for. One that lanes do not [accept](Self::accepts)
    /// comes back as one of another width.
    pub fn new_in(policy: Policy<'p>, slices: LaneSlices<'s, L>) -> Result<Self, CapacityError> {
        let header = &policy.header;
        let needed = Capacities::needed_by(header);
        let vectors = Self::vectors(header).filter(|_| Self::accepts(header));
        needed.check(&Capacities {
            width: vectors.map_or(0, |_| needed.width),
            words: slices.words.len(),
            programs: slices.bids.len(),
            teams: slices.visited.len(),
            streams: slices.streams.len(),
        })?;
        let mut agents = LaneAgent {
            policy,
            slices,
            indexed: [IndexedStream::default(); L],
            // Without it the check above has failed: no policy's width is 0.
            vectors: vectors.unwrap_or(Vectors::of::<1>()),
            paths: Paths::start(),
        };
        agents.machine().start();
        Ok(agents)
    }

    /// The policy that the agents execute.
    #[must_use]
    pub const fn policy(&self) -> &Policy<'p> {
        &self.policy
    }

    /// As [`Agent::reset`](crate::Agent::reset), for one lane.
    pub fn reset(&mut self, lane: usize, what: Reset, agent_seed: u64) {
        let starting = LaneMask::of(|k| k == lane);
        self.machine().reset(what, agent_seed, starting);
    }

    /// Gives a lane its next observation. Elements that are not finite are missing and count as 0.
    ///
    /// # Errors
    /// [`ObservationError`] if it has another length than the policy's; nothing changes then.
    pub fn observe(&mut self, lane: usize, observation: &[f32]) -> Result<(), ObservationError> {
        let needed = usize::from(self.policy.header.observation_len);
        if observation.len() != needed {
            let got = observation.len();
            return Err(ObservationError { needed, got });
        }
        let window = usize::from(self.policy.header.window);
        let window = self.slices.words.get_mut(..window).unwrap_or_default();
        let observing = LaneMask::of(|k| k == lane);
        state::remember(&self.policy.header, window, observing);
        for (word, x) in window.iter_mut().zip(observation) {
            if let Some(place) = word.0.get_mut(lane) {
                *place = math::finite(*x);
            }
        }
        Ok(())
    }

    /// Decides in the lanes of the mask, each on its last observation.
    pub fn decide(&mut self, deciding: LaneMask<L>) {
        let vectors = self.vectors;
        let header = self.policy.header;
        let mut machine = self.machine();
        let window = machine.words.get_mut(..usize::from(header.window));
        state::repeat(&header, window.unwrap_or_default());
        let mut run = Run {
            machine: &mut machine,
            paths: Paths::start(),
            observer: (),
        };
        run.decide(vectors, deciding);
        self.paths = run.paths;
    }

    /// What a lane has decided last.
    pub fn decision(&mut self, lane: usize) -> Decision<'_> {
        let (winner, instructions, teams) = self.paths.of(lane);
        Decision {
            action: self.action(lane, winner),
            winner,
            instructions,
            teams,
        }
    }

    fn action(&mut self, lane: usize, winner: ProgramId) -> Action<'_> {
        let header = &self.policy.header;
        let program = self.policy.tables.program(winner).unwrap_or_default();
        if header.action_kind == ActionKind::Discrete {
            return Action::Discrete(match program.target {
                Target::Atomic(action) => action,
                Target::Team(_) => 0,
            });
        }
        let limits = self.policy.limits();
        let source = usize::from(program.output);
        let outputs = self
            .slices
            .outputs
            .get_mut(..header.outputs())
            .unwrap_or_default();
        for (k, out) in outputs.iter_mut().enumerate() {
            let word = self.slices.words.get(source + k);
            let range = limits.of(k);
            *out = math::clamp(
                word.map_or(0.0, |word| word.lane(lane)),
                range.low,
                range.high,
            );
        }
        Action::Continuous(outputs)
    }

    /// The state of a lane, for comparisons: observation window, outputs, registers, memory. Outputs stay 0.
    pub fn words(&self, lane: usize) -> impl Iterator<Item = f32> + '_ {
        let len = self.policy.header.words as usize;
        self.slices
            .words
            .iter()
            .take(len)
            .map(move |word| word.lane(lane))
    }

    fn machine(&mut self) -> Machine<'_, 'p, Lanes<L>, [Lanes<L>]> {
        let (header, slices) = (&self.policy.header, &mut self.slices);
        let [words, programs, teams, streams] = [
            header.words as usize,
            usize::from(header.programs),
            usize::from(header.teams),
            usize::from(header.streams),
        ];
        Machine {
            policy: &self.policy,
            words: slices.words.get_mut(..words).unwrap_or_default(),
            bids: slices.bids.get_mut(..programs).unwrap_or_default(),
            visited: slices.visited.get_mut(..teams).unwrap_or_default(),
            streams: slices
                .streams
                .get_mut(..streams)
                .unwrap_or_default()
                .as_flattened_mut(),
            indexed: &mut self.indexed,
        }
    }

    /// The instructions on vectors of the policy's width; those of any width will do if all of the policy's are scalar.
    fn vectors(header: &Header) -> Option<Vectors<Lanes<L>>> {
        let scalar = header.groups & !(Group::Scalar.bit() | Group::Classic.bit()) == 0;
        macro_rules! widths {
            ($($width:literal)*) => {
                match header.width {
                    $($width => Some(Vectors::of::<$width>()),)*
                    _ if scalar => Some(Vectors::of::<1>()),
                    _ => None,
                }
            };
        }
        widths!(1 2 3 4 5 6 7 8)
    }
}
