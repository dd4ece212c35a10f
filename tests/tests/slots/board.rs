//! A board on this machine, for tests of its slots: the firmware's own session over simulated flash.
#![allow(dead_code, reason = "each test file uses a part")]

use tpg_board::serial::{GOOD_PERIODS, Rules, Session};
use tpg_board::sim::SimFlash;
use tpg_runtime::wire::{self, Answer, Frame, Identity, Receiver, Refusal, Request, Stored};
use tpg_runtime::{Agent, Fixed, Header, Policy, State};

pub const BUILT_IN: &[u8] = include_bytes!("../../golden/champions/hopper-sr-sm-b23.tpg");
const FRAME: usize = 1024;

type Roomy = Agent<'static, Fixed<11>, State<4096, 64, 16, 48>>;

/// A board between two power cuts: the firmware's own session over simulated flash.
pub struct Board {
    agent: Box<Roomy>,
    pub session: Session<SimFlash>,
    seq: u32,
}

impl Board {
    pub fn start(flash: &SimFlash) -> Self {
        Self::start_by(Rules::DEFAULT, flash)
    }

    pub fn start_by(rules: Rules, flash: &SimFlash) -> Self {
        let policy = Policy::load(BUILT_IN).expect("valid");
        let mut agent = Box::new(Roomy::new(policy).expect("fits"));
        let session = Session::start(BUILT_IN, Some(flash.clone()), &mut agent, rules);
        Board {
            agent,
            session: session.expect("fits"),
            seq: 0,
        }
    }

    pub fn ask<T>(&mut self, message: Request<'_>, take: impl FnOnce(Answer<'_>) -> T) -> T {
        self.seq += 1;
        let (mut buffer, mut receiver) = ([0; FRAME], Receiver::<FRAME>::new());
        let frame = Frame {
            seq: self.seq,
            message,
        };
        let len = wire::write(&frame, &mut buffer).expect("fits");
        let mut answered = Vec::new();
        for byte in &buffer[..len] {
            answered.extend_from_slice(self.session.take(&mut self.agent, *byte));
        }
        for byte in answered {
            if let Some(frame) = receiver.push::<Answer<'_>>(byte) {
                assert_eq!(frame.seq, self.seq);
                return take(frame.message);
            }
        }
        panic!("no answer");
    }

    pub fn identity(&mut self) -> Identity {
        self.ask(Request::Hello, |answer| match answer {
            Answer::Identity(identity) => identity,
            other => panic!("{other:?}"),
        })
    }

    pub fn step(&mut self, request: Request<'_>) -> Result<(), (Refusal, u32)> {
        self.ask(request, |answer| match answer {
            Answer::Ready => Ok(()),
            Answer::Refused { refusal, detail } => Err((refusal, detail)),
            other => panic!("{other:?}"),
        })
    }

    pub fn decide(&mut self) {
        let decided = self.ask(Request::Observe { values: &[0; 44] }, |answer| {
            matches!(answer, Answer::Values { .. })
        });
        assert!(decided, "the policy does not decide");
    }

    /// Decides until a new policy is confirmed.
    pub fn prove(&mut self) {
        for _ in 0..GOOD_PERIODS {
            self.decide();
        }
    }

    pub fn running(&mut self) -> [u8; 16] {
        self.identity().provenance
    }

    pub fn slot(&mut self, number: u8) -> Result<Stored, (Refusal, u32)> {
        self.ask(Request::Slot { number }, |answer| match answer {
            Answer::Slot(stored) => Ok(stored),
            Answer::Refused { refusal, detail } => Err((refusal, detail)),
            other => panic!("{other:?}"),
        })
    }

    pub fn update(&mut self, file: &[u8]) -> Result<(), (Refusal, u32)> {
        self.update_by(file, false)
    }

    pub fn update_by(&mut self, file: &[u8], forced: bool) -> Result<(), (Refusal, u32)> {
        self.step(Request::Begin {
            bytes: file.len() as u32,
            contract: wire::contract_of(file),
            release: Header::peek(file).map_or(0, |header| header.release),
            forced,
        })?;
        for (k, bytes) in file.chunks(64).enumerate() {
            self.step(Request::Store {
                at: 64 * k as u32,
                bytes,
            })?;
        }
        self.step(Request::Commit)
    }
}

/// Three policies of the board's width and observation that differ in their provenance.
pub fn policies() -> [Vec<u8>; 3] {
    [1, 2, 3].map(|mark| {
        let mut file = BUILT_IN.to_vec();
        file[56] = mark;
        sealed(file)
    })
}

pub fn sealed(mut file: Vec<u8>) -> Vec<u8> {
    let end = file.len() - 4;
    let crc = wire::checksum(&file[..end]);
    file[end..].copy_from_slice(&crc.to_le_bytes());
    file
}

pub fn provenance(file: &[u8]) -> [u8; 16] {
    Policy::load(file).expect("valid").header().provenance
}
