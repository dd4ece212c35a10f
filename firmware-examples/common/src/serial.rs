//! The board's side of a serial line. Requests arrive one byte at a time. Answers leave as whole frames.

use tpg_runtime::blob::{Blob, contract, contract_bytes};
use tpg_runtime::wire::{
    self, Answer, Frame, Identity, OVERHEAD, Receiver, Refusal, Request, SlotState, Stored,
};
use tpg_runtime::{Action, Agent, Capacities, CapacityError, Policy, Reset, Width};

use crate::slots::{Flash, Refused, Slots};
use crate::trial::MAX_OBSERVATION;

/// Maximum number of outputs of a continuous action.
const MAX_ACTION: usize = 32;
/// Size of the longest frame, in bytes. It carries an observation or a part of a policy file.
const FRAME: usize = 512 + OVERHEAD;
/// Number of good periods after which a new policy is confirmed, unless the application says otherwise.
pub const GOOD_PERIODS: u32 = 100;

/// The state of a connection to a host, and the policies that the board stores.
#[derive(Debug)]
pub struct Session<F> {
    receiver: Receiver<FRAME>,
    /// The last answer. It is kept because a host that did not receive it repeats its request.
    answer: [u8; FRAME],
    answer_len: usize,
    last: Option<u32>,
    built_in: &'static [u8],
    slots: Option<Slots<F>>,
    /// Decisions of the policy in use since it was put into use, or since a refused observation.
    good: u32,
    confirm_after: u32,
    /// Contract of the policy that is being stored, as the host announced it.
    announced: u64,
}

impl<F: Flash> Session<F> {
    /// Starts a session and loads a policy into the agent.
    ///
    /// The policy is the newest confirmed one in `flash`. If there is none, the agent keeps the policy it already has.
    /// `built_in` is the file of that policy.
    ///
    /// # Errors
    /// [`CapacityError`] if the policy does not fit the agent.
    pub fn start<
        W: Width,
        const WORDS: usize,
        const PROGRAMS: usize,
        const TEAMS: usize,
        const STREAMS: usize,
    >(
        built_in: &'static [u8],
        flash: Option<F>,
        agent: &mut Agent<'static, W, WORDS, PROGRAMS, TEAMS, STREAMS>,
    ) -> Result<Self, CapacityError> {
        let original = *agent.policy();
        let fits = |policy: &Policy<'static>| excess(agent, policy).is_none();
        let slots = flash.map(|flash| Slots::open(flash, fits));
        let file = slots.as_ref().and_then(Slots::active);
        let newest = file.and_then(|file| Policy::load(file).ok());
        agent.load(newest.unwrap_or(original))?;
        Ok(Session {
            receiver: Receiver::new(),
            answer: [0; FRAME],
            answer_len: 0,
            last: None,
            built_in,
            slots,
            good: 0,
            confirm_after: GOOD_PERIODS,
            announced: 0,
        })
    }

    /// Sets after how many good periods in a row a new policy is confirmed. A period is good if the policy decided.
    ///
    /// `u32::MAX` leaves it to the application, which knows its plant, to call [`confirm`](Self::confirm).
    pub const fn confirm_after(&mut self, periods: u32) {
        self.confirm_after = periods;
    }

    /// Confirms the policy in use. A policy that is not confirmed is reverted at the next start.
    ///
    /// # Errors
    /// Those of [`Slots::confirm`].
    pub fn confirm(&mut self) -> Result<(), Refused> {
        self.slots.as_mut().map_or(Ok(()), Slots::confirm)
    }

    /// Takes the next byte from the line and returns the bytes to send. They are empty unless a request is complete.
    pub fn take<
        W: Width,
        const WORDS: usize,
        const PROGRAMS: usize,
        const TEAMS: usize,
        const STREAMS: usize,
    >(
        &mut self,
        agent: &mut Agent<'static, W, WORDS, PROGRAMS, TEAMS, STREAMS>,
        byte: u8,
    ) -> &[u8] {
        let damaged = self.receiver.damaged();
        let Some(Frame { seq, message }) = self.receiver.push::<Request<'_>>(byte) else {
            return &[];
        };
        let due = match (message, self.last) {
            (Request::Hello, _) | (_, None) => true,
            (_, Some(last)) => seq > last,
        };
        // The host repeats its last request if the answer was lost, so send that answer again. An older request is a
        // duplicate and gets no answer.
        if !due {
            let again = self.last == Some(seq);
            return self
                .answer
                .get(..if again { self.answer_len } else { 0 })
                .unwrap_or_default();
        }
        let mut values = [0; 4 * MAX_ACTION];
        let slots = self.slots.as_mut();
        let built_in = self.built_in;
        let message = match message {
            Request::Hello => {
                let file = slots.as_ref().and_then(|slots| slots.active());
                let mut identity = Identity::new(agent.policy(), file.unwrap_or(self.built_in));
                identity.slot = slots.map_or(0, |slots| slots.number());
                identity.damaged = damaged;
                Answer::Identity(identity)
            }
            Request::Reset {
                agent: begins,
                seed,
            } => {
                let what = if begins { Reset::Agent } else { Reset::Episode };
                agent.reset(what, seed);
                Answer::Ready
            }
            Request::Observe { values: seen } => {
                let answer = decide(agent, seen, &mut values);
                self.good = match answer {
                    Answer::Index { .. } | Answer::Values { .. } => self.good.saturating_add(1),
                    _ => 0,
                };
                if let (Some(slots), true) = (slots, self.good >= self.confirm_after) {
                    // If the write fails, the next decision tries again.
                    let _ = slots.confirm();
                }
                answer
            }
            Request::Begin {
                bytes,
                contract,
                forced,
            } => done(with(slots, |slots| {
                let standing = slots.standing().unwrap_or(built_in);
                if !forced && contract != wire::contract_of(standing) {
                    return Err((Refusal::Robot, 0));
                }
                self.announced = contract;
                slots.begin(bytes, |file| change(agent, file.unwrap_or(built_in)))
            })),
            Request::Store { at, bytes } => done(with(slots, |slots| slots.store(at, bytes))),
            Request::Commit => done(with(slots, |slots| {
                slots.commit(|policy| {
                    if let Some(needed) = excess(agent, policy) {
                        return Err((Refusal::Capacity, needed));
                    }
                    let contract = contract(policy.header(), policy.tables().labels);
                    let len = policy.header().body_bytes;
                    (contract == self.announced)
                        .then_some(())
                        .ok_or((Refusal::Announced, len))
                })?;
                self.good = 0;
                change(agent, slots.active().unwrap_or(built_in));
                Ok(())
            })),
            Request::Slot { number: 0 } => {
                let in_use = slots.is_none_or(|slots| slots.number() == 0);
                let stored = Stored::new(0, SlotState::Confirmed, in_use, built_in);
                Answer::Slot(stored)
            }
            Request::Slot { number } => match slots {
                Some(slots) if number <= 2 => {
                    let (state, file) = slots.list(number);
                    let in_use = slots.number() == number;
                    Answer::Slot(Stored::new(number, state, in_use, file))
                }
                Some(_) => done(Err((Refusal::Slot, number.into()))),
                None => done(Err((Refusal::NoSlots, 0))),
            },
            Request::Contract { at } => {
                let standing = slots.as_ref().and_then(|slots| slots.standing());
                let (total, bytes) = excerpt(standing.unwrap_or(built_in), at, &mut values);
                Answer::Contract { total, bytes }
            }
            Request::Revert => done(with(slots, |slots| {
                slots.revert(|file| change(agent, file.unwrap_or(built_in)))
            })),
            Request::Erase { number } => done(with(slots, |slots| {
                slots.erase(number, |file| change(agent, file.unwrap_or(built_in)))
            })),
        };
        self.last = Some(seq);
        self.answer_len = wire::write(&Frame { seq, message }, &mut self.answer).unwrap_or(0);
        self.answer.get(..self.answer_len).unwrap_or_default()
    }
}

/// How much the policy needs of the first resource that the agent has too little of. `None` if the policy fits.
fn excess<
    W: Width,
    const WORDS: usize,
    const PROGRAMS: usize,
    const TEAMS: usize,
    const STREAMS: usize,
>(
    agent: &Agent<'static, W, WORDS, PROGRAMS, TEAMS, STREAMS>,
    policy: &Policy<'static>,
) -> Option<u32> {
    let needed = Capacities::needed_by(policy.header());
    let width = usize::from(agent.policy().header().width);
    let resources = [
        (needed.words, WORDS),
        (needed.programs, PROGRAMS),
        (needed.teams, TEAMS),
        (needed.streams, STREAMS),
        (policy.header().outputs(), MAX_ACTION),
        (
            usize::from(policy.header().observation_len),
            MAX_OBSERVATION,
        ),
    ];
    let excess = resources
        .into_iter()
        .find(|(needed, available)| needed > available);
    let width = (needed.width != width).then_some(needed.width);
    width.or(excess.map(|(needed, _)| needed)).map(|n| n as u32)
}

/// The length of a policy's contract, and its bytes from `at` on, as many as fit `buffer`.
fn excerpt<'b>(file: &[u8], at: u32, buffer: &'b mut [u8]) -> (u32, &'b [u8]) {
    let (mut total, mut len) = (0_u32, 0);
    if let Ok(blob) = Blob::decode(file) {
        contract_bytes(blob.header(), blob.tables().labels, |part| {
            for byte in part {
                let place = total.checked_sub(at).map(|place| place as usize);
                if let Some(place) = place.and_then(|place| buffer.get_mut(place)) {
                    *place = *byte;
                    len += 1;
                }
                total = total.saturating_add(1);
            }
        });
    }
    (total, buffer.get(..len).unwrap_or_default())
}

/// Changes over to a policy that was loaded before and fits, so neither step fails.
fn change<
    W: Width,
    const WORDS: usize,
    const PROGRAMS: usize,
    const TEAMS: usize,
    const STREAMS: usize,
>(
    agent: &mut Agent<'static, W, WORDS, PROGRAMS, TEAMS, STREAMS>,
    file: &'static [u8],
) {
    if let Ok(policy) = Policy::load(file) {
        let _ = agent.load(policy);
    }
}

fn with<F: Flash>(
    slots: Option<&mut Slots<F>>,
    step: impl FnOnce(&mut Slots<F>) -> Result<(), Refused>,
) -> Result<(), Refused> {
    slots.map_or(Err((Refusal::NoSlots, 0)), step)
}

fn done(result: Result<(), Refused>) -> Answer<'static> {
    match result {
        Ok(()) => Answer::Ready,
        Err((refusal, detail)) => Answer::Refused { refusal, detail },
    }
}

fn decide<
    'v,
    W: Width,
    const WORDS: usize,
    const PROGRAMS: usize,
    const TEAMS: usize,
    const STREAMS: usize,
>(
    agent: &mut Agent<'static, W, WORDS, PROGRAMS, TEAMS, STREAMS>,
    seen: &[u8],
    values: &'v mut [u8; 4 * MAX_ACTION],
) -> Answer<'v> {
    let (seen, rest) = seen.as_chunks::<4>();
    let mut buffer = [0.0; MAX_OBSERVATION];
    for (place, bytes) in buffer.iter_mut().zip(seen) {
        *place = f32::from_le_bytes(*bytes);
    }
    let refused = Answer::Refused {
        refusal: Refusal::Length,
        detail: seen.len() as u32,
    };
    let (true, Some(observation)) = (rest.is_empty(), buffer.get(..seen.len())) else {
        return refused;
    };
    let Ok(decision) = agent.decide(observation) else {
        return refused;
    };
    let instructions = decision.instructions;
    match decision.action {
        Action::Discrete(index) => Answer::Index {
            index,
            instructions,
        },
        Action::Continuous(action) => {
            for (place, value) in values.as_chunks_mut::<4>().0.iter_mut().zip(action) {
                *place = value.to_le_bytes();
            }
            let values = values.get(..4 * action.len()).unwrap_or_default();
            Answer::Values {
                values,
                instructions,
            }
        }
    }
}
