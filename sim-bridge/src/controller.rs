//! The controller's side: answers what the plant asks, on the runtime alone.

use std::thread;
use std::time::Duration;

use tpg_runtime::{Action, HostAgent, Policy, Reset};

use crate::args::Deadlines;
use crate::error::BridgeError;
use crate::handshake::Handshake;
use crate::link::Link;
use crate::message::{ActionMessage, ObservationMessage, Refusal, Request, Response, Role};
use crate::run::RunName;

/// An agent at the other end of a link.
#[derive(Debug)]
pub struct Server<'p> {
    agent: Box<HostAgent<'p>>,
    /// Time to sleep after an answer in real time: half a period, so that the plant finds the processor free.
    rest: Duration,
    link: Link<ActionMessage, ObservationMessage>,
}

impl<'p> Server<'p> {
    /// Loads a policy, read from the bytes `blob`, and waits for the plant of a run.
    ///
    /// # Errors
    /// [`BridgeError::Capacity`] or [`BridgeError::TooLarge`] if the policy does not fit, else those of
    /// [`Link::connect`].
    pub fn connect(
        policy: Policy<'p>,
        blob: &[u8],
        run: &RunName,
        deadlines: impl Into<Deadlines>,
    ) -> Result<Self, BridgeError> {
        let handshake = Handshake::new(&policy, blob)?;
        let rest = Duration::from_micros(policy.header().control_period_us.into()) / 2;
        let agent = Box::new(HostAgent::new(policy)?);
        let link = Link::connect(run, &handshake, deadlines)?;
        Ok(Server { agent, rest, link })
    }

    /// Process number of the plant.
    #[must_use]
    pub const fn plant_pid(&self) -> u32 {
        self.link.peer_pid()
    }

    /// Answers until the plant ends the loop.
    ///
    /// # Errors
    /// Those of [`Link::receive`] and [`Link::send`], and [`BridgeError::Invalid`] or
    /// [`BridgeError::OutOfStep`] for a request that was refused.
    pub fn serve(&mut self) -> Result<(), BridgeError> {
        let mut reply = ActionMessage::empty();
        let mut real_time = false;
        loop {
            let (request, latest) = self.next_request()?;
            real_time |= latest;
            let due = reply.seq.wrapping_add(1);
            let answered = answer(&mut self.agent, due, real_time, &request, &mut reply);
            self.link.send(&reply)?;
            if answered? == Next::End {
                return Ok(());
            }
            if latest {
                thread::sleep(self.rest);
            }
        }
    }

    /// The next request that must be answered, and whether the loop runs in real time.
    fn next_request(&self) -> Result<(ObservationMessage, bool), BridgeError> {
        let mut request = self.link.receive()?;
        let mut latest = false;
        while request.kind == Request::ObserveLatest.code() {
            latest = true;
            match self.link.poll()? {
                Some(newer) => request = newer,
                None => break,
            }
        }
        Ok((request, latest))
    }
}

/// What follows an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Next {
    GoOn,
    End,
}

/// Writes the reply to a request, whose number may be greater than the one due where there may be gaps; nothing in
/// the request is trusted.
fn answer(
    agent: &mut HostAgent<'_>,
    due: u64,
    gaps: bool,
    request: &ObservationMessage,
    reply: &mut ActionMessage,
) -> Result<Next, BridgeError> {
    let peer = Role::Plant;
    reply.seq = request.seq;
    reply.refusal = 0;
    reply.len = 0;
    if request.seq < due || (request.seq > due && !gaps) {
        refuse(reply, Refusal::Sequence, request.seq as u32);
        return Err(BridgeError::OutOfStep {
            peer,
            expected: due,
            got: request.seq,
        });
    }
    let invalid = |what, got: u32| {
        let got = got.to_string();
        Err(BridgeError::Invalid { peer, what, got })
    };
    let (kind, next) = match Request::from_code(request.kind) {
        None => {
            refuse(reply, Refusal::Kind, request.kind);
            return invalid("kind of request", request.kind);
        }
        Some(Request::ResetAgent) => {
            agent.reset(Reset::Agent, request.agent_seed);
            (Response::Ready, Next::GoOn)
        }
        Some(Request::ResetEpisode) => {
            agent.reset(Reset::Episode, request.agent_seed);
            (Response::Ready, Next::GoOn)
        }
        Some(Request::Shutdown) => (Response::Ready, Next::End),
        Some(Request::Observe | Request::ObserveLatest) => {
            let observation = usize::try_from(request.len)
                .ok()
                .and_then(|len| request.values.get(..len));
            let decision = observation.and_then(|o| agent.decide(o).ok());
            let Some(decision) = decision else {
                refuse(reply, Refusal::Length, request.len);
                return invalid("length of observation", request.len);
            };
            reply.instructions = decision.instructions;
            (write_action(reply, decision.action), Next::GoOn)
        }
    };
    reply.kind = kind.code();
    Ok(next)
}

fn write_action(reply: &mut ActionMessage, action: Action<'_>) -> Response {
    match action {
        Action::Discrete(index) => {
            reply.index = u32::from(index);
            Response::Discrete
        }
        Action::Continuous(values) => {
            // The handshake has checked that all of them fit.
            for (place, value) in reply.values.iter_mut().zip(values) {
                *place = *value;
            }
            reply.len = values.len() as u32;
            Response::Continuous
        }
    }
}

fn refuse(reply: &mut ActionMessage, refusal: Refusal, detail: u32) {
    reply.kind = Response::Refused.code();
    reply.refusal = refusal.code();
    reply.detail = detail;
}
