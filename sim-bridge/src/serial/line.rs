//! Numbered requests and answers, with a deadline on every wait; a request without an answer is sent again.

use std::thread;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use tpg_runtime::wire::{self, Answer, Frame, Identity, PROTOCOL, Receiver, Request};
use tpg_runtime::{Header, Policy};

use super::port::{Port, SerialPath};
use crate::conversation::FRAME;
use crate::error::BridgeError;
use crate::interrupt;
use crate::losses::Losses;

/// Time without an answer after which a request is sent again.
const RESEND_AFTER: Duration = Duration::from_millis(250);
/// Most reads in one look for answers. More may lie on the line, but whoever waits must see to its deadline first.
const READS: usize = 16;
/// Time after which a wait no longer takes a whole processor.
const EAGER: Duration = Duration::from_micros(200);
/// Time between two looks from then on.
const PAUSE: Duration = Duration::from_micros(50);

/// A serial line with a board at its other end.
#[derive(Debug)]
pub struct Line {
    port: Port,
    path: String,
    timeout: Duration,
    receiver: Receiver<FRAME>,
    /// Bytes that were read but not looked at yet.
    read: [u8; FRAME],
    unread: std::ops::Range<usize>,
    /// The last request, as sent.
    frame: [u8; FRAME],
    frame_len: usize,
    /// Number of the last request.
    seq: u32,
    losses: Losses,
}

impl Line {
    /// Opens a line; every wait ends after `timeout`.
    ///
    /// # Errors
    /// [`BridgeError::CannotOpen`].
    pub fn open(place: &SerialPath, timeout: Duration) -> Result<Self, BridgeError> {
        // Answers of an earlier conversation may still be on the line; they must not have our numbers.
        let now = SystemTime::now().duration_since(UNIX_EPOCH);
        let seq = now.map_or(0, |now| now.subsec_nanos());
        Ok(Line {
            port: Port::open(place)?,
            path: place.path.clone(),
            timeout,
            receiver: Receiver::new(),
            read: [0; FRAME],
            unread: 0..0,
            frame: [0; FRAME],
            frame_len: 0,
            seq,
            losses: Losses::default(),
        })
    }

    /// Begins the conversation and says who answers.
    ///
    /// # Errors
    /// [`BridgeError::NoAnswer`], [`BridgeError::Unplugged`], [`BridgeError::OtherBoard`] if the board talks otherwise.
    pub fn greet(&mut self) -> Result<Identity, BridgeError> {
        let identity = self.ask(Request::Hello, |answer| match answer {
            Answer::Identity(identity) => Some(identity),
            _ => None,
        })?;
        let identity = identity.ok_or_else(|| self.invalid("kind of answer to a greeting"))?;
        self.losses.damaged_there_before = identity.damaged.into();
        if identity.protocol != PROTOCOL {
            return Err(BridgeError::OtherBoard {
                path: self.path.clone(),
                difference: format!("protocol is {PROTOCOL} here, {} there", identity.protocol),
                advice: "build the firmware from the same version as tpg",
            });
        }
        Ok(identity)
    }

    /// Greets a board that must run this policy, read from the bytes `file`.
    ///
    /// # Errors
    /// Those of [`greet`](Self::greet), and [`BridgeError::OtherBoard`] if it runs another one.
    pub fn greet_for(&mut self, policy: &Policy<'_>, file: &[u8]) -> Result<(), BridgeError> {
        let (ours, theirs) = (Identity::new(policy, file), self.greet()?);
        let name = |identity: &Identity| {
            let run: String = (identity.provenance.iter())
                .map(|byte| format!("{byte:02x}"))
                .collect();
            let (bytes, crc) = (identity.policy_bytes, identity.policy_crc);
            format!("{bytes} bytes with checksum {crc:08x} of run {run}")
        };
        if name(&ours) == name(&theirs) {
            return Ok(());
        }
        Err(BridgeError::OtherBoard {
            path: self.path.clone(),
            difference: format!("policy is {} here, {} there", name(&ours), name(&theirs)),
            advice: "send it the new policy by `tpg update FILE.tpg`, give tpg the file that the board runs, or take any \
                 controller by --any-controller",
        })
    }

    /// Sends a request, again if need be, and hands its answer to `take`.
    ///
    /// # Errors
    /// [`BridgeError::NoAnswer`], [`BridgeError::Unplugged`], [`BridgeError::Interrupted`].
    pub(super) fn ask<T>(
        &mut self,
        request: Request<'_>,
        take: impl Fn(Answer<'_>) -> T,
    ) -> Result<T, BridgeError> {
        self.send(request)?;
        let seq = self.seq;
        self.wait(|answer_seq, answer| (answer_seq == seq).then(|| take(answer)))
    }

    /// Waits for an answer that `take` takes; sends the last request again meanwhile.
    pub(super) fn wait<T>(
        &mut self,
        take: impl Fn(u32, Answer<'_>) -> Option<T>,
    ) -> Result<T, BridgeError> {
        let start = Instant::now();
        let mut resend_at = RESEND_AFTER;
        loop {
            if let Some(taken) = self.poll(&take)? {
                return Ok(taken);
            }
            if interrupt::requested() {
                return Err(BridgeError::Interrupted);
            }
            let waited = start.elapsed();
            self.look(waited)?;
            if waited >= resend_at {
                self.losses.resent += 1;
                self.transmit(self.timeout.saturating_sub(waited))?;
                resend_at = waited + RESEND_AFTER;
            }
            if waited < EAGER {
                thread::yield_now();
            } else {
                thread::sleep(PAUSE);
            }
        }
    }

    /// Offers `take` what answers have come, until it takes one. Leaves the rest of a flood for the next time.
    pub(super) fn poll<T>(
        &mut self,
        take: &impl Fn(u32, Answer<'_>) -> Option<T>,
    ) -> Result<Option<T>, BridgeError> {
        for _ in 0..=READS {
            for at in self.unread.clone() {
                self.unread.start = at + 1;
                if let Some(frame) = self.receiver.push::<Answer<'_>>(self.read[at])
                    && let Some(taken) = take(frame.seq, frame.message)
                {
                    return Ok(Some(taken));
                }
            }
            let len = self.port.read(&mut self.read)?;
            if len == 0 {
                return Ok(None);
            }
            self.unread = 0..len;
        }
        Ok(None)
    }

    /// Sends a request with the next number.
    pub(super) fn send(&mut self, request: Request<'_>) -> Result<(), BridgeError> {
        self.seq = self.seq.wrapping_add(1);
        let frame = Frame {
            seq: self.seq,
            message: request,
        };
        self.frame_len = wire::write(&frame, &mut self.frame)
            .map_err(BridgeError::transport("frame a request"))?;
        self.transmit(self.timeout)
    }

    /// An error if the board has been silent for too long.
    pub(super) fn look(&self, waited: Duration) -> Result<(), BridgeError> {
        if waited < self.timeout {
            return Ok(());
        }
        Err(BridgeError::NoAnswer {
            path: self.path.clone(),
            waited_ms: waited.as_millis(),
            resent: self.losses.resent,
            damaged: self.receiver.damaged().into(),
        })
    }

    /// Number of the last request.
    pub(super) const fn seq(&self) -> u32 {
        self.seq
    }

    pub(super) fn losses(&self) -> Losses {
        Losses {
            damaged_here: self.receiver.damaged().into(),
            ..self.losses
        }
    }

    pub(super) fn refused(&self, refusal: wire::Refusal, detail: u32) -> BridgeError {
        BridgeError::BoardRefused {
            path: self.path.clone(),
            reason: refusal.explain(detail).to_string(),
        }
    }

    /// Where the line is.
    pub(super) fn path(&self) -> &str {
        &self.path
    }

    pub(super) fn other(&self, difference: String, advice: &'static str) -> BridgeError {
        BridgeError::OtherBoard {
            path: self.path.clone(),
            difference,
            advice,
        }
    }

    pub(super) fn invalid(&self, what: &'static str) -> BridgeError {
        BridgeError::Invalid {
            peer: crate::message::Role::Controller,
            what,
            got: "another one".into(),
        }
    }

    /// Sends the last request, within what is `left` of the timeout.
    fn transmit(&mut self, left: Duration) -> Result<(), BridgeError> {
        let deadline = Instant::now() + left.min(RESEND_AFTER);
        self.port.write(&self.frame[..self.frame_len], deadline)
    }
}

/// Whether observation and action of a policy fit the messages.
pub(super) fn fits(header: &Header) -> Result<(), BridgeError> {
    crate::handshake::check_sizes(header)
}
