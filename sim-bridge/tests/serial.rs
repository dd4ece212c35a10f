//! A board at the other end of a serial line: the firmware's own code, behind a line that loses and garbles bytes.

#![cfg(feature = "plant")]

mod support;

use std::fs;
use std::io::{Read, Write};
use std::net::Shutdown;
use std::ops::Range;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use serialport::{SerialPort, TTYPort};
use support::{Folder, Process, WATCHDOG, policy};
use tpg_board::serial::{Rules, Session};
use tpg_board::sim::SimFlash;
use tpg_board::trial::Generator;
use tpg_runtime::wire::{self, Answer, Frame, Receiver, Request, SlotState};
use tpg_runtime::{Agent, HostAgent, Policy, Reset, State, Width};
use tpg_sim_bridge::RemoteController;
use tpg_sim_bridge::serial::{SerialPath, Updater};
use tpg_tasks::eval::Controller as _;

/// What happens to bytes on a line.
#[derive(Debug, Clone, Copy)]
struct Faults {
    /// One in so many bytes is changed; 0 for none.
    garbled: u64,
    /// One in so many bytes is lost; 0 for none.
    lost: u64,
}

const CLEAN: Faults = Faults {
    garbled: 0,
    lost: 0,
};

impl Faults {
    /// Hands on what survives.
    fn pass(self, noise: &mut Generator, bytes: &[u8]) -> Vec<u8> {
        let strikes =
            |noise: &mut Generator, one_in: u64| one_in > 0 && noise.bits().is_multiple_of(one_in);
        let mut passed = Vec::new();
        for byte in bytes {
            if strikes(noise, self.lost) {
                continue;
            }
            let garbled = strikes(noise, self.garbled);
            passed.push(byte ^ if garbled { 1 << (noise.bits() % 8) } else { 0 });
        }
        passed
    }
}

type Roomy<W> = Agent<'static, W, State<4096, 64, 16, 48>>;

/// A board that answers on one line after another until each closes; `most` frames at most.
fn run_board<W: Width>(
    file: &'static [u8],
    lines: impl Iterator<Item = impl Read + Write>,
    faults: Faults,
    most: u32,
) {
    let policy = Policy::load(file).expect("a valid policy");
    let mut agent = Box::new(Roomy::<W>::new(policy).expect("it fits"));
    let flash = SimFlash::new(8192);
    let mut session =
        Session::start(file, Some(flash), &mut agent, Rules::DEFAULT).expect("it fits");
    let mut noise = Generator::new(7);
    let (mut buffer, mut sent) = ([0; 64], 0);
    for mut line in lines {
        while let Ok(len @ 1..) = line.read(&mut buffer) {
            for byte in faults.pass(&mut noise, &buffer[..len]) {
                let answer = session.take(&mut agent, byte).to_vec();
                if answer.is_empty() {
                    continue;
                }
                sent += 1;
                if sent > most {
                    return;
                }
                // A host that has left is noticed when the line is read.
                let _ = line.write_all(&faults.pass(&mut noise, &answer));
            }
        }
    }
}

/// A board behind a Unix socket, as an emulator's; it takes one conversation after another.
struct Board {
    place: SerialPath,
    path: PathBuf,
    _thread: JoinHandle<()>,
}

fn board(folder: &Path, file: Vec<u8>, faults: Faults, most: u32) -> Board {
    let path = folder.join("board.sock");
    let listener = UnixListener::bind(&path).expect("a socket");
    let file: &'static [u8] = file.leak();
    let thread = thread::spawn(move || {
        let lines = listener.incoming().map_while(Result::ok);
        match Policy::load(file).expect("valid").header().width {
            1 => run_board::<tpg_runtime::Fixed<1>>(file, lines, faults, most),
            _ => run_board::<tpg_runtime::Fixed<3>>(file, lines, faults, most),
        }
    });
    Board {
        place: format!("serial:{}", path.display())
            .parse()
            .expect("a path"),
        path,
        _thread: thread,
    }
}

fn connect(file: &[u8], place: &SerialPath, timeout: Duration) -> Result<RemoteController, String> {
    let policy = Policy::load(file).expect("valid");
    RemoteController::connect_serial(&policy, file, place, timeout).map_err(|e| e.to_string())
}

/// Compares so many decisions of a remote controller with those of an agent here.
fn assert_same_decisions(remote: &mut RemoteController, file: &[u8], decisions: Range<u32>) {
    let mut local = Box::new(HostAgent::new(Policy::load(file).expect("valid")).expect("fits"));
    local.reset(Reset::Agent, 5);
    remote.reset(Reset::Agent, 5).expect("the board answers");
    let mut generator = Generator::new(3);
    let mut observation = vec![0.0; usize::from(local.policy().header().observation_len)];
    for _ in decisions {
        generator.observe(&mut observation);
        let expected = local.decide(&observation).expect("the right length");
        let got = remote.decide(&observation).expect("the board answers");
        assert_eq!(got.action, expected.action);
        assert_eq!(got.instructions, expected.instructions);
    }
}

/// Single missing elements, whole missing observations and infinities, with each kind of front end.
#[test]
fn missing_values_cross_the_line() {
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["standardised", "held", "believed", "believed-cubic"] {
        let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/golden/v3");
        let file = fs::read(golden.join(name).with_extension("tpg")).expect("a golden file");
        let place = folder.path().join(name);
        fs::create_dir(&place).expect("a folder");
        let board = board(&place, file.clone(), CLEAN, u32::MAX);
        let mut remote = connect(&file, &board.place, WATCHDOG).expect("a board");
        assert_same_decisions(&mut remote, &file, 0..500);
        remote.reset(Reset::Agent, 8).expect("the board answers");
        let mut local =
            Box::new(HostAgent::new(Policy::load(&file).expect("valid")).expect("fits"));
        local.reset(Reset::Agent, 8);
        for step in 0..40u16 {
            let seen = [0.25, -0.5, 1.5, 0.75].map(|x| x * f32::from(step % 7));
            let mut observation = seen;
            observation[usize::from(step % 4)] = f32::NAN;
            let got = remote.decide(&observation).expect("the board answers");
            let decision = local.decide(&observation).expect("four elements");
            assert_eq!(got.action, decision.action, "{name}, step {step}");
            assert_eq!(
                got.instructions, decision.instructions,
                "{name}, step {step}"
            );
        }
    }
}

#[test]
fn a_clean_line_loses_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = policy::hopper();
    let board = board(folder.path(), file.clone(), CLEAN, u32::MAX);
    let mut remote = connect(&file, &board.place, WATCHDOG).expect("a board");
    assert_same_decisions(&mut remote, &file, 0..300);
    let (latency, losses) = remote.finish().expect("it ends");
    assert_eq!(latency.count, 300);
    let losses = losses.expect("a serial line");
    assert_eq!(losses.damaged_here, 0);
}

#[test]
fn a_bad_line_costs_time_but_no_bit_and_no_decision_twice() {
    let folder = tempfile::tempdir().expect("a folder");
    // This policy's memory would show a decision that was made twice.
    let file = policy::cartpole(1);
    let faults = Faults {
        garbled: 200,
        lost: 300,
    };
    let board = board(folder.path(), file.clone(), faults, u32::MAX);
    let mut remote = connect(&file, &board.place, WATCHDOG).expect("a board");
    assert_same_decisions(&mut remote, &file, 0..100);
    let losses = remote.finish().expect("it ends").1.expect("a serial line");
    assert!(losses.resent > 10, "{losses:?}");
    assert!(losses.damaged_here > 0, "{losses:?}");
}

#[test]
fn another_policy_is_named_with_both_identities() {
    let folder = tempfile::tempdir().expect("a folder");
    let board = board(folder.path(), policy::cartpole(1), CLEAN, u32::MAX);
    let error = connect(&policy::cartpole(2), &board.place, WATCHDOG).expect_err("another one");
    for text in ["does not match", "0101", "0202", "tpg update"] {
        assert!(error.contains(text), "{error}");
    }
}

#[test]
fn a_board_that_stops_answering_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = policy::hopper();
    let path = folder.path().join("mute.sock");
    let _listener = UnixListener::bind(&path).expect("a socket");
    let place = format!("serial:{}", path.display())
        .parse()
        .expect("a path");
    let error = connect(&file, &place, Duration::from_millis(600)).expect_err("silence");
    assert!(error.contains("has not answered"), "{error}");
    // One that goes away in the middle.
    let board = board(folder.path(), file.clone(), CLEAN, 20);
    let mut remote = connect(&file, &board.place, WATCHDOG).expect("a board");
    remote.reset(Reset::Agent, 1).expect("still there");
    let error = (0..30).find_map(|_| remote.decide(&[0.0; 11]).err());
    let error = error.expect("it went away").to_string();
    assert!(error.contains("is gone: unplugged"), "{error}");
}

#[test]
fn garbage_is_counted_and_never_acted_on() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("noise.sock");
    let listener = UnixListener::bind(&path).expect("a socket");
    thread::spawn(move || {
        let mut line: UnixStream = listener.accept().expect("a host").0;
        let mut noise = Generator::new(1);
        let mut bytes = || noise.bits().to_le_bytes();
        while line.write_all(&bytes()).is_ok() {
            thread::sleep(Duration::from_micros(100));
        }
    });
    let place = format!("serial:{}", path.display())
        .parse()
        .expect("a path");
    let error = connect(&policy::hopper(), &place, Duration::from_secs(1)).expect_err("noise");
    assert!(error.contains("damaged frames came"), "{error}");
    assert!(!error.contains(" 0 damaged"), "{error}");
}

/// A board that sends without end and without a zero byte, so that no frame ever ends.
#[test]
fn a_flood_does_not_stretch_the_timeout() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("flood.sock");
    let listener = UnixListener::bind(&path).expect("a socket");
    thread::spawn(move || {
        let mut line: UnixStream = listener.accept().expect("a host").0;
        while line.write_all(&[0x55; 65_536]).is_ok() {}
    });
    let place = format!("serial:{}", path.display())
        .parse()
        .expect("a path");
    let start = Instant::now();
    let error = connect(&policy::hopper(), &place, Duration::from_millis(1200));
    let error = error.expect_err("no answer");
    let waited = error
        .split("answered for ")
        .nth(1)
        .and_then(|rest| rest.split(' ').next());
    let waited: u64 = waited.expect("a time").parse().expect("a number");
    // The error's own time leaves out what the machine takes to end; both stay far below what a flood once took.
    assert!((1200..1700).contains(&waited), "{error}");
    assert!(
        start.elapsed() < Duration::from_millis(2500),
        "{:?}",
        start.elapsed()
    );
}

/// What a board says to a request of a number, by name.
fn ask(
    session: &mut Session<SimFlash>,
    agent: &mut Roomy<tpg_runtime::Fixed<1>>,
    seq: u32,
    message: Request<'_>,
) -> Option<(u32, String)> {
    let mut frame = [0; 256];
    let len = wire::write(&Frame { seq, message }, &mut frame).expect("it fits");
    let mut answered = None;
    let mut receiver = Receiver::<1024>::new();
    for byte in &frame[..len] {
        for byte in session.take(agent, *byte).to_vec() {
            if let Some(frame) = receiver.push::<Answer<'_>>(byte) {
                answered = Some((frame.seq, format!("{:?}", frame.message)));
            }
        }
    }
    answered
}

#[test]
fn no_number_makes_a_board_deaf() {
    let file: &'static [u8] = policy::cartpole(1).leak();
    let policy = Policy::load(file).expect("valid");
    let mut agent = Box::new(Roomy::new(policy).expect("it fits"));
    let flash = Some(SimFlash::new(8192));
    let mut session = Session::start(file, flash, &mut agent, Rules::DEFAULT).expect("it fits");
    let mut reset = |seq| {
        let request = Request::Reset {
            agent: true,
            seed: 1,
        };
        ask(&mut session, &mut agent, seq, request)
    };
    let ready = |seq| Some((seq, "Ready".to_string()));
    assert_eq!(reset(100), ready(100));
    assert_eq!(reset(u32::MAX), ready(u32::MAX));
    // The conversation goes on, as does one whose numbers begin again.
    assert_eq!(reset(1000), ready(1000));
    for seq in [u32::MAX - 1, u32::MAX, 0, 1, 2] {
        assert_eq!(reset(seq), ready(seq), "{seq}");
    }
    // The last request is answered again, an older one is a late duplicate.
    assert_eq!(reset(2), ready(2));
    assert_eq!(reset(1), None);
    assert_eq!(reset(3), ready(3));
}

/// The far end of a pseudo-terminal. It cannot be read before the near end is open.
struct Patient(TTYPort);

impl Read for Patient {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        loop {
            if let Ok(len) = self.0.read(buffer) {
                return Ok(len);
            }
            thread::sleep(Duration::from_millis(5));
        }
    }
}

impl Write for Patient {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.0.flush()
    }
}

#[test]
fn a_tty_serves_as_well() {
    let (mut far, near) = TTYPort::pair().expect("a pseudo-terminal");
    far.set_timeout(WATCHDOG).expect("a timeout");
    let place: SerialPath = format!("serial:{}", near.name().expect("a name"))
        .parse()
        .expect("a path");
    // Only one may have it open.
    drop(near);
    let file = policy::hopper();
    let bytes: &'static [u8] = file.clone().leak();
    thread::spawn(move || {
        run_board::<tpg_runtime::Fixed<3>>(bytes, std::iter::once(Patient(far)), CLEAN, u32::MAX);
    });
    // A process that another test is just starting has the near end open too, until it becomes its program.
    let remote = (0..100).find_map(|_| match connect(&file, &place, WATCHDOG) {
        Err(error) if error.contains("cannot open") => {
            thread::sleep(Duration::from_millis(20));
            None
        }
        connected => Some(connected),
    });
    let mut remote = remote.expect("a line").expect("a board");
    assert_same_decisions(&mut remote, &file, 0..100);
}

#[test]
fn an_update_over_a_bad_line_changes_over() {
    let folder = tempfile::tempdir().expect("a folder");
    let faults = Faults {
        garbled: 400,
        lost: 400,
    };
    let board = board(folder.path(), policy::cartpole(1), faults, u32::MAX);
    let file = policy::cartpole(2);
    let new = Policy::load(&file).expect("valid");
    let updater = || Updater::connect(&board.place, WATCHDOG).expect("a board");
    let updated = updater()
        .update(&new, &file, false)
        .expect("it changes over");
    assert_eq!((updated.before.slot, updated.after.slot), (0, 1));
    assert_eq!(updated.after.provenance, [2; 16]);
    assert!(!updated.confirmed);
    let states = |listed: tpg_sim_bridge::serial::Listed| {
        let states = listed.0.iter().map(|slot| (slot.state, slot.in_use));
        states.collect::<Vec<_>>()
    };
    assert_eq!(
        states(updater().list().expect("slots")),
        [
            (SlotState::Confirmed, false),
            (SlotState::Unconfirmed, true),
            (SlotState::Empty, false)
        ]
    );
    let reverted = updater().revert().expect("a policy before it");
    assert_eq!((reverted.before.slot, reverted.after.slot), (1, 0));
    assert!(reverted.confirmed);
    let error = updater().revert().expect_err("none before it").to_string();
    assert!(error.contains("none comes before that"), "{error}");
    updater()
        .update(&new, &file, false)
        .expect("it changes over");
    let erased = updater().erase().expect("erased");
    assert_eq!(erased.after.slot, 0);
}

#[test]
fn the_command_compares_forces_lists_reverts_and_erases() {
    let folder = Folder::new();
    let file = folder.file("new.tpg", &policy::cartpole(2));
    let slow = folder.file("slow.tpg", &policy::cartpole_every(3, 50_000));
    let hopper = folder.file("hopper.tpg", &policy::hopper());
    let [slow, hopper] = [&slow, &hopper].map(|path| path.to_str().expect("text"));
    let place = tempfile::tempdir().expect("a folder");
    let board = board(place.path(), policy::cartpole(1), CLEAN, u32::MAX);
    let controller = format!("serial:{}", board.path.display());
    let update = |arguments: &[&str]| {
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_tpg-update"))
            .args(arguments)
            .args(["--controller", &controller])
            .output()
            .expect("the program is built");
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
        (
            output.status.code(),
            text(output.stdout) + &text(output.stderr),
        )
    };
    let file = file.to_str().expect("text");
    let shown = [
        (
            &[file][..],
            Some(0),
            "the board reverts it at its next start",
        ),
        (&["--list"], Some(0), "not confirmed yet, in use"),
        (
            &[slow],
            Some(4),
            "control period is 20 ms on the board, 50 ms in the new policy; nothing was written",
        ),
        (
            &[hopper],
            Some(4),
            "observation has 4 values on the board, 11 values in the new policy",
        ),
        (&["--list"], Some(0), "not confirmed yet, in use"),
        (
            &[slow, "--force"],
            Some(0),
            "forced: control period is 20 ms on the board, 50 ms in the new policy",
        ),
        (&["--revert"], Some(0), "in slot 0"),
        (&[slow, "--force"], Some(0), "in slot 1"),
        (&[file], Some(0), "in slot 1"),
        (&["--list", "--json"], Some(0), "\"state\":\"unconfirmed\""),
        (&["--revert"], Some(0), "in slot 0"),
        (&["--revert"], Some(4), "none comes before that"),
        (&["--list"], Some(0), "slot 1: empty"),
        (&["--erase"], Some(0), "in slot 0"),
        (&["--erase", "--list"], Some(2), "cannot be used with"),
        (&[file, "--list"], Some(2), "cannot be used with"),
        (&[], Some(2), "required"),
    ];
    for (arguments, status, text) in shown {
        let (code, said) = update(arguments);
        assert_eq!(code, status, "{arguments:?}: {said}");
        assert!(said.contains(text), "{arguments:?}: {said}");
    }
}

/// A policy of version 3 with a front end, on a board with the same one of version 2, and the other way round.
#[test]
fn an_update_says_when_the_firmware_must_begin_to_send_nan() {
    let golden = |version: u32| {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/golden");
        folder.join(format!("v{version}/held.tpg"))
    };
    for (there, here, told) in [(2, 3, true), (3, 3, false), (3, 2, false)] {
        let place = tempfile::tempdir().expect("a folder");
        let built_in = fs::read(golden(there)).expect("a golden policy");
        let board = board(place.path(), built_in, CLEAN, u32::MAX);
        let controller = format!("serial:{}", board.path.display());
        let update = env!("CARGO_BIN_EXE_tpg-update");
        let end = Process::start(update, &golden(here), &["--controller", &controller]).end();
        assert_eq!(end.status.code(), Some(0), "{end:?}");
        assert_eq!(end.stderr.contains("must send NaN"), told, "{end:?}");
    }
}

#[test]
fn commands_score_on_a_board_and_end_with_the_right_status() {
    let folder = Folder::new();
    let bytes = policy::cartpole(1);
    let file = folder.file("cartpole.tpg", &bytes);
    let place = tempfile::tempdir().expect("a folder");
    let board = board(place.path(), bytes, CLEAN, u32::MAX);
    let controller = format!("serial:{}", board.path.display());
    let hil = env!("CARGO_BIN_EXE_tpg-hil");
    let arguments = ["--controller", &controller, "--episodes", "3", "--json"];
    let end = Process::start(hil, &file, &arguments).end();
    assert_eq!(end.status.code(), Some(0), "{end:?}");
    let report: serde_json::Value = serde_json::from_str(&end.stdout).expect("JSON");
    assert_eq!(report["returns"].as_array().map(Vec::len), Some(3));
    assert_eq!(report["serial"]["damaged_here"], 0);
    let missing = ["--controller", "serial:/dev/no-such-tty"];
    let end = Process::start(hil, &file, &missing).end();
    end.assert_failure(4, &["cannot open /dev/no-such-tty"]);
    let end = Process::start(hil, &file, &["--controller", "/dev/ttyACM0"]).end();
    end.assert_failure(2, &["use serial:PATH"]);
    let update = env!("CARGO_BIN_EXE_tpg-update");
    let end = Process::start(update, &file, &missing).end();
    end.assert_failure(4, &["cannot open /dev/no-such-tty"]);
}

#[test]
fn a_board_that_goes_away_while_it_is_written_to_is_a_failure() {
    let folder = Folder::new();
    let file = folder.file("cartpole.tpg", &policy::cartpole(1));
    let place = tempfile::tempdir().expect("a folder");
    let path = place.path().join("deaf.sock");
    let listener = UnixListener::bind(&path).expect("a socket");
    let deaf = thread::spawn(move || {
        let line = listener.accept().expect("a host").0;
        line.shutdown(Shutdown::Read).expect("an open line");
        line
    });
    let controller = format!("serial:{}", path.display());
    let hil = env!("CARGO_BIN_EXE_tpg-hil");
    let end = Process::start(hil, &file, &["--controller", &controller]).end();
    // Of the first request's write and the shutdown either may come first; the second write finds a broken pipe.
    end.assert_failure(4, &["is gone: unplugged"]);
    drop(deaf);
}

#[test]
fn real_time_holds_then_does_the_safe_thing_while_a_board_is_silent() {
    let folder = Folder::new();
    let bytes = policy::cartpole(1);
    let file = folder.file("cartpole.tpg", &bytes);
    let place = tempfile::tempdir().expect("a folder");
    // Loses so much that whole periods stay without an answer.
    let faults = Faults {
        garbled: 60,
        lost: 0,
    };
    let board = board(place.path(), bytes, faults, u32::MAX);
    let controller = format!("serial:{}", board.path.display());
    let arguments = [
        "--controller",
        &controller,
        "--realtime",
        "--max-misses",
        "1",
        "--seconds",
        "3",
        "--disturb",
        "action:delay:1",
        "--json",
    ];
    let end = Process::start(env!("CARGO_BIN_EXE_tpg-hil"), &file, &arguments).end();
    assert_eq!(end.status.code(), Some(0), "{end:?}");
    let report: serde_json::Value = serde_json::from_str(&end.stdout).expect("JSON");
    let realtime = &report["realtime"];
    for key in ["misses", "held_steps", "safe_steps", "recoveries"] {
        assert!(realtime[key].as_u64() > Some(0), "{key}: {report}");
    }
}
