//! `tpg-hil` and the processes that it starts: none outlives it.
#![cfg(all(feature = "plant", target_os = "linux"))]

mod support;

use std::time::{Duration, Instant};

use support::policy;
use support::{Folder, Process, WATCHDOG};

const HIL: &str = env!("CARGO_BIN_EXE_tpg-hil");

/// The child of a process with this name, if it lives.
fn child_of(parent: u32, name: &str) -> Option<u32> {
    let processes = std::fs::read_dir("/proc").expect("Linux");
    let ids = processes.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok());
    let mut ids = ids.filter(|id: &u32| {
        let stat = std::fs::read_to_string(format!("/proc/{id}/stat")).unwrap_or_default();
        // The name stands in parentheses, state and parent behind it.
        let Some((head, tail)) = stat.rsplit_once(") ") else {
            return false;
        };
        let mut fields = tail.split(' ');
        let alive = fields.next() != Some("Z");
        alive && head.ends_with(name) && fields.next() == Some(&parent.to_string())
    });
    ids.next()
}

fn await_child(parent: u32, name: &str) -> u32 {
    let start = Instant::now();
    loop {
        if let Some(id) = child_of(parent, name) {
            return id;
        }
        assert!(start.elapsed() < WATCHDOG, "no child {name}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn hil() -> (Folder, Process, u32) {
    let folder = Folder::new();
    let file = folder.file("a.tpg", &policy::cartpole(0));
    let hil = Process::start(HIL, &file, &["--episodes", "1000000000"]);
    await_child(hil.id(), "tpg-plant");
    let controller = await_child(hil.id(), "tpg-controller");
    (folder, hil, controller)
}

/// Whether a process has ended, if not been reaped.
fn ended(id: u32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{id}/stat")).unwrap_or_default();
    stat.rsplit_once(") ")
        .is_none_or(|(_, tail)| tail.starts_with('Z'))
}

fn assert_ends(id: u32) {
    let start = Instant::now();
    while !ended(id) {
        assert!(start.elapsed() < WATCHDOG, "process {id} was left behind");
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn killed_controller_ends_the_loop() {
    let (_folder, hil, controller) = hil();
    let plant = await_child(hil.id(), "tpg-plant");
    support::send_signal(controller, "KILL");
    let text = format!("tpg-controller (process {controller}) ended with signal: 9");
    hil.end().assert_failure(4, &[&text]);
    assert_ends(plant);
}

#[test]
fn stopped_children_are_killed() {
    let (_folder, hil, controller) = hil();
    let plant = await_child(hil.id(), "tpg-plant");
    support::send_signal(controller, "STOP");
    support::send_signal(plant, "STOP");
    hil.signal("TERM");
    hil.end().assert_failure(130, &["interrupted"]);
    assert_ends(plant);
    assert_ends(controller);
}

#[test]
fn children_follow_a_killed_parent() {
    let (_folder, hil, controller) = hil();
    let plant = await_child(hil.id(), "tpg-plant");
    hil.signal("KILL");
    drop(hil);
    assert_ends(plant);
    assert_ends(controller);
}
