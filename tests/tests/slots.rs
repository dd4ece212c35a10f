//! Two slots for policies: wherever the power is cut during an update, the next start decides with a working policy.

use std::fs;

use tpg_board::serial::Session;
use tpg_board::sim::SimFlash;
use tpg_board::slots::Slots;
use tpg_board::trial::Generator;
use tpg_runtime::wire::{self, Answer, Frame, Identity, Receiver, Refusal, Request};
use tpg_runtime::{Agent, Fixed, Policy};
use tpg_tests::golden;

const BUILT_IN: &[u8] = include_bytes!("../golden/champions/hopper-sr-sm-b23.tpg");
const FLASH: usize = 8192;
const FRAME: usize = 1024;

type Roomy = Agent<'static, Fixed<11>, 4096, 64, 16, 48>;

/// A board between two power cuts: the firmware's own session over simulated flash.
struct Board {
    agent: Box<Roomy>,
    session: Session<SimFlash>,
    seq: u32,
}

impl Board {
    fn start(flash: &SimFlash) -> Self {
        let policy = Policy::load(BUILT_IN).expect("valid");
        let mut agent = Box::new(Roomy::new(policy).expect("fits"));
        let session = Session::start(BUILT_IN, Some(flash.clone()), &mut agent).expect("fits");
        Board {
            agent,
            session,
            seq: 0,
        }
    }

    fn ask<T>(&mut self, message: Request<'_>, take: impl FnOnce(Answer<'_>) -> T) -> T {
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

    fn identity(&mut self) -> Identity {
        self.ask(Request::Hello, |answer| match answer {
            Answer::Identity(identity) => identity,
            other => panic!("{other:?}"),
        })
    }

    fn step(&mut self, request: Request<'_>) -> Result<(), (Refusal, u32)> {
        self.ask(request, |answer| match answer {
            Answer::Ready => Ok(()),
            Answer::Refused { refusal, detail } => Err((refusal, detail)),
            other => panic!("{other:?}"),
        })
    }

    fn decide(&mut self) {
        let decided = self.ask(Request::Observe { values: &[0; 44] }, |answer| {
            matches!(answer, Answer::Values { .. })
        });
        assert!(decided, "the policy does not decide");
    }

    fn update(&mut self, file: &[u8]) -> Result<(), (Refusal, u32)> {
        self.step(Request::Begin {
            bytes: file.len() as u32,
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
fn policies() -> [Vec<u8>; 3] {
    [1, 2, 3].map(|mark| {
        let mut file = BUILT_IN.to_vec();
        file[56] = mark;
        let end = file.len() - 4;
        let crc = wire::checksum(&file[..end]);
        file[end..].copy_from_slice(&crc.to_le_bytes());
        file
    })
}

fn provenance(file: &[u8]) -> [u8; 16] {
    Policy::load(file).expect("valid").header().provenance
}

#[test]
fn updates_alternate_between_the_slots() {
    let flash = SimFlash::new(FLASH);
    let mut board = Board::start(&flash);
    assert_eq!(board.identity().slot, 0);
    for (k, file) in policies().iter().enumerate() {
        board.update(file).expect("room for it");
        board.decide();
        assert_eq!(usize::from(board.identity().slot), 1 + k % 2);
        board = Board::start(&flash);
        assert_eq!(board.identity().provenance, provenance(file), "kept");
    }
}

#[test]
fn a_power_cut_at_any_byte_leaves_a_working_policy() {
    let [old, new, _] = policies();
    let prepared = || {
        let flash = SimFlash::new(FLASH);
        let mut board = Board::start(&flash);
        board.update(&old).expect("room for it");
        board.decide();
        flash
    };
    let whole = {
        let flash = prepared();
        let before = flash.used();
        let mut board = Board::start(&flash);
        board.update(&new).expect("room for it");
        board.decide();
        flash.used() - before
    };
    assert!(whole > 4000, "an erasure and a policy: {whole}");
    let mut draw = Generator::new(5);
    // Every byte of the marks and of the policy's begin and end, and random ones of the rest.
    let erasure = FLASH as u64 / 2;
    let cuts = (0..200)
        .map(|_| draw.bits() % whole)
        .chain(erasure - 20..=erasure + 20)
        .chain(whole - 120..=whole);
    let mut seen = [0, 0];
    // A byte that is being changed when the power goes may read as anything: as before, as wanted, or as neither.
    let torn = [0xff, 0x5a, 0x00, 0x31];
    for (cut, torn) in cuts.zip(torn.into_iter().cycle()) {
        let flash = prepared();
        let mut board = Board::start(&flash);
        flash.tear(torn);
        flash.cut_after(cut);
        // Most cuts come before the end, which is the firmware's to notice and not of interest here.
        let _ = board.update(&new);
        // Even without power for the flash the board in operation decides.
        board.decide();
        flash.cut_after(u64::MAX);
        let mut board = Board::start(&flash);
        board.decide();
        let running = board.identity().provenance;
        let is_new = running == provenance(&new);
        assert!(
            is_new || running == provenance(&old),
            "cut after {cut}: {running:?}"
        );
        // Only a mark that is whole confirms, if by its last byte's being torn the right way.
        let confirmed = cut == whole || (cut + 1 == whole && torn == 0x5a);
        assert_eq!(is_new, confirmed, "cut after {cut}");
        seen[usize::from(is_new)] += 1;
        // And it can be updated once more.
        board
            .update(&new)
            .unwrap_or_else(|e| panic!("cut after {cut}: {e:?}"));
        board.decide();
        assert_eq!(Board::start(&flash).identity().provenance, provenance(&new));
    }
    assert!(seen[0] > 50 && seen[1] >= 1, "{seen:?}");
}

#[test]
fn a_power_cut_during_the_next_start_leaves_a_working_policy_too() {
    let [old, new, _] = policies();
    for cut in 0..64 {
        let flash = SimFlash::new(FLASH);
        let mut board = Board::start(&flash);
        board.update(&old).expect("room for it");
        board.decide();
        board.update(&new).expect("room for it");
        flash.cut_after(cut);
        board.decide();
        flash.cut_after(u64::MAX);
        for _ in 0..3 {
            let mut board = Board::start(&flash);
            board.decide();
            let running = board.identity().provenance;
            // The mark takes 16 bytes: only when it is whole has the new policy decided.
            let expected = if cut < 16 { &old } else { &new };
            assert_eq!(running, provenance(expected), "cut after {cut}");
        }
    }
}

#[test]
fn what_is_wrong_is_refused_and_changes_nothing() {
    let [old, new, _] = policies();
    let flash = SimFlash::new(FLASH);
    let mut board = Board::start(&flash);
    assert_eq!(board.step(Request::Commit), Err((Refusal::Order, 0)));
    let room = FLASH as u32 / 2 - 32;
    let too_long = Request::Begin { bytes: room + 1 };
    assert_eq!(board.step(too_long), Err((Refusal::Room, room)));
    board.update(&old).expect("room for it");
    assert_eq!(
        board.update(&new),
        Err((Refusal::Untried, 0)),
        "the older one must stay until this one has decided"
    );
    board.decide();
    let mut damaged = new.clone();
    damaged[100] ^= 1;
    assert!(matches!(board.update(&damaged), Err((Refusal::Policy, _))));
    let other = fs::read(golden::path("champions/cartpole-sr-sm-b23.tpg")).expect("a champion");
    assert!(matches!(board.update(&other), Err((Refusal::Capacity, _))));
    board
        .step(Request::Begin { bytes: 100 })
        .expect("room for it");
    let skipped = Request::Store {
        at: 64,
        bytes: &new[64..100],
    };
    assert_eq!(board.step(skipped), Err((Refusal::Order, 0)));
    board.decide();
    assert_eq!(board.identity().provenance, provenance(&old));
    assert_eq!(Board::start(&flash).identity().provenance, provenance(&old));
    // Without flash there are no updates, but the policy built in decides.
    assert_eq!(Slots::open(SimFlash::new(FLASH), |_| true).number(), 0);
}
