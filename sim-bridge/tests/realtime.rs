//! Loops in real time: what a clock that waits for nobody makes of late, stopped and dead controllers.
#![cfg(feature = "plant")]

mod support;

use std::thread;
use std::time::Duration;

use serde_json::Value;
use support::{Folder, Process, policy, within_watchdog};
use tpg_runtime::{Action, Policy, Reset};
use tpg_sim_bridge::message::{ActionMessage, ObservationMessage, Request, Response};
use tpg_sim_bridge::{BridgeError, Handshake, Link, Paced, RemoteController, RunName};
use tpg_tasks::eval::Controller as _;

const HIL: &str = env!("CARGO_BIN_EXE_tpg-hil");
const PLANT: &str = env!("CARGO_BIN_EXE_tpg-plant");
const CONTROLLER: &str = env!("CARGO_BIN_EXE_tpg-controller");
/// Longer than any test may take.
const NEVER: Duration = Duration::from_secs(3600);

fn json(process: Process) -> Value {
    let end = process.end();
    assert!(end.status.success(), "{end:?}");
    serde_json::from_str(&end.stdout).expect("one JSON object")
}

fn number(json: &Value, key: &str) -> u64 {
    json["realtime"][key].as_u64().expect("a number")
}

/// Plant and controller of a loop in real time, connected; further arguments are the plant's.
fn paced(file: &std::path::Path, arguments: &[&str]) -> (Process, Process) {
    let run = RunName::unique().to_string();
    let controller = Process::start(CONTROLLER, file, &["--run", &run]);
    let arguments = [&["--run", &run, "--realtime", "--json"], arguments].concat();
    let plant = Process::start(PLANT, file, &arguments);
    plant.await_line("connected to controller");
    (plant, controller)
}

#[test]
fn without_misses_returns_are_those_of_lock_step() {
    let folder = Folder::new();
    let file = folder.file("a.tpg", &policy::cartpole(0));
    let arguments = ["--episodes", "2", "--json", "--disturb", "noise:0.01"];
    let lock_step = json(Process::start(HIL, &file, &arguments));
    assert_eq!(lock_step["realtime"], Value::Null);
    let steps = lock_step["latency"]["count"].as_u64();
    // A machine with other things to do may miss a deadline now and then.
    for _ in 0..10 {
        let arguments = [&arguments[..], &["--realtime"]].concat();
        let real_time = json(Process::start(HIL, &file, &arguments));
        if number(&real_time, "misses") == 0 {
            for key in ["returns", "lengths", "instructions_mean", "disturbances"] {
                assert_eq!(real_time[key], lock_step[key], "{key}");
            }
            assert_eq!(real_time["latency"]["count"].as_u64(), steps);
            assert_eq!(Some(number(&real_time, "periods")), steps);
            assert_eq!(number(&real_time, "period_us"), 20_000);
            return;
        }
    }
    panic!("ten runs with misses");
}

#[test]
fn stopped_controller_leads_to_the_safe_action_until_it_goes_on() {
    let folder = Folder::new();
    let file = folder.file("a.tpg", &policy::cartpole(0));
    let (plant, controller) = paced(&file, &["--seconds", "4", "--max-misses", "2"]);
    thread::sleep(Duration::from_millis(300));
    controller.signal("STOP");
    thread::sleep(Duration::from_secs(1));
    controller.signal("CONT");
    let json = json(plant);
    assert!(number(&json, "longest_run_of_misses") > 2, "{json}");
    assert!(number(&json, "safe_steps") > 0, "{json}");
    assert!(number(&json, "recoveries") > 0, "{json}");
    let (misses, periods) = (number(&json, "misses"), number(&json, "periods"));
    assert_eq!(
        misses,
        number(&json, "held_steps") + number(&json, "safe_steps")
    );
    assert_eq!(json["latency"]["count"].as_u64(), Some(periods - misses));
    assert!(controller.end().status.success());
}

#[test]
fn controller_that_stays_stopped_is_called_silent() {
    let folder = Folder::new();
    let file = folder.file("a.tpg", &policy::cartpole(0));
    let (plant, controller) = paced(&file, &["--seconds", "3600", "--timeout-ms", "1500"]);
    controller.signal("STOP");
    plant
        .end()
        .assert_failure(4, &["controller is alive but silent for 1"]);
}

#[test]
fn killed_controller_is_found_dead() {
    let folder = Folder::new();
    let file = folder.file("a.tpg", &policy::cartpole(0));
    let (plant, controller) = paced(&file, &["--seconds", "3600"]);
    controller.signal("KILL");
    let died = format!("controller died (process {})", controller.id());
    plant.end().assert_failure(4, &[&died]);
}

#[test]
fn arguments_of_real_time_need_it() {
    let folder = Folder::new();
    let file = folder.file("a.tpg", &policy::cartpole(0));
    for arguments in [
        ["--seconds", "1"],
        ["--max-misses", "1"],
        ["--disturb", "fog:1"],
    ] {
        let end = Process::start(HIL, &file, &arguments).end();
        end.assert_failure(2, &[arguments[0]]);
    }
    let end = Process::start(HIL, &file, &["--disturb", "action:noise:1"]).end();
    end.assert_failure(2, &["bad --disturb", "does not fit a policy that chooses"]);
}

/// The number of the request that a controller of the test below answers too late.
const LATE: u64 = 5;

/// Answers each observation with its number over 100, one of them only when the next one has come.
fn answer_one_late(run: &RunName, blob: &[u8]) -> Result<(), BridgeError> {
    let handshake = Handshake::new(&Policy::load(blob).expect("valid"), blob)?;
    let link = Link::<ActionMessage, ObservationMessage>::connect(run, &handshake, NEVER)?;
    loop {
        let request = link.receive()?;
        let mut reply = ActionMessage::empty();
        let observed = request.kind == Request::ObserveLatest.code();
        let kind = if observed {
            Response::Continuous
        } else {
            Response::Ready
        };
        (reply.kind, reply.len) = (kind.code(), 3);
        let mut send = |seq: u64| {
            reply.seq = seq;
            reply.values = [seq as f32 / 100.0; _];
            link.send(&reply)
        };
        if observed && request.seq == LATE {
            continue;
        }
        if request.seq == LATE + 1 {
            send(LATE)?;
        }
        send(request.seq)?;
    }
}

#[test]
fn late_answer_is_dropped_and_the_last_action_held() {
    within_watchdog(|| {
        let (run, blob) = (RunName::unique(), policy::hopper());
        let (name, theirs) = (run.clone(), blob.clone());
        let controller = thread::spawn(move || answer_one_late(&name, &theirs));
        let policy = Policy::load(&blob).unwrap();
        let remote = RemoteController::connect(&policy, &blob, &run, NEVER).unwrap();
        let mut paced = Paced::new(remote, 1000).unwrap();
        paced.reset(Reset::Agent, 1).unwrap();
        let mut held = 0.0f32;
        // The reset has number 1.
        for seq in 2..12u64 {
            let reply = paced.decide(&[0.0; 11]).unwrap();
            let Action::Continuous(values) = reply.action else {
                panic!("{reply:?}");
            };
            // Its own answer or the last one in time, whatever else this machine is doing: never the late one.
            let own = seq as f32 / 100.0;
            let expected = if values[0].to_bits() == own.to_bits() {
                own
            } else {
                held
            };
            assert_eq!(values[0].to_bits(), expected.to_bits(), "request {seq}");
            assert!(seq != LATE || values[0].to_bits() != own.to_bits());
            held = values[0];
        }
        let (latency, _, timing) = paced.finish().unwrap();
        assert!(
            timing.counts.misses >= 1 && timing.late_answers >= 1,
            "{timing:?}"
        );
        assert_eq!(timing.counts.periods, 10);
        assert_eq!(latency.count, 10 - timing.counts.misses);
        assert!(controller.join().unwrap().is_err());
    });
}

/// Answers the first observation of each episode, by index 1, and no other.
fn answer_once(run: &RunName, blob: &[u8]) -> Result<(), BridgeError> {
    let handshake = Handshake::new(&Policy::load(blob).expect("valid"), blob)?;
    let link = Link::<ActionMessage, ObservationMessage>::connect(run, &handshake, NEVER)?;
    let mut first = false;
    loop {
        let request = link.receive()?;
        let mut reply = ActionMessage::empty();
        (reply.seq, reply.index) = (request.seq, 1);
        let observed = request.kind == Request::ObserveLatest.code();
        if observed && !std::mem::take(&mut first) {
            continue;
        }
        first = !observed;
        let kind = if observed {
            Response::Discrete
        } else {
            Response::Ready
        };
        reply.kind = kind.code();
        link.send(&reply)?;
    }
}

#[test]
fn last_action_is_held_as_often_as_asked_then_the_safe_one_applied() {
    within_watchdog(|| {
        let (run, blob) = (RunName::unique(), policy::cartpole(0));
        let (name, theirs) = (run.clone(), blob.clone());
        let controller = thread::spawn(move || answer_once(&name, &theirs));
        let policy = Policy::load(&blob).unwrap();
        let remote = RemoteController::connect(&policy, &blob, &run, NEVER).unwrap();
        let mut paced = Paced::new(remote, 2).unwrap();
        let mut held = 0;
        // A machine with other things to do may miss even the one answer; then there is nothing to hold.
        for _ in 0..10 {
            paced.reset(Reset::Episode, 1).unwrap();
            let actions = [(); 6].map(|()| match paced.decide(&[0.0; 4]).unwrap().action {
                Action::Discrete(index) => index,
                Action::Continuous(values) => panic!("{values:?}"),
            });
            let answered = actions[0] == 1;
            assert_eq!(actions, if answered { [1, 1, 1, 0, 0, 0] } else { [0; 6] });
            held += if answered { 2 } else { 0 };
        }
        let (_, _, timing) = paced.finish().unwrap();
        assert!(held > 0 && timing.counts.held == held, "{timing:?}");
        assert_eq!(timing.counts.safe, timing.counts.misses - held);
        // Each reset was confirmed after a row of misses; the last one is followed by the end.
        assert_eq!(timing.counts.recoveries, 9);
        assert!(controller.join().unwrap().is_err());
    });
}
