//! Foreign plants and controllers, in Python and C, through the open protocol: the bits of `tpg eval`.

use std::fs;
use std::io::{BufRead as _, BufReader};
use std::net::UdpSocket;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use tpg_runtime::blob::RegisterMode;
use tpg_runtime::isa::Op;
use tpg_runtime::tables::Target;
use tpg_runtime::{HostAgent, Policy, Reset};
use tpg_tasks::eval::{Domain, EpisodeSeeds, episode_seed};
use tpg_tasks::task::{CartPole, Task as _};
use tpg_tests::draft::{Draft, DraftProgram, DraftTeam, header, instruction};
use tpg_tests::process::{command_path, finish, stderr, text, tpg, tpg_json, tpg_ok};
use tpg_tests::{firmware, fixtures};

const EPISODES: u64 = 6;
const SEED: u64 = 5;
const WATCHDOG: Duration = Duration::from_secs(120);

fn examples() -> PathBuf {
    firmware::repository().join("docs/examples/peers")
}

/// A process that is ended with the test.
struct Peer(Child);

impl Drop for Peer {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Peer {
    fn start(command: &mut Command) -> Self {
        Peer(command.stdin(Stdio::null()).spawn().expect("it starts"))
    }
}

/// A C program of the examples.
fn compile(folder: &Path, name: &str, more: &[&Path]) -> PathBuf {
    let program = folder.join(name);
    let mut cc = Command::new("cc");
    cc.args([
        "-std=gnu99",
        "-O1",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-Wpedantic",
    ]);
    cc.args(["-ffp-contract=off", "-I"]).arg(folder);
    cc.arg(examples().join(name).with_extension("c"))
        .args(more)
        .arg("-o")
        .arg(&program);
    assert!(
        cc.status().expect("a C compiler").success(),
        "{name} does not compile"
    );
    program
}

fn python(script: &str) -> Command {
    let mut command = Command::new("python3");
    command.arg("-B").arg(examples().join(script));
    command
}

/// A UDP port of this machine that nobody uses.
fn free_port() -> String {
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a port");
    socket.local_addr().expect("its number").to_string()
}

fn await_file(path: &Path) {
    let start = Instant::now();
    while !path.exists() {
        assert!(start.elapsed() < WATCHDOG, "no {}", path.display());
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// A controller of ours that listens, and where.
fn listening(policy: &Path, place: &str) -> (Peer, String) {
    let mut command = Command::new(command_path("tpg-controller"));
    command.arg(policy).args(["--listen", place]);
    command.stdin(Stdio::null()).stderr(Stdio::piped());
    let mut peer = Peer(command.spawn().expect("it starts"));
    let mut lines = BufReader::new(peer.0.stderr.take().expect("piped")).lines();
    let line = lines.next().expect("a line").expect("text");
    let place = line
        .split("listening at ")
        .nth(1)
        .unwrap_or_else(|| panic!("{line}"));
    (peer, place.to_owned())
}

/// The start of the episodes of `tpg eval`, as the plants of the examples read them, and what must come of them: the
/// number of steps and the state in the end, bit by bit.
fn episodes(file: &[u8]) -> (String, Vec<(u32, [u64; 4])>) {
    let mut agent = Box::new(HostAgent::new(Policy::load(file).expect("valid")).expect("fits"));
    let mut task = CartPole::new();
    let (mut text, mut ends) = (String::new(), Vec::new());
    for k in 0..EPISODES {
        let mut seeds = EpisodeSeeds::new(episode_seed(Domain::Test, SEED, 0, k));
        task.reset(&mut seeds.initial_state);
        let [x, v, angle, omega] = task.state();
        text += &format!("{} {x:?} {v:?} {angle:?} {omega:?}\n", seeds.agent);
        agent.reset(
            if k == 0 { Reset::Agent } else { Reset::Episode },
            seeds.agent,
        );
        let (mut steps, mut seen) = (0, [0.0; 4]);
        loop {
            task.observe(&mut seen);
            let action = agent.decide(&seen).expect("four values").action;
            let terminated = task.step(action).terminated;
            steps += 1;
            if terminated || steps == task.spec().max_steps {
                break;
            }
        }
        ends.push((steps, task.state().map(f64::to_bits)));
    }
    (text, ends)
}

fn read_ends(printed: &str) -> Vec<(u32, [u64; 4])> {
    let line = |line: &str| {
        let mut words = line.split_whitespace();
        let steps = words.next().expect("steps").parse().expect("a number");
        let state = std::array::from_fn(|_| {
            let number: f64 = words.next().expect("a state").parse().expect("a number");
            number.to_bits()
        });
        (steps, state)
    };
    printed.lines().map(line).collect()
}

/// Runs the plants of both languages over both transports under a policy.
fn assert_plants_agree(policy: &[u8]) {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("policy.tpg");
    fs::write(&file, policy).expect("written");
    let (starts, expected) = episodes(policy);
    let list = folder.path().join("episodes.txt");
    fs::write(&list, starts).expect("written");
    let count = EPISODES.to_string();
    let common = ["--task", "cartpole", "--observability", "none", "--json"];
    let eval = [
        &["eval", text(&file), "--episodes", &count, "--seed", "5"],
        &common[..],
    ]
    .concat();
    let lengths = tpg_json(&eval)["lengths"].clone();
    let steps: Vec<u32> = expected.iter().map(|(steps, _)| *steps).collect();
    assert_eq!(lengths, serde_json::json!(steps));
    let plant = compile(folder.path(), "plant", &[]);
    let socket = folder.path().join("policy.sock");
    for place in [
        format!("unix:{}", socket.display()),
        "udp:127.0.0.1:0".to_owned(),
    ] {
        let (_controller, place) = listening(&file, &place);
        for mut command in [python("plant.py"), Command::new(&plant)] {
            command.arg(&place).arg(&list);
            command
                .stdin(Stdio::null())
                .stdout(Stdio::piped())
                .stderr(Stdio::piped());
            let output = finish(command.spawn().expect("it starts"));
            assert!(output.status.success(), "{place}: {}", stderr(&output));
            let printed = String::from_utf8(output.stdout).expect("text");
            assert_eq!(read_ends(&printed), expected, "{place}");
        }
    }
}

#[test]
fn plants_in_python_and_c_give_the_bits_of_eval() {
    assert_plants_agree(&rule());
    // This one falls early, and what it decides depends on its memory and its random numbers.
    assert_plants_agree(&fixtures::three_teams("cartpole", RegisterMode::Stateful));
}

/// Pushes to where the pole leans: what controller.py does, as a policy.
fn rule() -> Vec<u8> {
    let mut draft = Draft {
        header: header(1, 4),
        teams: vec![DraftTeam {
            members: vec![0, 1],
            ..DraftTeam::default()
        }],
        programs: [0, 1]
            .map(|action| DraftProgram::bidding(0.0, Target::Atomic(action)))
            .into(),
        cells: Vec::new(),
        image: Vec::new(),
        front_end: Vec::new(),
        ranges: Vec::new(),
    };
    let angle = 2;
    let bid = draft.scalar(1, 0);
    draft.programs[1].code = vec![instruction(Op::Add, bid, angle, angle)];
    draft.encode()
}

/// Runs a policy's episodes here and at a foreign controller.
fn assert_controller_agrees(file: &Path, more: &[&str], controller: &str) -> Value {
    let common = [&["--episodes", "6", "--seed", "5", "--json"], more].concat();
    let eval = tpg_json(&[&["eval", text(file)], &common[..]].concat());
    let foreign = ["--controller", controller, "--any-controller"];
    let hil = tpg_json(&[&["hil", text(file)], &common[..], &foreign].concat());
    for key in ["returns", "lengths", "mean"] {
        assert_eq!(eval[key], hil[key], "{key} of {controller}");
    }
    assert_ne!(
        eval["lengths"][0], eval["lengths"][1],
        "episodes that tell nothing"
    );
    assert_eq!(
        eval["instructions_mean"].is_number(),
        hil["instructions_mean"].is_number()
    );
    hil
}

#[test]
fn a_controller_in_python_gives_the_bits_of_its_policy() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("rule.tpg");
    fs::write(&file, rule()).expect("written");
    let socket = folder.path().join("rule.sock");
    let peer = Peer::start(python("controller.py").arg(format!("unix:{}", socket.display())));
    await_file(&socket);
    let more = ["--task", "cartpole", "--observability", "none"];
    assert_controller_agrees(&file, &more, &format!("serial:{}", socket.display()));
    drop(peer);
    let port = free_port();
    let _peer = Peer::start(python("controller.py").arg(format!("udp:{port}")));
    assert_controller_agrees(&file, &more, &format!("udp:{port}"));
    // Its identity is no policy's, so it has to be asked for.
    let all = ["hil", text(&file), "--task", "cartpole", "--controller"];
    let output = tpg(all.iter().copied().chain([&*format!("udp:{port}")]));
    assert_eq!(output.status.code(), Some(4), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("--any-controller"),
        "{}",
        stderr(&output)
    );
}

#[test]
fn a_controller_in_c_gives_the_bits_of_its_policy() {
    if cfg!(not(feature = "mujoco")) {
        println!("skipped: the champion is of a MuJoCo task");
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let champion = firmware::repository().join("docs/champions/hopper-b23.tpg");
    let source = folder.path().join("champion.c");
    tpg_ok(&["export", text(&champion), "--c", text(&source)]);
    let program = compile(folder.path(), "controller", &[&source]);
    let port = free_port();
    let _peer = Peer::start(Command::new(program).arg(format!("udp:{port}")));
    let hil = assert_controller_agrees(&champion, &[], &format!("udp:{port}"));
    assert!(hil["serial"].is_object(), "{hil}");
}

#[test]
fn a_controller_that_does_not_come_is_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("rule.tpg");
    fs::write(&file, rule()).expect("written");
    let place = format!("udp:{}", free_port());
    let all = [
        "hil",
        text(&file),
        "--task",
        "cartpole",
        "--timeout-ms",
        "600",
        "--controller",
        &place,
    ];
    let output = tpg(all);
    assert_eq!(output.status.code(), Some(4), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("has not answered for"),
        "{}",
        stderr(&output)
    );
    let mut command = Command::new(command_path("tpg-controller"));
    command.arg(&file).args(["--listen", "tcp:127.0.0.1:1"]);
    command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped());
    let output = finish(command.spawn().expect("it starts"));
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("use unix:PATH, or udp:HOST:PORT"),
        "{}",
        stderr(&output)
    );
}
