//! What agents do with their state, wherever it is kept.

use core::borrow::BorrowMut;

use crate::blob::{ActionKind, Header, MemoryModel};
use crate::decision::{Action, Decision, ObservationError, Reset, Restore};
use crate::exec::{self, Machine, Paths, Run, Vectors, lanes};
#[cfg(feature = "front-end")]
use crate::front_end;
use crate::math::{self, Mask, Word};
use crate::memory::{IndexedStream, slot_stream};
use crate::outputs::OutputSet;
use crate::tables::{Program, ProgramId, Range, Section, Target, Team, TeamId};
use crate::trace::Observer;
use crate::verify::Policy;

impl<'s, 'p, V: Word, S: BorrowMut<[V]> + ?Sized> Machine<'s, 'p, V, S> {
    /// The machine with its words as a slice, so that what follows is compiled once for all capacities.
    pub(crate) fn sliced(self) -> Machine<'s, 'p, V, [V]> {
        Machine {
            policy: self.policy,
            words: self.words.borrow_mut(),
            bids: self.bids,
            visited: self.visited,
            streams: self.streams,
            indexed: self.indexed,
        }
    }
}

impl<'s, S: BorrowMut<[f32]> + ?Sized> Machine<'s, '_, f32, S> {
    /// Decides on an observation, with `vectors` of the policy's width.
    #[inline(always)]
    pub(crate) fn decide<O: Observer>(
        self,
        vectors: Vectors<f32>,
        observation: impl ExactSizeIterator<Item = f32> + Clone,
        mut observer: O,
    ) -> Result<Decision<'s>, ObservationError> {
        let words = self.words.borrow_mut();
        let standardising = observe(self.policy, words, observation, &mut observer)?;
        Ok(self.act(vectors, standardising, observer))
    }

    /// Decides on an observation that has the policy's length.
    #[inline(always)]
    pub(crate) fn decide_exact<O: Observer>(
        self,
        vectors: Vectors<f32>,
        observation: impl ExactSizeIterator<Item = f32> + Clone,
        mut observer: O,
    ) -> Decision<'s> {
        let words = self.words.borrow_mut();
        // With the right length there is no error.
        let standardising =
            observe(self.policy, words, observation, &mut observer).unwrap_or_default();
        self.act(vectors, standardising, observer)
    }

    /// Runs the programs on what was observed, for which the front end counted `standardising` instructions.
    #[inline]
    fn act<O: Observer>(
        mut self,
        vectors: Vectors<f32>,
        standardising: u32,
        observer: O,
    ) -> Decision<'s> {
        let policy = self.policy;
        let mut run = Run {
            machine: &mut self,
            paths: Paths::start(),
            observer,
        };
        run.decide(vectors, true);
        let (winner, instructions, teams) = run.paths.of(0);
        let mut observer = run.observer;
        let words = self.words.borrow_mut();
        Decision {
            action: take_action(policy, words, self.bids, winner, &mut observer),
            winner,
            instructions: standardising + instructions,
            teams,
        }
    }
}

impl<V: Word> Machine<'_, '_, V, [V]> {
    /// Makes the state of a policy that was just loaded: resets everything, with seed 0.
    pub(crate) fn start(self) {
        self.words.fill(V::ZERO);
        restore_memory(self.policy, self.words, V::Mask::ALL);
        reset_registers(self.policy, self.words, V::Mask::ALL);
        self.seed_streams(0, V::Mask::ALL);
    }

    /// Begins an agent's evaluation or one of its episodes (thesis Algorithm 1), in the lanes of the mask.
    pub(crate) fn reset(self, what: Reset, agent_seed: u64, starting: V::Mask) {
        let scope = self.policy.header.reset_scope;
        let (registers, memory) = match what {
            Reset::Agent => scope.at_agent(),
            Reset::Episode => scope.at_episode(),
        };
        clear_observed(self.policy, self.words, starting);
        if memory {
            restore_memory(self.policy, self.words, starting);
        }
        if registers {
            reset_registers(self.policy, self.words, starting);
            self.seed_streams(agent_seed, starting);
        }
    }

    /// Sets registers or shared memory to their initial values. Random streams and the front end go on.
    pub(crate) fn restore(self, what: Restore) {
        if what != Restore::Registers {
            restore_memory(self.policy, self.words, V::Mask::ALL);
        }
        if what != Restore::Memory {
            reset_registers(self.policy, self.words, V::Mask::ALL);
        }
    }

    /// Seeds the streams of team memory and of indexed memory.
    fn seed_streams(self, agent_seed: u64, starting: V::Mask) {
        for lane in lanes::<V>(starting) {
            for bytes in self.policy.tables.teams {
                let team = Team::from_bytes(bytes);
                for section in Section::ALL {
                    let number = team.stream(section).map(|s| s * V::LANES + lane);
                    if let Some(stream) = number.and_then(|s| self.streams.get_mut(s)) {
                        *stream = slot_stream(agent_seed, team.stream_key, section);
                    }
                }
            }
            if let Some(stream) = self.indexed.get_mut(lane) {
                *stream = IndexedStream::new(agent_seed);
            }
        }
    }
}

/// Fills the window with the last observations, repeated cyclically, or with what the front end makes of them.
///
/// Without a front end, missing elements count as 0. Returns the instructions that the front end counts as.
#[inline(always)]
fn observe<O: Observer>(
    policy: &Policy<'_>,
    words: &mut [f32],
    observation: impl ExactSizeIterator<Item = f32> + Clone,
    observer: &mut O,
) -> Result<u32, ObservationError> {
    let header = &policy.header;
    let needed = usize::from(header.observation_len);
    if observation.len() != needed {
        return Err(ObservationError {
            needed,
            got: observation.len(),
        });
    }
    let Some((window, behind)) = words.split_at_mut_checked(usize::from(header.window)) else {
        return Ok(0);
    };
    remember(header, window, true);
    let first = window.get_mut(..needed).unwrap_or_default();
    #[cfg(feature = "front-end")]
    let standardised = policy.front_end().map(|front_end| {
        let foreseen = front_end::foresee(&front_end, header, first, behind, observer);
        let count = front_end::apply(&front_end, header, first, behind, observation.clone());
        if foreseen {
            front_end::compare(&front_end, header, first, observation.clone(), observer);
        }
        count
    });
    #[cfg(not(feature = "front-end"))]
    let (standardised, ..) = (None, behind, observer);
    if standardised.is_none() {
        for (word, x) in first.iter_mut().zip(observation) {
            *word = math::finite(x);
        }
    }
    repeat(header, window);
    Ok(standardised.unwrap_or(0))
}

/// Fills the window with its observations, repeated cyclically.
#[inline(always)]
pub(crate) fn repeat<V: Copy>(header: &Header, window: &mut [V]) {
    let observed = match cfg!(feature = "history") {
        true => header.observed(),
        false => usize::from(header.observation_len),
    };
    // Each turn doubles what is filled, so that a short observation in a long window takes few turns.
    let mut filled = observed.max(1);
    while let Some((done, rest)) = window.split_at_mut_checked(filled)
        && !rest.is_empty()
    {
        for (word, x) in rest.iter_mut().zip(done) {
            *word = *x;
        }
        filled *= 2;
    }
}

/// Moves each of the last observations to the place of the one before it, so that the newest can be written, in the lanes of
/// the mask.
#[inline(always)]
pub(crate) fn remember<V: Word>(header: &Header, window: &mut [V], observing: V::Mask) {
    if cfg!(feature = "history") && header.history > 1 {
        shift(
            window,
            usize::from(header.observation_len),
            header.observed(),
            observing,
        );
    }
}

/// Moves `observed` words up by `elements`; the last ones fall out.
fn shift<V: Word>(window: &mut [V], elements: usize, observed: usize, observing: V::Mask) {
    let mut end = observed;
    // From the oldest observation on, so that none is overwritten before it was moved.
    while let Some(start) = end.checked_sub(elements)
        && start > 0
        && let Some((newer, older)) = window.split_at_mut_checked(start)
        && let Some(newer) = start.checked_sub(elements).and_then(|at| newer.get(at..))
    {
        for (word, x) in older.iter_mut().zip(newer) {
            *word = x.over(*word, observing);
        }
        end = start;
    }
}

/// Clears the window and the model's words at the start of an episode, if a front end or a history lets them outlive a decision.
#[inline]
fn clear_observed<V: Word>(policy: &Policy<'_>, words: &mut [V], starting: V::Mask) {
    let header = &policy.header;
    let outlives = (cfg!(feature = "front-end") && header.front_end.is_some())
        || (cfg!(feature = "history") && header.history > 1);
    if outlives {
        let place = words.get_mut(..header.registers_start());
        for word in place.unwrap_or_default() {
            *word = V::ZERO.over(*word, starting);
        }
    }
}

/// The action that the bids chose. Continuous values are clamped and stored in the state's output words.
fn take_action<'s, O: Observer>(
    policy: &Policy<'_>,
    words: &'s mut [f32],
    bids: &[f32],
    winner: ProgramId,
    observer: &mut O,
) -> Action<'s> {
    let header = &policy.header;
    let (start, len) = (usize::from(header.window), header.outputs());
    match (header.action_kind, policy.tables.program(winner)) {
        (ActionKind::Discrete, program) => {
            let action = match program.map(|p| p.target) {
                Some(Target::Atomic(action)) => action,
                _ => 0,
            };
            record_action(policy, words, action);
            return Action::Discrete(action);
        }
        (ActionKind::Continuous, program) => {
            let source = program.map_or(start, |p| usize::from(p.output));
            let limits = policy.limits();
            for k in 0..len {
                take_output(words, start + k, source + k, limits.of(k));
            }
        }
        (ActionKind::Each, _) => {
            if ActionKind::Each.is_built() {
                take_each(policy, words, bids, observer);
            }
        }
    }
    record_action(policy, words, 0);
    let outputs = words.get(start..).and_then(|rest| rest.get(..len));
    Action::Continuous(outputs.unwrap_or_default())
}

/// Clamps the word at `source` into the word at `output`.
#[inline(always)]
fn take_output(words: &mut [f32], output: usize, source: usize, range: Range) {
    let x = words.get(source).copied().unwrap_or(0.0);
    if let Some(out) = words.get_mut(output) {
        *out = math::clamp(x, range.low, range.high);
    }
}

/// Gives each output the value of the highest bidder among its programs, of equals the earlier one.
///
/// This takes two passes over the members, whatever the number of outputs.
fn take_each<O: Observer>(policy: &Policy<'_>, words: &mut [f32], bids: &[f32], observer: &mut O) {
    let header = &policy.header;
    let (start, len) = (usize::from(header.window), header.outputs());
    let team = policy.tables.team(TeamId(0)).unwrap_or_default();
    // The output words hold the highest bids until the outputs replace them, so this needs no other memory.
    let highest = words.get_mut(start..).and_then(|rest| rest.get_mut(..len));
    highest.unwrap_or_default().fill(f32::MIN);
    let (limits, mut given) = (policy.limits(), OutputSet::default());
    for taking in [false, true] {
        for member in policy.tables.members(&team) {
            let (Some(program), Some(bid)) = (
                policy.tables.program(member),
                bids.get(usize::from(member.0)),
            ) else {
                continue;
            };
            let Target::Atomic(output) = program.target else {
                continue;
            };
            let k = usize::from(output);
            let Some(highest) = words.get_mut(start + k) else {
                continue;
            };
            if !taking {
                if *bid > *highest {
                    *highest = *bid;
                }
            } else if *bid >= *highest && given.insert(output) {
                take_output(words, start + k, usize::from(program.output), limits.of(k));
                observer.give(member, output);
            }
        }
    }
}

/// Stores the action for the front end's next prediction, if there is a front end.
#[inline]
fn record_action(policy: &Policy<'_>, words: &mut [f32], action: u16) {
    #[cfg(feature = "front-end")]
    if let Some(front_end) = policy.front_end() {
        let behind = words.get_mut(usize::from(policy.header.window)..);
        front_end::record_action(
            &front_end,
            &policy.header,
            behind.unwrap_or_default(),
            action,
        );
    }
    #[cfg(not(feature = "front-end"))]
    let _ = (policy, words, action);
}

fn reset_registers<V: Word>(policy: &Policy<'_>, words: &mut [V], starting: V::Mask) {
    for bytes in policy.tables.programs {
        exec::reset_registers(policy, words, &Program::from_bytes(bytes), starting);
    }
}

/// Sets shared memory to the image that the blob carries, else to its initial values.
fn restore_memory<V: Word>(policy: &Policy<'_>, words: &mut [V], starting: V::Mask) {
    let carried = policy.tables.memory;
    if !carried.is_empty() {
        let place = words.get_mut(policy.memory_start..);
        for (word, bytes) in place.unwrap_or_default().iter_mut().zip(carried) {
            *word = V::splat(f32::from_le_bytes(*bytes)).over(*word, starting);
        }
        return;
    }
    if policy.header.memory_model == MemoryModel::Indexed {
        // The thesis clears indexed memory to zero (§2.5.1); only team memory has constants.
        let cells = words.get_mut(policy.cells_start()..);
        for word in cells.unwrap_or_default() {
            *word = V::ZERO.over(*word, starting);
        }
    }
    let width = usize::from(policy.header.width);
    for bytes in policy.tables.teams {
        let team = Team::from_bytes(bytes);
        let len = team.memory_words(width);
        let (start, constants) = (team.memory_start, team.constants_start);
        exec::fill_initial(policy, words, start, constants, len, starting);
    }
}
