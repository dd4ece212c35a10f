//! The board's side of a serial line. Requests arrive one byte at a time. Answers leave as whole frames.

use tpg_runtime::blob::{Blob, contract_bytes};
use tpg_runtime::wire::{
    self, Answer, Answers, Frame, Identity, OVERHEAD, Receiver, Refusal, Request, Signed,
    SlotState, Stored,
};
use tpg_runtime::{
    Action, Agent, Capacities, CapacityError, Header, Policy, Reset, Storage, Width,
};

use crate::slots::{Flash, Refused, Slots};
use crate::trial::MAX_OBSERVATION;

/// Maximum number of outputs of a continuous action.
const MAX_ACTION: usize = 32;
/// Size of the longest frame, in bytes. It carries an observation or a part of a policy file.
const FRAME: usize = 512 + OVERHEAD;
/// Number of good periods after which a new policy is confirmed, unless the application says otherwise.
pub const GOOD_PERIODS: u32 = 100;

/// What the firmware demands of a new policy, and when it confirms one.
#[derive(Debug, Clone, Copy)]
pub struct Rules {
    /// After how many good periods in a row a new policy is confirmed. A period is good if the policy decided.
    ///
    /// `u32::MAX` leaves it to the application, which knows its plant, to call [`Session::confirm`].
    pub confirm_after: u32,
    /// Whether the board drives its own plant. Then hosts may neither reset the agent nor ask it for decisions, and the
    /// application reports each [period](Session::period).
    pub drives: bool,
    /// Whether a policy is refused if its release number is below the highest one of the built-in and confirmed policies.
    pub releases: bool,
    /// The public key of whoever may send policies. `None` takes unsigned policies too.
    #[cfg(feature = "signature")]
    pub key: Option<tpg_runtime::signature::PublicKey>,
}

impl Rules {
    /// Unsigned policies of any release, confirmed after [`GOOD_PERIODS`].
    pub const DEFAULT: Self = Rules {
        confirm_after: GOOD_PERIODS,
        drives: false,
        releases: false,
        #[cfg(feature = "signature")]
        key: None,
    };

    /// Whether the firmware verifies signatures.
    const fn verifies(&self) -> bool {
        #[cfg(feature = "signature")]
        return self.key.is_some();
        #[cfg(not(feature = "signature"))]
        false
    }

    /// Refuses a file that is not signed by the key, if there is one.
    fn check_signature(&self, file: &[u8]) -> Result<(), Refused> {
        #[cfg(feature = "signature")]
        if let Some(key) = &self.key {
            use tpg_runtime::signature::{SignatureError, verify};
            let verified = Blob::decode(file).map(|blob| verify(&blob, key));
            let detail = match verified {
                Ok(Ok(())) => return Ok(()),
                Ok(Err(SignatureError::Unsigned)) => 0,
                Ok(Err(SignatureError::OtherKey(_))) => 1,
                _ => 2,
            };
            return Err((Refusal::Signature, detail));
        }
        let _ = file;
        Ok(())
    }
}

/// The state of a connection to a host, and the policies that the board stores.
#[derive(Debug)]
pub struct Session<F> {
    receiver: Receiver<FRAME>,
    answers: Answers<FRAME>,
    built_in: &'static [u8],
    slots: Option<Slots<F>>,
    /// Decisions of the policy in use since it was put into use, or since a refused observation.
    good: u32,
    rules: Rules,
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
    pub fn start<W: Width, S: Storage>(
        built_in: &'static [u8],
        flash: Option<F>,
        agent: &mut Agent<'static, W, S>,
        rules: Rules,
    ) -> Result<Self, CapacityError> {
        let original = *agent.policy();
        let accepts = |file: &'static [u8], policy: &Policy<'static>| {
            accept(&rules, agent, file, policy).is_ok()
        };
        let slots = flash.map(|flash| Slots::open(flash, accepts));
        let file = slots.as_ref().and_then(Slots::active);
        let newest = file.and_then(|file| Policy::load(file).ok());
        agent.load(newest.unwrap_or(original))?;
        Ok(Session {
            receiver: Receiver::new(),
            answers: Answers::new(),
            built_in,
            slots,
            good: 0,
            rules,
            announced: 0,
        })
    }

    /// Confirms the policy in use. A policy that is not confirmed is reverted at the next start.
    ///
    /// # Errors
    /// Those of [`Slots::confirm`].
    pub fn confirm(&mut self) -> Result<(), Refused> {
        self.slots.as_mut().map_or(Ok(()), Slots::confirm)
    }

    /// Counts a period of the policy in use, and confirms the policy after enough good ones in a row.
    pub fn period(&mut self, good: bool) {
        self.good = if good { self.good.saturating_add(1) } else { 0 };
        if self.good >= self.rules.confirm_after {
            // If the write fails, the next period tries again.
            let _ = self.confirm();
        }
    }

    /// Whether a new policy is being stored.
    #[must_use]
    pub fn is_updating(&self) -> bool {
        self.slots.as_ref().is_some_and(Slots::is_updating)
    }

    /// Takes the next byte from the line and returns the bytes to send. They are empty unless a request is complete.
    pub fn take<W: Width, S: Storage>(
        &mut self,
        agent: &mut Agent<'static, W, S>,
        byte: u8,
    ) -> &[u8] {
        self.take_safely(agent, byte, || {})
    }

    /// As [`take`](Self::take). Calls `make_safe` before it changes the policy or the flash, which can stop the processor
    /// for seconds.
    pub fn take_safely<W: Width, S: Storage>(
        &mut self,
        agent: &mut Agent<'static, W, S>,
        byte: u8,
        make_safe: impl FnOnce(),
    ) -> &[u8] {
        let damaged = self.receiver.damaged();
        let Some(request) = self.receiver.push::<Request<'_>>(byte) else {
            return &[];
        };
        let Frame { seq, message } = request;
        if !self.answers.is_new(&request) {
            return self.answers.again(seq);
        }
        if let Request::Begin { .. }
        | Request::Store { .. }
        | Request::Commit
        | Request::Revert
        | Request::Erase { .. } = message
        {
            make_safe();
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
            Request::Reset { .. } | Request::Observe { .. } if self.rules.drives => {
                done(Err((Refusal::Drives, 0)))
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
                self.period(matches!(
                    answer,
                    Answer::Index { .. } | Answer::Values { .. }
                ));
                answer
            }
            Request::Begin {
                bytes,
                contract,
                release,
                forced,
            } => done(with(slots, |slots| {
                let standing = slots.standing().unwrap_or(built_in);
                if !forced && contract != wire::contract_of(standing) {
                    return Err((Refusal::Robot, 0));
                }
                check_release(&self.rules, slots.release(), built_in, release)?;
                self.announced = contract;
                slots.begin(bytes, |file| change(agent, file.unwrap_or(built_in)))
            })),
            Request::Store { at, bytes } => done(with(slots, |slots| slots.store(at, bytes))),
            Request::Commit => done(with(slots, |slots| {
                let (rules, announced) = (&self.rules, self.announced);
                let highest = slots.release();
                slots.commit(|file, policy| {
                    accept(rules, agent, file, policy)?;
                    if policy.contract() != announced {
                        return Err((Refusal::Announced, file.len() as u32));
                    }
                    check_release(rules, highest, built_in, policy.header().release)
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
                    let mut stored = Stored::new(number, state, in_use, file);
                    let works = matches!(state, SlotState::Unconfirmed | SlotState::Confirmed);
                    if works && self.rules.verifies() {
                        stored.signed = Signed::Verified;
                    }
                    Answer::Slot(stored)
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
        self.answers.keep(&Frame { seq, message })
    }
}

/// How much the policy needs of the first resource that the agent has too little of. `None` if the policy fits.
fn excess<W: Width, S: Storage>(
    agent: &Agent<'static, W, S>,
    policy: &Policy<'static>,
) -> Option<u32> {
    let needed = Capacities::needed_by(policy.header());
    let available = agent.capacities();
    let resources = [
        (needed.words, available.words),
        (needed.programs, available.programs),
        (needed.teams, available.teams),
        (needed.streams, available.streams),
        (policy.header().outputs(), MAX_ACTION),
        (
            usize::from(policy.header().observation_len),
            MAX_OBSERVATION,
        ),
    ];
    let excess = resources
        .into_iter()
        .find(|(needed, available)| needed > available);
    let width = (needed.width != available.width).then_some(needed.width);
    width.or(excess.map(|(needed, _)| needed)).map(|n| n as u32)
}

/// Whether the firmware takes a policy, whose file is `file`.
fn accept<W: Width, S: Storage>(
    rules: &Rules,
    agent: &Agent<'static, W, S>,
    file: &[u8],
    policy: &Policy<'static>,
) -> Result<(), Refused> {
    if let Some(needed) = excess(agent, policy) {
        return Err((Refusal::Capacity, needed));
    }
    rules.check_signature(file)
}

/// Refuses a release below the highest one of the confirmed policies and the built-in one, if the rules say so.
fn check_release(rules: &Rules, stored: u32, built_in: &[u8], new: u32) -> Result<(), Refused> {
    let built_in = Header::peek(built_in).map_or(0, |header| header.release);
    let highest = stored.max(built_in);
    if rules.releases && new < highest {
        return Err((Refusal::Release, highest));
    }
    Ok(())
}

/// The length of a policy's contract, and its bytes from `at` on, as many as fit `buffer`.
fn excerpt<'b>(file: &[u8], at: u32, buffer: &'b mut [u8]) -> (u32, &'b [u8]) {
    let (mut total, mut len) = (0_u32, 0);
    if let Ok(blob) = Blob::decode(file) {
        contract_bytes(blob.header(), blob.tables(), |part| {
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
fn change<W: Width, S: Storage>(agent: &mut Agent<'static, W, S>, file: &'static [u8]) {
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

fn decide<'v, W: Width, S: Storage>(
    agent: &mut Agent<'static, W, S>,
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
