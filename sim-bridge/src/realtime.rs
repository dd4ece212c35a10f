//! The plant's side in real time: each step begins at its time, whether or not an answer has come.

use std::thread;
use std::time::{Duration, Instant};

use hdrhistogram::Histogram;
use tpg_runtime::{Action, Reset};
use tpg_tasks::eval::{Controller, Reply};

use crate::error::BridgeError;
use crate::interrupt;
use crate::link::LIVENESS_INTERVAL;
use crate::losses::Losses;
use crate::message::Request;
use crate::plant::{RemoteController, no_step};
use crate::step::{Source, Step, Stepping};
use crate::timing::{Counts, Latency, Timing, histogram_ns, nanoseconds};

/// Time before a deadline from which on the plant polls rather than sleeps, since sleepers wake up late.
const MARGIN: Duration = Duration::from_micros(400);
/// Time after an observation for which the plant polls for the answer; most answers come within it.
const EAGER: Duration = Duration::from_micros(200);
/// Time between two looks for an answer that did not come within that.
const SLICE: Duration = Duration::from_micros(100);

/// A controller at the other end of a link that must answer within the control period.
///
/// An episode's clock starts at t0, when its first observation is sent. Step k takes the period from t0 + k·period to
/// t0 + (k + 1)·period: observation k is sent at its begin, as soon as the plant has computed it, and the answer must
/// lie in shared memory when the plant looks at its end. If so, the plant does in step k what the answer says, as in
/// lock-step. If not, the period is a miss: the plant does again what it did last, and after too many misses in a row
/// the safe action, zero within the range or index 0. A late answer is dropped. Between episodes the clock rests, and
/// the controller gets the link's timeout to confirm the reset.
#[derive(Debug)]
pub struct Paced {
    remote: RemoteController,
    period: Duration,
    max_misses: u32,
    safe_values: Vec<f32>,
    /// Deadline and end of the last period; none before the first one of an episode.
    previous: Option<(Instant, Instant)>,
    /// Whether the controller has answered in this episode, so that there is an action to hold.
    has_action: bool,
    misses_in_row: u64,
    /// When the controller last answered in time.
    heard: Instant,
    /// Silence after which the plant looks whether the controller lives.
    next_look: Duration,
    /// The last step; none before the first one.
    step: Option<Step>,
    counts: Counts,
    jitter_ns: Histogram<u64>,
}

impl Paced {
    /// Puts a controller under the clock; more than `max_misses` misses in a row lead to the safe action.
    ///
    /// # Errors
    /// [`BridgeError::NoPeriod`] if the policy was exported without a control period.
    pub fn new(mut remote: RemoteController, max_misses: u32) -> Result<Self, BridgeError> {
        remote.run_in_real_time();
        let header = *remote.header();
        if header.control_period_us == 0 {
            return Err(BridgeError::NoPeriod);
        }
        let safe_values = remote.rest();
        Ok(Paced {
            remote,
            period: Duration::from_micros(header.control_period_us.into()),
            max_misses,
            safe_values,
            previous: None,
            has_action: false,
            misses_in_row: 0,
            heard: Instant::now(),
            next_look: LIVENESS_INTERVAL,
            step: None,
            counts: Counts::default(),
            jitter_ns: histogram_ns()?,
        })
    }

    /// Ends the loop and says how long decisions took, what was lost on a serial line, and how the periods went.
    ///
    /// # Errors
    /// Where the controller does not confirm.
    pub fn finish(self) -> Result<(Latency, Option<Losses>, Timing), BridgeError> {
        let period_us = self.remote.header().control_period_us;
        let late_answers = self.remote.late_answers();
        let (latency, losses) = self.remote.finish()?;
        let timing = Timing::new(period_us, &self.jitter_ns, self.counts, late_answers);
        Ok((latency, losses, timing))
    }

    /// As [`RemoteController::percentiles`].
    #[must_use]
    pub fn percentiles(&self) -> String {
        self.remote.percentiles()
    }

    /// Waits for the deadline; how long the answer took if it had come by then.
    fn wait(&mut self, sent: Instant, deadline: Instant) -> Result<Option<Duration>, BridgeError> {
        let mut latency = None;
        loop {
            // Read before the answer is looked for, so that the last look is never before the deadline.
            let now = Instant::now();
            if latency.is_none() && self.remote.poll()? {
                latency = Some(now - sent);
                self.heard = now;
                self.next_look = LIVENESS_INTERVAL;
                self.remote.record_round_trip(now - sent);
            }
            if now >= deadline {
                return Ok(latency);
            }
            let answered = latency.is_some();
            if interrupt::requested() {
                return Err(BridgeError::Interrupted);
            }
            let silence = now.saturating_duration_since(self.heard);
            if !answered && silence >= self.next_look {
                self.remote.look(silence)?;
                self.next_look = silence + LIVENESS_INTERVAL;
            }
            let pause = (deadline - now).saturating_sub(MARGIN);
            if pause.is_zero() || (!answered && now - sent < EAGER) {
                thread::yield_now();
            } else if answered {
                thread::sleep(pause);
            } else {
                thread::sleep(pause.min(SLICE));
            }
        }
    }

    /// Counts a period and what becomes of its step.
    fn count(&mut self, answered: bool) -> Source {
        self.counts.periods += 1;
        if answered {
            self.hear();
            self.has_action = true;
            return Source::Answer;
        }
        self.counts.misses += 1;
        self.misses_in_row += 1;
        self.counts.longest_run = self.counts.longest_run.max(self.misses_in_row);
        if self.has_action && self.misses_in_row <= u64::from(self.max_misses) {
            self.counts.held += 1;
            Source::Held
        } else {
            self.counts.safe += 1;
            Source::Safe
        }
    }

    /// Ends a row of misses.
    fn hear(&mut self) {
        if self.misses_in_row > u64::from(self.max_misses) {
            self.counts.recoveries += 1;
        }
        self.misses_in_row = 0;
    }
}

impl Controller for Paced {
    type Error = BridgeError;

    fn reset(&mut self, what: Reset, agent_seed: u64) -> Result<(), BridgeError> {
        self.remote.reset(what, agent_seed)?;
        self.hear();
        self.heard = Instant::now();
        self.next_look = LIVENESS_INTERVAL;
        self.previous = None;
        self.has_action = false;
        Ok(())
    }

    /// Returns at the end of the period; allocates, locks and prints nothing.
    fn decide(&mut self, observation: &[f32]) -> Result<Reply<'_>, BridgeError> {
        let sent = Instant::now();
        let (begin, previous_end) = self.previous.unwrap_or((sent, sent));
        let deadline = begin + self.period;
        if sent >= deadline {
            self.counts.overruns += 1;
        }
        self.remote
            .send_observation(Request::ObserveLatest, observation)?;
        let latency = self.wait(sent, deadline)?;
        let end = Instant::now();
        let jitter = (end - previous_end).abs_diff(self.period);
        self.jitter_ns.saturating_record(nanoseconds(jitter));
        self.previous = Some((deadline, end));
        let source = self.count(latency.is_some());
        self.step = Some(Step {
            sent,
            latency,
            source,
        });
        self.last().map(|(reply, _)| reply)
    }
}

impl Stepping for Paced {
    fn last(&self) -> Result<(Reply<'_>, Step), BridgeError> {
        let step = self.step.ok_or_else(no_step)?;
        let reply = match step.source {
            Source::Answer => self.remote.reply()?,
            Source::Held => Reply {
                instructions: 0,
                ..self.remote.reply()?
            },
            Source::Safe => Reply {
                instructions: 0,
                action: if self.safe_values.is_empty() {
                    Action::Discrete(0)
                } else {
                    Action::Continuous(&self.safe_values)
                },
            },
        };
        Ok((reply, step))
    }
}
