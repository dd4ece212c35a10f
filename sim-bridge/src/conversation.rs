//! The controller's side of the open protocol (docs/wire.md): what a board does, for a policy that no plant replaces.

use tpg_runtime::blob::contract_bytes;
use tpg_runtime::wire::{
    Answer, Answers, Frame, Identity, OVERHEAD, Receiver, Refusal, Request, SlotState, Stored,
};
use tpg_runtime::{Action, HostAgent, Policy, Reset};

use crate::error::BridgeError;
use crate::handshake::check_sizes;
use crate::message::{MAX_ACTION, MAX_OBSERVATION};

/// Bytes of the longest frame.
pub(crate) const FRAME: usize = 4 * MAX_OBSERVATION + OVERHEAD;
/// Most bytes of a contract in an answer.
const PART: usize = 128;

/// An agent that answers frames.
pub(crate) struct Conversation<'p> {
    agent: Box<HostAgent<'p>>,
    file: &'p [u8],
    contract: Vec<u8>,
    receiver: Receiver<FRAME>,
    answers: Answers<FRAME>,
}

impl<'p> Conversation<'p> {
    /// Prepares a policy, read from the bytes `file`.
    ///
    /// # Errors
    /// [`BridgeError::Capacity`] or [`BridgeError::TooLarge`] if it does not fit.
    pub(crate) fn new(policy: Policy<'p>, file: &'p [u8]) -> Result<Self, BridgeError> {
        check_sizes(policy.header())?;
        let mut contract = Vec::new();
        contract_bytes(policy.header(), policy.tables(), |part| {
            contract.extend_from_slice(part);
        });
        Ok(Conversation {
            agent: Box::new(HostAgent::new(policy)?),
            file,
            contract,
            receiver: Receiver::new(),
            answers: Answers::new(),
        })
    }

    /// Takes the next byte and returns the bytes to send, none unless it completes a request.
    pub(crate) fn take(&mut self, byte: u8) -> &[u8] {
        let damaged = self.receiver.damaged();
        let Some(request) = self.receiver.push::<Request<'_>>(byte) else {
            return &[];
        };
        let Frame { seq, message } = request;
        if !self.answers.is_new(&request) {
            return self.answers.again(seq);
        }
        let mut values = [0; 4 * MAX_ACTION];
        let message = match message {
            Request::Hello => {
                let mut identity = Identity::new(self.agent.policy(), self.file);
                identity.damaged = damaged;
                Answer::Identity(identity)
            }
            Request::Reset { agent, seed } => {
                let what = if agent { Reset::Agent } else { Reset::Episode };
                self.agent.reset(what, seed);
                Answer::Ready
            }
            Request::Observe { values: seen } => decide(&mut self.agent, seen, &mut values),
            Request::Slot { number: 0 } => {
                Answer::Slot(Stored::new(0, SlotState::Confirmed, true, self.file))
            }
            Request::Contract { at } => {
                let at = usize::try_from(at)
                    .unwrap_or(usize::MAX)
                    .min(self.contract.len());
                let part = &self.contract[at..];
                Answer::Contract {
                    total: u32::try_from(self.contract.len()).unwrap_or(u32::MAX),
                    bytes: &part[..part.len().min(PART)],
                }
            }
            Request::Begin { .. }
            | Request::Store { .. }
            | Request::Commit
            | Request::Revert
            | Request::Erase { .. }
            | Request::Slot { .. } => Answer::Refused {
                refusal: Refusal::NoSlots,
                detail: 0,
            },
        };
        self.answers.keep(&Frame { seq, message })
    }
}

/// Whether a greeting is among these bytes.
pub(crate) fn greets(bytes: &[u8]) -> bool {
    let mut receiver = Receiver::<FRAME>::new();
    bytes.iter().any(|byte| {
        let frame = receiver.push::<Request<'_>>(*byte);
        frame.is_some_and(|frame| frame.message == Request::Hello)
    })
}

fn decide<'v>(
    agent: &mut HostAgent<'_>,
    seen: &[u8],
    values: &'v mut [u8; 4 * MAX_ACTION],
) -> Answer<'v> {
    let (elements, rest) = seen.as_chunks::<4>();
    let mut observation = [0.0; MAX_OBSERVATION];
    for (place, bytes) in observation.iter_mut().zip(elements) {
        *place = f32::from_le_bytes(*bytes);
    }
    let whole = rest.is_empty().then(|| observation.get(..elements.len()));
    let decision = whole.flatten().and_then(|o| agent.decide(o).ok());
    let Some(decision) = decision else {
        return Answer::Refused {
            refusal: Refusal::Length,
            detail: u32::try_from(elements.len()).unwrap_or(u32::MAX),
        };
    };
    let instructions = decision.instructions;
    match decision.action {
        Action::Discrete(index) => Answer::Index {
            index,
            instructions,
        },
        Action::Continuous(outputs) => {
            let (places, _) = values.as_chunks_mut::<4>();
            for (place, value) in places.iter_mut().zip(outputs) {
                *place = value.to_le_bytes();
            }
            // The sizes were checked, so all of them fit.
            let len = (4 * outputs.len()).min(values.len());
            Answer::Values {
                values: &values[..len],
                instructions,
            }
        }
    }
}
