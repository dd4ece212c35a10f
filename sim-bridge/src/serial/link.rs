//! A serial line as the transport of a remote controller.

use std::time::Duration;

use tpg_runtime::Policy;
use tpg_runtime::wire::{Answer, Request as Wire};

use super::line::{Line, fits};
use super::port::SerialPath;
use crate::error::BridgeError;
use crate::losses::Losses;
use crate::message::{
    ActionMessage, MAX_ACTION, MAX_OBSERVATION, ObservationMessage, Request, Response,
};
use crate::transport::Transport;

/// A board as the controller of a loop.
#[derive(Debug)]
pub(crate) struct SerialLink {
    line: Line,
    /// What to subtract from a number on the line to get the request's; both count up by one.
    base: u32,
    /// Whether answers to earlier requests matter: in real time they are counted as late.
    real_time: bool,
    /// The answer to a shutdown, of which a board need not know.
    farewell: Option<ActionMessage>,
    values: Box<[u8; 4 * MAX_OBSERVATION]>,
}

impl SerialLink {
    /// Opens a line to a board that must run this policy, read from the bytes `file`.
    pub(crate) fn connect(
        policy: &Policy<'_>,
        file: &[u8],
        place: &SerialPath,
        timeout: Duration,
    ) -> Result<Self, BridgeError> {
        fits(policy.header())?;
        let mut line = Line::open(place, timeout)?;
        line.greet_for(policy, file)?;
        Ok(Self::over(line))
    }

    /// Opens a line to whoever speaks the protocol, for observations and actions as this policy has them.
    pub(crate) fn connect_any(
        policy: &Policy<'_>,
        place: &SerialPath,
        timeout: Duration,
    ) -> Result<Self, BridgeError> {
        fits(policy.header())?;
        let mut line = Line::open(place, timeout)?;
        line.greet()?;
        Ok(Self::over(line))
    }

    fn over(line: Line) -> Self {
        SerialLink {
            base: line.seq(),
            line,
            real_time: false,
            farewell: None,
            values: Box::new([0; 4 * MAX_OBSERVATION]),
        }
    }

    /// What to make of an answer; `None` if it is of no interest.
    fn reply(&self) -> impl Fn(u32, Answer<'_>) -> Option<Result<ActionMessage, Refused>> + use<> {
        let (base, last, real_time) = (self.base, self.line.seq(), self.real_time);
        move |seq, answer| {
            let number = seq.wrapping_sub(base);
            let due = last.wrapping_sub(base);
            // The answer to a request that was sent twice comes twice.
            if number > due || (number < due && !real_time) {
                return None;
            }
            Some(translate(u64::from(number), answer))
        }
    }

    fn accept(&self, reply: Result<ActionMessage, Refused>) -> Result<ActionMessage, BridgeError> {
        reply.map_err(|refused| match refused {
            Refused::Board(refusal, detail) => self.line.refused(refusal, detail),
            Refused::Invalid(what) => self.line.invalid(what),
        })
    }
}

/// Why an answer cannot be used.
enum Refused {
    Board(tpg_runtime::wire::Refusal, u32),
    Invalid(&'static str),
}

fn translate(seq: u64, answer: Answer<'_>) -> Result<ActionMessage, Refused> {
    let mut reply = ActionMessage::empty();
    reply.seq = seq;
    match answer {
        Answer::Ready => reply.kind = Response::Ready.code(),
        Answer::Index {
            index,
            instructions,
        } => {
            reply.kind = Response::Discrete.code();
            reply.index = index.into();
            reply.instructions = instructions;
        }
        Answer::Values {
            values,
            instructions,
        } => {
            let (values, rest) = values.as_chunks::<4>();
            if !rest.is_empty() || values.len() > MAX_ACTION {
                return Err(Refused::Invalid("length of an action"));
            }
            reply.kind = Response::Continuous.code();
            reply.instructions = instructions;
            reply.len = u32::try_from(values.len()).unwrap_or(u32::MAX);
            for (place, bytes) in reply.values.iter_mut().zip(values) {
                *place = f32::from_le_bytes(*bytes);
            }
        }
        Answer::Refused { refusal, detail } => return Err(Refused::Board(refusal, detail)),
        Answer::Identity(_) | Answer::Slot(_) | Answer::Contract { .. } => {
            return Err(Refused::Invalid("kind of answer"));
        }
    }
    Ok(reply)
}

impl Transport for SerialLink {
    fn send(&mut self, request: &ObservationMessage) -> Result<(), BridgeError> {
        let seed = request.agent_seed;
        let kind = Request::from_code(request.kind);
        self.real_time |= kind == Some(Request::ObserveLatest);
        match kind {
            Some(Request::ResetAgent) => self.line.send(Wire::Reset { agent: true, seed }),
            Some(Request::ResetEpisode) => self.line.send(Wire::Reset { agent: false, seed }),
            Some(Request::Observe | Request::ObserveLatest) => {
                let len = (request.len as usize).min(MAX_OBSERVATION);
                let (places, _) = self.values.as_chunks_mut::<4>();
                for (place, value) in places.iter_mut().zip(&request.values[..len]) {
                    *place = value.to_le_bytes();
                }
                let values = &self.values[..4 * len];
                self.line.send(Wire::Observe { values })
            }
            Some(Request::Shutdown) | None => {
                let mut reply = ActionMessage::empty();
                reply.seq = request.seq;
                reply.kind = Response::Ready.code();
                self.farewell = Some(reply);
                Ok(())
            }
        }
    }

    fn receive(&mut self) -> Result<ActionMessage, BridgeError> {
        if let Some(reply) = self.farewell.take() {
            return Ok(reply);
        }
        let take = self.reply();
        let reply = self.line.wait(take)?;
        self.accept(reply)
    }

    fn poll(&mut self) -> Result<Option<ActionMessage>, BridgeError> {
        let take = self.reply();
        match self.line.poll(&take)? {
            Some(reply) => self.accept(reply).map(Some),
            None => Ok(None),
        }
    }

    fn look(&mut self, waited: Duration) -> Result<(), BridgeError> {
        self.line.look(waited)
    }

    fn losses(&self) -> Option<Losses> {
        Some(self.line.losses())
    }
}
