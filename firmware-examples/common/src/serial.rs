//! The board's side of a serial line. Requests arrive one byte at a time. Answers leave as whole frames.

use tpg_runtime::wire::{self, Answer, Frame, Identity, OVERHEAD, Receiver, Refusal, Request};
use tpg_runtime::{Action, Agent, Capacities, CapacityError, Policy, Reset, Width};

use crate::slots::{Flash, Refused, Slots};
use crate::trial::MAX_OBSERVATION;

/// Maximum number of outputs of a continuous action.
const MAX_ACTION: usize = 32;
/// Size of the longest frame, in bytes. It carries an observation or a part of a policy file.
const FRAME: usize = 512 + OVERHEAD;

/// How many numbers below the last one are those of late duplicates.
///
/// A line keeps the order of frames, so few are enough. Any other number is a new request, so that no number of a frame
/// can make the board deaf to the requests after it.
const LATE: u32 = 16;

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
        })
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
            (_, Some(last)) => last.wrapping_sub(seq) > LATE,
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
                if let (Some(slots), Answer::Index { .. } | Answer::Values { .. }) = (slots, answer)
                {
                    slots.decided();
                }
                answer
            }
            Request::Begin { bytes } => done(with(slots, |slots| slots.begin(bytes))),
            Request::Store { at, bytes } => done(with(slots, |slots| slots.store(at, bytes))),
            Request::Commit => done(with(slots, |slots| {
                slots.commit(|policy| {
                    excess(agent, policy).map_or(Ok(()), |needed| Err((Refusal::Capacity, needed)))
                })?;
                // The commit has just checked the policy, so neither step fails.
                let policy = slots.active().and_then(|file| Policy::load(file).ok());
                policy
                    .map_or(Ok(()), |policy| agent.load(policy))
                    .map_err(|_| (Refusal::Policy, 0))
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
