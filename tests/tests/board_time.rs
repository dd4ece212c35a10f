//! Firmware that decides in control periods: what the program `cycles` says of them, and frameworks that keep them.

use std::cell::Cell;
use std::fmt::Write as _;
use std::fs;

use tpg_board::cycles::{RecordedError, judge, load, observation_of, replay};
use tpg_runtime::{Action, Fixed, HostAgent, Policy, Reset, State};
use tpg_tests::firmware::{M4F, RISCV, repository, run_framework};

fn example(name: &str) -> Vec<u8> {
    fs::read(repository().join("firmware-examples").join(name)).expect("a file")
}

fn observations() -> String {
    String::from_utf8(example("champion.observations")).expect("text")
}

/// The counts of decisions from a line of a report: how many, least, mean, most.
fn counts(line: &str) -> [u64; 4] {
    let words = line.split(|c: char| !c.is_ascii_digit());
    let numbers: Vec<u64> = words.filter_map(|word| word.parse().ok()).collect();
    numbers.try_into().unwrap_or_else(|_| panic!("{line}"))
}

#[test]
fn boards_say_whether_the_champion_is_in_time() {
    for board in [*M4F, *RISCV] {
        if !board.is_available() {
            continue;
        }
        let (status, printed) = board.run(&board.build("cycles"), &board.emulation().count);
        assert_eq!(status, Some(0), "{}: {printed}", board.name);
        let lines: Vec<&str> = printed.lines().collect();
        let [policy, worst_path, verdict] = lines.as_slice() else {
            panic!("{printed}")
        };
        assert!(policy.contains("instructions"), "not labelled: {printed}");
        assert!(verdict.starts_with("PASS"), "{printed}");
        let recorded = observations().lines().count() as u64;
        let [policy, worst_path] = [*policy, *worst_path].map(counts);
        for [decisions, least, mean, most] in [policy, worst_path] {
            assert_eq!(decisions, recorded, "{printed}");
            assert!(0 < least && least <= mean && mean <= most, "{printed}");
        }
        // The same observations take no less where all programs run.
        assert!(policy[2] <= worst_path[2], "{printed}");
    }
}

#[test]
fn recorded_observations_that_do_not_fit_are_named() {
    let bytes = example("champion.tpg");
    let policy = Policy::load(&bytes).expect("valid");
    let mut agent = Box::new(HostAgent::new(policy).expect("fits"));
    let recorded = observations();
    let mut replay = |text: &str| replay(&mut agent, text, || 7);
    let spread = replay(&recorded).expect("observations of this policy");
    assert_eq!((spread.least, spread.most, spread.mean()), (0, 0, 0));
    let first = recorded.lines().next().expect("a line");
    for (text, line) in [
        (String::new(), 0),
        (format!("{first}\n{first} 00000000\n"), 2),
        (format!("\n{}\n", &first[..first.len() - 9]), 2),
        (first.replacen(' ', "  ", 1), 1),
        ("what\n".to_owned(), 1),
    ] {
        assert_eq!(replay(&text), Err(RecordedError(line)), "{text}");
    }
}

#[test]
fn a_verdict_has_a_text_and_an_exit_status() {
    type Room = State<2048, 32, 8, 8>;
    let bytes = example("champion.tpg");
    let recorded = observations();
    // Each reading takes one tick more than the one before, so each decision seems to take one.
    let (ticks, step) = (Cell::new(0), Cell::new(0));
    let now = || {
        step.set(step.get() + 1);
        ticks.set(ticks.get() + step.get());
        ticks.get()
    };
    let verdict = |policy: &[u8], recorded: &str, allowed| {
        let policy = load::<Fixed<11>, _>(policy, Room::new());
        let worst_path = load::<Fixed<11>, _>(&bytes, Room::new());
        judge(policy, worst_path, recorded, now, (allowed, "ticks"))
    };
    for (verdict, status, text) in [
        (
            verdict(&bytes, &recorded, 1),
            0,
            "PASS: a control period allows 1 ticks",
        ),
        (
            verdict(&bytes, &recorded, 0),
            5,
            "FAIL: a control period allows 0 ticks",
        ),
        (
            verdict(&bytes[1..], &recorded, 1),
            1,
            "cycles: a policy is damaged",
        ),
        (verdict(&bytes, "what", 1), 1, "cycles: line 1 of"),
    ] {
        assert_eq!(verdict.status(), status, "{verdict}");
        let printed = verdict.to_string();
        let last = printed.lines().last().expect("a line");
        assert!(last.starts_with(text), "{printed}");
    }
}

/// What the examples of frameworks print, computed here.
fn host_lines() -> String {
    let bytes = example("champion.tpg");
    let policy = Policy::load(&bytes).expect("valid");
    let mut agent = Box::new(HostAgent::new(policy).expect("fits"));
    agent.reset(Reset::Agent, 1);
    let mut observation = vec![0.0; usize::from(policy.header().observation_len)];
    let mut text = String::new();
    for line in observations().lines() {
        observation_of(line, &mut observation).expect("recorded");
        let Ok(Action::Continuous(values)) = agent.decide(&observation).map(|d| d.action) else {
            panic!("a continuous action")
        };
        for value in values {
            write!(text, "{:08x} ", value.to_bits()).expect("a string takes any text");
        }
        text.push('\n');
    }
    text
}

#[test]
fn tasks_of_embassy_and_rtic_decide_as_on_the_host() {
    let expected = host_lines();
    for (name, target, machine) in [
        ("embassy-mps2-an386", "thumbv7em-none-eabihf", "mps2-an386"),
        ("rtic-lm3s6965evb", "thumbv7m-none-eabi", "lm3s6965evb"),
    ] {
        if let Some((status, printed)) = run_framework(name, target, machine) {
            assert_eq!(status, Some(0), "{name}: {printed}");
            // The emulator has a word of its own to say on the timer that RTIC stops.
            let lines = printed.lines().filter(|line| !line.starts_with("Timer"));
            assert!(lines.eq(expected.lines()), "{name}: {printed}");
        }
    }
}
