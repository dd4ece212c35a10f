//! The bytes of the open protocol: the code, docs/wire.md, docs/bridge-protocol.md and the Python example say the same.

use std::fmt::Write as _;
use std::mem::{offset_of, size_of};
use std::process::Command;

use serde::Serialize;
use tpg_runtime::Policy;
use tpg_runtime::wire::{
    self, Answer, Frame, Identity, OVERHEAD, PROTOCOL, Receiver, Refusal, Request, Signed,
    SlotState, Stored,
};
use tpg_sim_bridge::message::{
    ActionMessage, LAYOUT_HASH, MAX_ACTION, MAX_OBSERVATION, Message, ObservationMessage,
    Refusal as Refused, Request as Asked, Response,
};
use tpg_tests::{firmware, golden};

const OBSERVATION: [f32; 3] = [1.0, -2.5, f32::NAN];
const ACTION: [f32; 2] = [0.25, -1.0];
const SEED: u64 = 0x0123_4567_89ab_cdef;

fn bytes_of(values: &[f32]) -> Vec<u8> {
    values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect()
}

fn requests(values: &[u8]) -> Vec<(&'static str, u32, Request<'_>)> {
    vec![
        ("hello", 1, Request::Hello),
        (
            "reset-agent",
            2,
            Request::Reset {
                agent: true,
                seed: SEED,
            },
        ),
        (
            "reset-episode",
            300,
            Request::Reset {
                agent: false,
                seed: 7,
            },
        ),
        ("observe", 301, Request::Observe { values }),
        (
            "begin",
            4_000_000_000,
            Request::Begin {
                bytes: 6400,
                contract: SEED,
                release: 3,
                forced: true,
            },
        ),
        (
            "store",
            5,
            Request::Store {
                at: 256,
                bytes: &[0, 1, 2, 0],
            },
        ),
        ("commit", 6, Request::Commit),
        ("slot", 7, Request::Slot { number: 2 }),
        ("revert", 8, Request::Revert),
        ("contract", 9, Request::Contract { at: 128 }),
        ("erase", 10, Request::Erase { number: 1 }),
    ]
}

fn answers(values: &[u8]) -> Vec<(&'static str, u32, Answer<'_>)> {
    let file = std::fs::read(golden::path("v1/zero.tpg")).expect("a golden policy");
    let policy = Policy::load(&file).expect("valid");
    let mut identity = Identity::new(&policy, &file);
    identity.protocol = PROTOCOL;
    identity.format = 3;
    identity.instruction_set = 0xdead_beef;
    identity.policy_bytes = 6400;
    identity.policy_crc = 0x1234_5678;
    identity.provenance = std::array::from_fn(|k| k as u8);
    identity.slot = 1;
    identity.damaged = 5;
    let mut stored = Stored::new(2, SlotState::Unconfirmed, true, &file);
    stored.bytes = 6400;
    stored.crc = 0x1234_5678;
    stored.format = 3;
    stored.contract = SEED;
    stored.release = 3;
    stored.signed = Signed::Verified;
    let refused = Answer::Refused {
        refusal: Refusal::Length,
        detail: 12,
    };
    vec![
        ("identity", 1, Answer::Identity(identity)),
        ("ready", 2, Answer::Ready),
        (
            "index",
            301,
            Answer::Index {
                index: 1,
                instructions: 230,
            },
        ),
        (
            "values",
            301,
            Answer::Values {
                values,
                instructions: 230,
            },
        ),
        ("refused", 301, refused),
        ("stored", 7, Answer::Slot(stored)),
        (
            "contract-part",
            9,
            Answer::Contract {
                total: 130,
                bytes: b"m\n",
            },
        ),
    ]
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// The bytes of a frame.
fn written<M: Serialize>(seq: u32, message: M) -> Vec<u8> {
    let mut buffer = [0; 256 + OVERHEAD];
    let len = wire::write(&Frame { seq, message }, &mut buffer).expect("it fits");
    buffer[..len].to_vec()
}

/// Checks that the bytes of a frame read back as what it was, and shows them.
macro_rules! frame {
    ($seq:expr, $message:expr, $type:ty) => {{
        let bytes = written($seq, $message);
        let mut receiver = Receiver::<512>::new();
        let (last, first) = bytes.split_last().expect("bytes");
        for byte in first {
            assert!(receiver.push::<$type>(*byte).is_none());
        }
        let read = receiver.push::<$type>(*last).expect("a frame");
        assert_eq!((read.seq, read.message), ($seq, $message));
        hex(&bytes)
    }};
}

fn frames() -> String {
    let mut text = String::new();
    let (observation, action) = (bytes_of(&OBSERVATION), bytes_of(&ACTION));
    for (name, seq, request) in requests(&observation) {
        let _ = writeln!(text, "request {name} {}", frame!(seq, request, Request<'_>));
    }
    for (name, seq, answer) in answers(&action) {
        let _ = writeln!(text, "answer {name} {}", frame!(seq, answer, Answer<'_>));
    }
    text
}

fn document(name: &str) -> String {
    let path = firmware::repository().join("docs").join(name);
    std::fs::read_to_string(path).expect("a document")
}

#[test]
fn frames_have_the_golden_bytes_and_the_document_shows_them() {
    let computed = frames();
    golden::assert_text("wire/frames.txt", &computed);
    let document = document("wire.md");
    for line in computed.lines() {
        assert!(document.contains(line), "docs/wire.md lacks: {line}");
    }
    assert!(document.contains(&format!("protocol version is {PROTOCOL}")));
}

#[test]
fn the_python_example_writes_and_reads_the_golden_bytes() {
    let script = r#"
import math, sys
import wire
frames = dict((line.split()[0] + " " + line.split()[1], bytes.fromhex(line.split()[2])) for line in sys.stdin)
requests = {
    "hello": (1, "hello", {}),
    "reset-agent": (2, "reset", {"agent": True, "seed": 0x0123456789abcdef}),
    "reset-episode": (300, "reset", {"agent": False, "seed": 7}),
    "observe": (301, "observe", {"values": (1.0, -2.5, math.nan)}),
}
for name, (number, kind, fields) in requests.items():
    frame = frames["request " + name]
    assert wire.request(number, kind, **fields) == frame, name
    read = wire.read_request(wire.unseal(frame[1:-1]))
    assert repr(read) == repr((number, kind, fields)), (read, name)
answers = {
    "ready": (2, "ready", {}),
    "index": (301, "index", {"index": 1, "instructions": 230}),
    "values": (301, "values", {"values": (0.25, -1.0), "instructions": 230}),
    "refused": (301, "refused", {"reason": 0, "detail": 12}),
}
for name, (number, kind, fields) in answers.items():
    frame = frames["answer " + name]
    assert wire.answer(number, kind, **fields) == frame, name
    assert wire.read_answer(wire.unseal(frame[1:-1])) == (number, kind, fields), name
identity = wire.read_answer(wire.unseal(frames["answer identity"][1:-1]))[2]
assert (identity["protocol"], identity["policy_bytes"]) == (2, 6400), identity
for frame in frames.values():
    coded = frame[1:-1]
    for at in range(len(coded)):
        for bit in range(8):
            damaged = coded[:at] + bytes([coded[at] ^ 1 << bit]) + coded[at + 1:]
            assert wire.unseal(damaged) is None, (at, bit)
print(len(frames), "frames")
"#;
    let mut python = Command::new("python3");
    python.args(["-B", "-c", script]);
    python.current_dir(firmware::repository().join("docs/examples/peers"));
    let said = tpg_tests::process::pipe(python, &frames());
    assert_eq!(said.trim(), "18 frames");
}

/// Name, type, place and size of each field of a message in shared memory.
macro_rules! rows {
    ($text:ident, $message:ident, $($field:ident: $type:ty),+ $(,)?) => {
        let _ = writeln!($text, "{} {} bytes", $message::TOPIC, size_of::<$message>());
        $(
            let _: &$type = &$message::empty().$field;
            let place = offset_of!($message, $field);
            let _ = writeln!($text, "{place} {} {}", stringify!($field), size_of::<$type>());
        )+
    };
}

#[test]
fn messages_in_shared_memory_have_the_golden_places_and_the_document_shows_them() {
    let mut text = String::new();
    rows!(text, ObservationMessage, seq: u64, agent_seed: u64, time_us: u64, kind: u32, len: u32, values: [f32; MAX_OBSERVATION]);
    rows!(text, ActionMessage, seq: u64, kind: u32, refusal: u32, detail: u32, instructions: u32, index: u32, len: u32, values: [f32; MAX_ACTION]);
    for code in 1..8 {
        let words = [
            Asked::from_code(code).map(|kind| format!("request {kind:?}")),
            Response::from_code(code).map(|kind| format!("response {kind:?}")),
            Refused::from_code(code).map(|kind| format!("refusal {kind:?}")),
        ];
        for word in words.into_iter().flatten() {
            let _ = writeln!(text, "{word} {code}");
        }
    }
    let _ = writeln!(text, "layout {LAYOUT_HASH:016x}");
    golden::assert_text("wire/shared-memory.txt", &text);
    let document = document("bridge-protocol.md");
    for line in text.lines() {
        assert!(
            document.contains(line),
            "docs/bridge-protocol.md lacks: {line}"
        );
    }
}
