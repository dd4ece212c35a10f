//! The plant's side: a controller in another process, as the episode loop of `tpg-tasks` needs it.

use std::fmt;
use std::time::{Duration, Instant};

use hdrhistogram::Histogram;
use tpg_runtime::tables::Range;
use tpg_runtime::{Action, Header, Policy, Reset};
use tpg_tasks::eval::{Controller, Reply};

use crate::args::Deadlines;
use crate::error::BridgeError;
use crate::handshake::Handshake;
use crate::link::Link;
use crate::losses::Losses;
use crate::message::{ActionMessage, ObservationMessage, Refusal, Request, Response, Role};
use crate::run::RunName;
use crate::serial::{SerialLink, SerialPath};
use crate::step::{Source, Step, Stepping};
use crate::timing::{Latency, histogram_ns, nanoseconds, percentiles_us};
use crate::transport::Transport;

/// The controller at the other end of a link.
#[derive(Debug)]
pub struct RemoteController {
    transport: Box<dyn Transport>,
    /// Of a controller that is a process.
    controller_pid: Option<u32>,
    header: Header,
    /// Of each output.
    ranges: Vec<Range>,
    request: ObservationMessage,
    reply: ActionMessage,
    /// In real time, answers to earlier requests are no error.
    real_time: bool,
    late_answers: u64,
    round_trips_ns: Histogram<u64>,
    /// The last step in lock-step; none before the first one.
    step: Option<Step>,
}

impl RemoteController {
    /// Waits for the controller of a run, which must have read its policy from the same bytes.
    ///
    /// # Errors
    /// [`BridgeError::TooLarge`] if observation or action do not fit a message, else those of [`Link::connect`].
    pub fn connect(
        policy: &Policy<'_>,
        blob: &[u8],
        run: &RunName,
        deadlines: impl Into<Deadlines>,
    ) -> Result<Self, BridgeError> {
        let handshake = Handshake::new(policy, blob)?;
        let link = Link::connect(run, &handshake, deadlines)?;
        let controller_pid = Some(link.peer_pid());
        Self::new(policy, Box::new(link), controller_pid)
    }

    /// Opens a serial line to a board, which must run the policy of the same bytes.
    ///
    /// # Errors
    /// [`BridgeError::TooLarge`] if observation or action do not fit a message, else those of the line.
    pub fn connect_serial(
        policy: &Policy<'_>,
        blob: &[u8],
        place: &SerialPath,
        timeout: Duration,
    ) -> Result<Self, BridgeError> {
        let link = SerialLink::connect(policy, blob, place, timeout)?;
        Self::new(policy, Box::new(link), None)
    }

    /// As [`connect_serial`](Self::connect_serial), with whatever decides at the other end: another policy, or none. The
    /// policy says what an observation and an action look like.
    ///
    /// # Errors
    /// As there.
    pub fn connect_any(
        policy: &Policy<'_>,
        place: &SerialPath,
        timeout: Duration,
    ) -> Result<Self, BridgeError> {
        let link = SerialLink::connect_any(policy, place, timeout)?;
        Self::new(policy, Box::new(link), None)
    }

    fn new(
        policy: &Policy<'_>,
        transport: Box<dyn Transport>,
        controller_pid: Option<u32>,
    ) -> Result<Self, BridgeError> {
        let round_trips_ns = histogram_ns()?;
        Ok(RemoteController {
            transport,
            controller_pid,
            header: *policy.header(),
            ranges: policy.output_ranges().collect(),
            request: ObservationMessage::empty(),
            reply: ActionMessage::empty(),
            real_time: false,
            late_answers: 0,
            round_trips_ns,
            step: None,
        })
    }

    /// Process number of the controller; none of a board.
    #[must_use]
    pub const fn controller_pid(&self) -> Option<u32> {
        self.controller_pid
    }

    /// Ends the loop and says how long decisions took, and what was lost on a serial line.
    ///
    /// # Errors
    /// Where the controller does not confirm.
    pub fn finish(mut self) -> Result<(Latency, Option<Losses>), BridgeError> {
        self.request.len = 0;
        self.exchange(Request::Shutdown)?;
        self.expect(Response::Ready)?;
        let latency = Latency::new(&self.round_trips_ns);
        Ok((latency, self.transport.losses()))
    }

    /// The distribution of round trips, in microseconds, as the text that tools for HdrHistogram read.
    #[must_use]
    pub fn percentiles(&self) -> String {
        percentiles_us(&self.round_trips_ns)
    }

    /// Answers that came too late, in real time.
    pub(crate) const fn late_answers(&self) -> u64 {
        self.late_answers
    }

    /// What the policy's header says.
    pub(crate) const fn header(&self) -> &Header {
        &self.header
    }

    /// An action of zeros, or of what lies nearest to 0 in each output's range. Empty for a discrete policy.
    pub(crate) fn rest(&self) -> Vec<f32> {
        let ranges = self.ranges.iter();
        ranges
            .map(|range| 0.0f32.clamp(range.low, range.high))
            .collect()
    }

    /// Drops answers to earlier requests from now on.
    pub(crate) const fn run_in_real_time(&mut self) {
        self.real_time = true;
    }

    /// One request and its reply.
    fn exchange(&mut self, kind: Request) -> Result<(), BridgeError> {
        self.send(kind)?;
        self.await_reply()
    }

    fn await_reply(&mut self) -> Result<(), BridgeError> {
        loop {
            let reply = self.transport.receive()?;
            if self.accept(reply)? {
                return Ok(());
            }
        }
    }

    fn send(&mut self, kind: Request) -> Result<(), BridgeError> {
        self.request.seq += 1;
        self.request.kind = kind.code();
        self.transport.send(&self.request)
    }

    /// Sends an observation with this kind of request.
    pub(crate) fn send_observation(
        &mut self,
        kind: Request,
        observation: &[f32],
    ) -> Result<(), BridgeError> {
        for (place, value) in self.request.values.iter_mut().zip(observation) {
            *place = *value;
        }
        self.request.len = u32::try_from(observation.len()).unwrap_or(u32::MAX);
        self.send(kind)?;
        self.request.time_us += u64::from(self.header.control_period_us);
        Ok(())
    }

    /// Looks for the answer to the last request, without waiting; drops late ones before it.
    pub(crate) fn poll(&mut self) -> Result<bool, BridgeError> {
        while let Some(reply) = self.transport.poll()? {
            if self.accept(reply)? {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Finds out why there has been no answer for a while.
    pub(crate) fn look(&mut self, waited: Duration) -> Result<(), BridgeError> {
        self.transport.look(waited)
    }

    /// Takes the reply to the last request; `false` if it answers an earlier one.
    fn accept(&mut self, reply: ActionMessage) -> Result<bool, BridgeError> {
        if reply.seq == self.request.seq {
            self.reply = reply;
            return Ok(true);
        }
        if !self.real_time || reply.seq > self.request.seq {
            return Err(BridgeError::OutOfStep {
                peer: Role::Controller,
                expected: self.request.seq,
                got: reply.seq,
            });
        }
        if reply.kind == Response::Refused.code() {
            // Its last word, after which it has ended.
            self.reply = reply;
            self.expect(Response::Ready)?;
        }
        self.late_answers += 1;
        Ok(false)
    }

    pub(crate) fn record_round_trip(&mut self, elapsed: Duration) {
        self.round_trips_ns.saturating_record(nanoseconds(elapsed));
    }

    /// The last answer taken.
    pub(crate) fn reply(&self) -> Result<Reply<'_>, BridgeError> {
        Ok(Reply {
            action: self.action()?,
            instructions: self.reply.instructions,
        })
    }

    /// Checks the kind of the reply.
    fn expect(&self, due: Response) -> Result<(), BridgeError> {
        match Response::from_code(self.reply.kind) {
            Some(kind) if kind == due => Ok(()),
            Some(Response::Refused) => Err(BridgeError::Refused {
                peer: Role::Controller,
                what: match Refusal::from_code(self.reply.refusal) {
                    Some(Refusal::Kind) => "kind",
                    Some(Refusal::Length) => "observation length",
                    Some(Refusal::Sequence) => "number",
                    None => "reason",
                },
                got: self.reply.detail,
            }),
            _ => Err(invalid("kind of reply", self.reply.kind)),
        }
    }

    /// The action in the reply, if the policy can have chosen it.
    fn action(&self) -> Result<Action<'_>, BridgeError> {
        let (header, reply) = (&self.header, &self.reply);
        if header.outputs() == 0 {
            self.expect(Response::Discrete)?;
            return match u16::try_from(reply.index) {
                Ok(index) if index < header.actions => Ok(Action::Discrete(index)),
                _ => Err(invalid("index of an action", reply.index)),
            };
        }
        self.expect(Response::Continuous)?;
        let values = reply.values.get(..header.outputs()).unwrap_or_default();
        if reply.len != u32::from(header.actions) {
            return Err(invalid("length of an action", reply.len));
        }
        let within = |(value, range): &(&f32, &Range)| (range.low..=range.high).contains(value);
        match values.iter().zip(&self.ranges).find(|pair| !within(pair)) {
            Some((stray, _)) => Err(invalid("value of an action", stray)),
            None => Ok(Action::Continuous(values)),
        }
    }
}

#[cold]
fn invalid(what: &'static str, got: impl fmt::Display) -> BridgeError {
    BridgeError::Invalid {
        peer: Role::Controller,
        what,
        got: got.to_string(),
    }
}

impl Controller for RemoteController {
    type Error = BridgeError;

    fn reset(&mut self, what: Reset, agent_seed: u64) -> Result<(), BridgeError> {
        self.request.agent_seed = agent_seed;
        self.request.time_us = 0;
        self.request.len = 0;
        self.exchange(match what {
            Reset::Agent => Request::ResetAgent,
            Reset::Episode => Request::ResetEpisode,
        })?;
        self.expect(Response::Ready)
    }

    /// Allocates, locks and prints nothing while the controller answers in time.
    fn decide(&mut self, observation: &[f32]) -> Result<Reply<'_>, BridgeError> {
        let sent = Instant::now();
        self.send_observation(Request::Observe, observation)?;
        self.await_reply()?;
        let latency = sent.elapsed();
        self.record_round_trip(latency);
        self.step = Some(Step {
            sent,
            latency: Some(latency),
            source: Source::Answer,
        });
        self.reply()
    }
}

impl Stepping for RemoteController {
    fn last(&self) -> Result<(Reply<'_>, Step), BridgeError> {
        let step = self.step.ok_or_else(no_step)?;
        Ok((self.reply()?, step))
    }
}

/// Nothing has been decided yet.
#[cold]
pub(crate) fn no_step() -> BridgeError {
    invalid("number of decisions", 0)
}
