//! What comes over a serial line, and a board whose power may be cut at any time.

use tpg_board::serial::{Rules, Session};
use tpg_board::sim::SimFlash;
use tpg_runtime::wire::{self, Answer, Frame, Receiver, Request, contract_of};
use tpg_runtime::{Agent, Fixed, Policy};
use tpg_test_policies::old_format::mend;

use super::BUILT_IN;

const FRAME: usize = 1024;
const FLASH: usize = 2048;

type Roomy = Agent<'static, Fixed<11>, 4096, 64, 16, 48>;

/// Any bytes on the line, and as an undamaged frame. What is understood is the same when it is written again.
///
/// # Panics
/// If a promise is broken.
pub fn wire(data: &[u8]) {
    let mut requests = Receiver::<FRAME>::new();
    let mut answers = Receiver::<FRAME>::new();
    for byte in data.iter().copied().chain(framed(data)) {
        if let Some(frame) = requests.push::<Request<'_>>(byte) {
            let (mut buffer, mut again) = ([0; FRAME + 64], Receiver::<FRAME>::new());
            let length = wire::write(&frame, &mut buffer).expect("as long as it came");
            let mut read = buffer[..length].iter();
            let found = read.any(|byte| again.push::<Request<'_>>(*byte) == Some(frame));
            assert!(found, "{frame:?}");
        }
        if let Some(frame) = answers.push::<Answer<'_>>(byte) {
            let (mut buffer, mut again) = ([0; FRAME + 64], Receiver::<FRAME>::new());
            let length = wire::write(&frame, &mut buffer).expect("as long as it came");
            let mut read = buffer[..length].iter();
            let found = read.any(|byte| again.push::<Answer<'_>>(*byte) == Some(frame));
            assert!(found, "{frame:?}");
        }
    }
}

/// The message as an undamaged frame: with its checksum, in COBS, between zeros.
fn framed(message: &[u8]) -> Vec<u8> {
    let mut sealed = message.to_vec();
    sealed.extend(wire::checksum(message).to_le_bytes());
    let mut frame = vec![0];
    let mut encoded = vec![0; cobs::max_encoding_length(sealed.len())];
    let length = cobs::encode(&sealed, &mut encoded);
    frame.extend(&encoded[..length]);
    frame.push(0);
    frame
}

/// A board that starts again and again with the same flash.
struct Board {
    flash: SimFlash,
    agent: Box<Roomy>,
    session: Session<SimFlash>,
    seq: u32,
}

impl Board {
    fn start(flash: SimFlash) -> Self {
        let policy = Policy::load(BUILT_IN).expect("valid");
        let mut agent = Box::new(Roomy::new(policy).expect("fits"));
        let session = Session::start(BUILT_IN, Some(flash.clone()), &mut agent, Rules::DEFAULT);
        Board {
            flash,
            agent,
            session: session.expect("what was stored has passed"),
            seq: 0,
        }
    }

    fn send(&mut self, message: Request<'_>) -> bool {
        self.seq += 1;
        let frame = Frame {
            seq: self.seq,
            message,
        };
        let mut buffer = [0; FRAME];
        let Ok(length) = wire::write(&frame, &mut buffer) else {
            return false;
        };
        let mut receiver = Receiver::<FRAME>::new();
        let mut decided = false;
        for byte in &buffer[..length] {
            for answer in self.session.take(&mut self.agent, *byte) {
                if let Some(frame) = receiver.push::<Answer<'_>>(*answer) {
                    decided = matches!(frame.message, Answer::Values { .. });
                }
            }
        }
        decided
    }

    /// A board must decide after each start, whatever its flash holds.
    fn assert_decides(&mut self) {
        assert!(self.send(Request::Hello) || self.send(Request::Observe { values: &[0; 44] }));
    }
}

/// A script of events at a board: bytes on the line, requests, power cuts, starts. After each start it decides.
///
/// # Panics
/// If a promise is broken.
pub fn session(data: &[u8]) {
    let mut board = Board::start(SimFlash::new(FLASH));
    let mut files = [1, 2, 3].map(|mark| {
        let mut file = BUILT_IN.to_vec();
        file[56] = mark;
        mend(&mut file);
        file
    });
    let mut rest = data;
    // A flash's contents are leaked at each start, so scripts are short.
    for _ in 0..24 {
        let Some((&event, more)) = rest.split_first() else {
            break;
        };
        let Some((&argument, more)) = more.split_first() else {
            break;
        };
        rest = more;
        let file = &mut files[usize::from(argument) % 3];
        match event % 10 {
            0 => {
                let (bytes, more) = rest.split_at(rest.len().min(usize::from(argument)));
                rest = more;
                for byte in bytes.iter().copied().chain(framed(bytes)) {
                    let _ = board.session.take(&mut board.agent, byte);
                }
            }
            1 => {
                let begin = Request::Begin {
                    bytes: file.len() as u32,
                    contract: contract_of(file),
                    release: 0,
                    forced: argument & 0x80 != 0,
                };
                board.send(begin);
                for (k, bytes) in file.chunks(64).enumerate() {
                    let at = 64 * k as u32;
                    board.send(Request::Store { at, bytes });
                }
            }
            2 => {
                board.send(Request::Commit);
            }
            3 => {
                let _ = board.session.confirm();
            }
            4 => {
                board.send(Request::Revert);
            }
            5 => {
                let number = argument % 4;
                board.send(Request::Erase { number });
            }
            6 => {
                let at = usize::from(argument) * 4;
                if let Some(byte) = file.get_mut(at) {
                    *byte ^= 1;
                }
                if argument & 1 == 0 {
                    mend(file);
                }
            }
            7 => {
                board.flash.tear(argument);
                board.flash.cut_after(u64::from(argument) * 11);
            }
            8 => {
                board.flash.cut_after(u64::MAX);
                board = Board::start(board.flash.clone());
                board.assert_decides();
            }
            _ => {
                board.send(Request::Observe {
                    values: &[argument; 44],
                });
            }
        }
    }
    board.flash.cut_after(u64::MAX);
    Board::start(board.flash.clone()).assert_decides();
}
