//! The policy on an emulated board, the plant here: whole episodes over the board's serial line.

use std::fs;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use tpg_tests::firmware::{Board, M4F, RISCV, repository};
use tpg_tests::golden;
use tpg_tests::process::{stderr, text, tpg, tpg_json, tpg_ok};

const WATCHDOG: Duration = Duration::from_secs(60);

/// An emulator with the firmware `serial`, its line a socket; ended when dropped.
struct Emulator {
    child: Child,
    folder: tempfile::TempDir,
}

impl Emulator {
    fn start(board: Board, champion: &Path) -> Self {
        let program = board.build_with("serial", &[("TPG_CHAMPION", champion)]);
        let folder = tempfile::tempdir().expect("a folder");
        // A later build of the same program shall not change this one.
        let own = folder.path().join("serial.elf");
        fs::copy(program, &own).expect("copied");
        let child = (board.emulator(&own))
            .current_dir(folder.path())
            .args(["-serial", "unix:uart,server=on,wait=off"])
            .args(["-qmp", "unix:qmp,server=on,wait=off"])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the emulator starts");
        let emulator = Emulator { child, folder };
        let started = Instant::now();
        while !emulator.socket("uart").exists() || !emulator.socket("qmp").exists() {
            assert!(started.elapsed() < WATCHDOG, "no sockets");
            thread::sleep(Duration::from_millis(5));
        }
        emulator
    }

    fn socket(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn controller(&self) -> String {
        format!("serial:{}", self.socket("uart").display())
    }

    /// Presses the board's reset button, or with `quit` unplugs it.
    fn command(&self, command: &str) {
        use std::io::{BufRead as _, BufReader, Write as _};
        let mut stream = UnixStream::connect(self.socket("qmp")).expect("a monitor");
        stream.set_read_timeout(Some(WATCHDOG)).expect("a timeout");
        let mut lines = BufReader::new(stream.try_clone().expect("a handle")).lines();
        lines.next();
        for command in ["qmp_capabilities", command] {
            writeln!(stream, "{{\"execute\": \"{command}\"}}").expect("sent");
            lines.next();
        }
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn champion(name: &str) -> PathBuf {
    golden::path(&format!("champions/{name}.tpg"))
}

/// The same episodes here and on the board; every number that is not a time must be equal.
fn assert_board_equals_eval(board: Board, file: &Path, more: &[&str]) {
    let name = file.display();
    let emulator = Emulator::start(board, file);
    let controller = emulator.controller();
    let mut arguments = vec![
        "eval",
        text(file),
        "--episodes",
        "2",
        "--seed",
        "11",
        "--json",
    ];
    arguments.extend(more);
    let here = tpg_json(&arguments);
    arguments[0] = "hil";
    arguments.extend(["--controller", &controller]);
    let there = tpg_json(&arguments);
    for key in ["returns", "lengths", "mean", "sd", "instructions_mean"] {
        assert_eq!(here[key], there[key], "{key} of {name} on {}", board.name);
    }
    assert_eq!(there["serial"]["damaged_here"], 0, "{there}");
    let decisions: u64 = (there["lengths"].as_array().into_iter().flatten())
        .filter_map(serde_json::Value::as_u64)
        .sum();
    assert_eq!(there["latency"]["count"], decisions);
}

#[cfg(feature = "mujoco")]
#[test]
fn mujoco_episodes_on_a_cortex_m4f_return_the_same_bits() {
    if M4F.is_available() {
        // With memory and without, with front ends and without.
        for name in ["hopper-sr-sm-b23", "inverted-double-pendulum-sr"] {
            assert_board_equals_eval(*M4F, &champion(name), &[]);
        }
        for name in ["hopper-b23", "inverted-double-pendulum-b23"] {
            let file = repository().join(format!("docs/champions/{name}.tpg"));
            assert_board_equals_eval(*M4F, &file, &[]);
        }
    }
}

#[cfg(feature = "mujoco")]
#[test]
fn mujoco_episodes_on_a_cortex_m3_return_the_same_bits() {
    let m3 = Board::named("mps2-an385");
    if m3.is_available() {
        assert_board_equals_eval(m3, &champion("hopper-sr-sm-b23"), &[]);
    }
}

#[test]
fn classic_episodes_on_boards_return_the_same_bits() {
    for board in [*M4F, *RISCV] {
        if board.is_available() {
            let file = champion("cartpole-sr-sm-b23");
            assert_board_equals_eval(board, &file, &["--disturb", "delay:1"]);
        }
    }
}

#[test]
fn a_board_takes_a_new_policy_keeps_it_over_a_reset_and_is_missed_when_unplugged() {
    if !M4F.is_available() {
        return;
    }
    // Of the same width, so that the board's agent can hold both.
    let (old, new) = (champion("cartpole-sr-sm-b23"), other_cartpole());
    let emulator = Emulator::start(*M4F, &old);
    let controller = emulator.controller();
    let on_board = |file: &Path| {
        let arguments = [
            "hil",
            text(file),
            "--episodes",
            "20",
            "--controller",
            &controller,
        ];
        tpg(arguments)
    };
    assert!(on_board(&old).status.success());
    let refused = on_board(new.path());
    assert_eq!(refused.status.code(), Some(4));
    assert!(stderr(&refused).contains("does not match"), "{refused:?}");
    tpg_ok(&["update", text(new.path()), "--controller", &controller]);
    assert!(
        on_board(new.path()).status.success(),
        "the new policy decides"
    );
    emulator.command("system_reset");
    assert!(on_board(new.path()).status.success(), "it outlives a reset");
    // A policy for another plant is refused, and changes nothing.
    let foreign = champion("pendulum-per-episode");
    let refused = tpg(["update", text(&foreign), "--controller", &controller]);
    assert_eq!(refused.status.code(), Some(4));
    assert!(
        stderr(&refused).contains("is for another robot"),
        "{refused:?}"
    );
    let forced = tpg([
        "update",
        text(&foreign),
        "--force",
        "--controller",
        &controller,
    ]);
    assert_eq!(forced.status.code(), Some(4));
    assert!(
        stderr(&forced).contains("does not fit the board's agent"),
        "{forced:?}"
    );
    assert!(
        on_board(new.path()).status.success(),
        "the policy in use stays"
    );
    // New, but not confirmed before the reset: the one before it comes back.
    tpg_ok(&["update", text(&old), "--controller", &controller]);
    let list = || tpg_json(&["update", "--list", "--controller", &controller, "--json"]);
    assert_eq!(list()["slots"][2]["state"], "unconfirmed");
    emulator.command("system_reset");
    assert!(
        on_board(new.path()).status.success(),
        "back to the last one that was confirmed"
    );
    // The same without a reset, then all the way back.
    tpg_ok(&["update", text(&old), "--controller", &controller]);
    tpg_ok(&["update", "--revert", "--controller", &controller]);
    assert_eq!(list()["slots"][1]["in_use"], true);
    tpg_ok(&["update", "--erase", "--controller", &controller]);
    assert_eq!(list()["slots"][0]["in_use"], true);
    tpg_ok(&["update", text(new.path()), "--controller", &controller]);
    let unplugged = thread::scope(|scope| {
        let run = scope.spawn(|| {
            let file = text(new.path());
            let arguments = [
                "hil",
                file,
                "--episodes",
                "100000",
                "--controller",
                &controller,
            ];
            tpg(arguments)
        });
        thread::sleep(Duration::from_millis(500));
        emulator.command("quit");
        run.join().expect("no panic")
    });
    assert_eq!(unplugged.status.code(), Some(4), "{unplugged:?}");
    assert!(
        stderr(&unplugged).contains("is gone: unplugged"),
        "{unplugged:?}"
    );
}

#[test]
fn a_board_refuses_another_robots_policy_by_what_differs_takes_it_by_force_and_reverts_it() {
    if !M4F.is_available() {
        return;
    }
    let champion = |name: &str| repository().join(format!("docs/champions/{name}.tpg"));
    let hopper = champion("hopper-b23");
    let pendulum = champion("inverted-double-pendulum-b23");
    let emulator = Emulator::start(*M4F, &hopper);
    let controller = emulator.controller();
    let refused = tpg(["update", text(&pendulum), "--controller", &controller]);
    assert_eq!(refused.status.code(), Some(4));
    for said in [
        "control period is 8 ms on the board, 50 ms in the new policy",
        "continuous with 3 outputs on the board, continuous with 1 outputs",
        "`torso_height` in m on the board",
        "nothing was written",
    ] {
        assert!(stderr(&refused).contains(said), "{said}: {refused:?}");
    }
    let in_use = |slot: usize| {
        let list = tpg_json(&["update", "--list", "--controller", &controller, "--json"]);
        assert_eq!(list["slots"][0]["contract"], "c39ae439c03d8b34");
        assert_eq!(list["slots"][slot]["in_use"], true, "{list}");
    };
    in_use(0);
    let update = |arguments: &[&str]| {
        let command = [&["update"][..], arguments, &["--controller", &controller]];
        let output = tpg(command.concat());
        assert!(output.status.success(), "{output:?}");
        output
    };
    let forced = update(&[text(&pendulum), "--force"]);
    assert!(stderr(&forced).contains("forced: control period is 8 ms"));
    in_use(1);
    update(&["--revert"]);
    in_use(0);
    // Without a revert, the next update of the right robot takes its place, and a reset gives it up as well.
    update(&[text(&pendulum), "--force"]);
    update(&[text(&hopper)]);
    in_use(1);
    emulator.command("system_reset");
    in_use(0);
}

/// A champion of the cart-pole from another run.
fn other_cartpole() -> tempfile::NamedTempFile {
    let folder = tempfile::tempdir().expect("a folder");
    tpg_ok(&[
        "train",
        "cartpole-sr-sm-b23",
        "--seed",
        "4",
        "--generations",
        "2",
        "--set",
        "evolution.population=20",
        "--set",
        "evolution.children=20",
        "--out",
        text(folder.path()),
    ]);
    let file = tempfile::NamedTempFile::new().expect("a file");
    fs::copy(folder.path().join("champion.tpg"), file.path()).expect("copied");
    file
}

#[test]
fn the_examples_champion_is_one_of_the_golden_ones() {
    let example =
        fs::read(repository().join("firmware-examples/champion.tpg")).expect("a champion");
    let golden = fs::read(champion("hopper-sr-sm-b23")).expect("a champion");
    assert!(
        example == golden,
        "copy tests/golden/champions/hopper-sr-sm-b23.tpg"
    );
}
