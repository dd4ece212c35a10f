//! The plant's side: a controller that is another process, for the trainer's episode loop.

use std::fmt;
use std::time::{Duration, Instant};

use hdrhistogram::Histogram;
use tpg_runtime::{Action, Header, Policy, Reset};
use tpg_trainer::eval::{Controller, Reply};

use crate::contract::Contract;
use crate::error::BridgeError;
use crate::link::Link;
use crate::message::{ActionMessage, ObservationMessage, Refusal, Request, Response, Role};
use crate::run::RunName;

/// Longest round trip that the histogram tells from longer ones, in nanoseconds.
const LONGEST_NS: u64 = 3_600_000_000_000;

/// The controller at the other end of a link.
#[derive(Debug)]
pub struct RemoteController {
    link: Link<ObservationMessage, ActionMessage>,
    header: Header,
    request: ObservationMessage,
    reply: ActionMessage,
    round_trips_ns: Histogram<u64>,
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
        timeout: Duration,
    ) -> Result<Self, BridgeError> {
        let contract = Contract::new(policy, blob)?;
        // The bounds are fixed, so that recording never allocates.
        let round_trips_ns = Histogram::new_with_bounds(1, LONGEST_NS, 3)
            .map_err(BridgeError::transport("prepare a histogram"))?;
        let link = Link::connect(run, &contract, timeout)?;
        Ok(RemoteController {
            link,
            header: *policy.header(),
            request: ObservationMessage::empty(),
            reply: ActionMessage::empty(),
            round_trips_ns,
        })
    }

    /// Process number of the controller.
    #[must_use]
    pub const fn controller_pid(&self) -> u32 {
        self.link.peer_pid()
    }

    /// Ends the loop and says how long decisions took.
    ///
    /// # Errors
    /// Where the controller does not confirm.
    pub fn finish(mut self) -> Result<Latency, BridgeError> {
        self.request.len = 0;
        self.exchange(Request::Shutdown)?;
        self.expect(Response::Ready)?;
        Ok(Latency::new(&self.round_trips_ns))
    }

    /// One request and its reply.
    fn exchange(&mut self, kind: Request) -> Result<(), BridgeError> {
        self.request.seq += 1;
        self.request.kind = kind.code();
        self.link.send(&self.request)?;
        self.reply = self.link.receive()?;
        if self.reply.seq != self.request.seq {
            return Err(BridgeError::OutOfStep {
                peer: Role::Controller,
                expected: self.request.seq,
                got: self.reply.seq,
            });
        }
        Ok(())
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
            _ => Err(nonsense("kind of reply", self.reply.kind)),
        }
    }

    /// The action in the reply, if the policy can have chosen it.
    fn action(&self) -> Result<Action<'_>, BridgeError> {
        let (header, reply) = (&self.header, &self.reply);
        if header.outputs() == 0 {
            self.expect(Response::Discrete)?;
            return match u16::try_from(reply.index) {
                Ok(index) if index < header.actions => Ok(Action::Discrete(index)),
                _ => Err(nonsense("index of an action", reply.index)),
            };
        }
        self.expect(Response::Continuous)?;
        let values = reply.values.get(..header.outputs()).unwrap_or_default();
        if reply.len != u32::from(header.actions) {
            return Err(nonsense("length of an action", reply.len));
        }
        let range = header.action_low..=header.action_high;
        match values.iter().find(|v| !range.contains(v)) {
            Some(stray) => Err(nonsense("value of an action", stray)),
            None => Ok(Action::Continuous(values)),
        }
    }
}

#[cold]
fn nonsense(what: &'static str, got: impl fmt::Display) -> BridgeError {
    BridgeError::Nonsense {
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
        for (place, value) in self.request.values.iter_mut().zip(observation) {
            *place = *value;
        }
        self.request.len = u32::try_from(observation.len()).unwrap_or(u32::MAX);
        let sent = Instant::now();
        self.exchange(Request::Observe)?;
        let elapsed_ns = u64::try_from(sent.elapsed().as_nanos()).unwrap_or(u64::MAX);
        self.round_trips_ns.saturating_record(elapsed_ns);
        self.request.time_us += u64::from(self.header.control_period_us);
        Ok(Reply {
            action: self.action()?,
            instructions: self.reply.instructions,
        })
    }
}

/// How long round trips took: observation sent to action received, in nanoseconds, to three digits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Latency {
    /// Number of decisions.
    pub count: u64,
    /// Half of them took no longer.
    pub median_ns: u64,
    /// 99 of 100 took no longer.
    pub p99_ns: u64,
    /// The longest.
    pub max_ns: u64,
}

impl Latency {
    fn new(round_trips_ns: &Histogram<u64>) -> Self {
        Latency {
            count: round_trips_ns.len(),
            median_ns: round_trips_ns.value_at_quantile(0.5),
            p99_ns: round_trips_ns.value_at_quantile(0.99),
            max_ns: round_trips_ns.max(),
        }
    }

    /// The form that stands in `--json`.
    #[must_use]
    pub fn to_json(self) -> serde_json::Value {
        serde_json::json!({
            "unit": "ns",
            "count": self.count,
            "median": self.median_ns,
            "p99": self.p99_ns,
            "max": self.max_ns,
        })
    }
}

impl fmt::Display for Latency {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [median, p99, max] =
            [self.median_ns, self.p99_ns, self.max_ns].map(|ns| ns as f64 / 1e3);
        write!(
            f,
            "round trip     median {median:.1} us, p99 {p99:.1} us, max {max:.1} us"
        )
    }
}
