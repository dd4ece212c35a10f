//! Firmware is sized when it is compiled: what does not fit does not compile, and says why.

use std::path::Path;
use std::process::Command;

use tpg_runtime::blob::{contract_bytes, contract_of, labels_of};
use tpg_runtime::hash::{START_64, fnv1a_64};
use tpg_runtime::parts::Resource;
use tpg_runtime::rng::Pcg32;
use tpg_runtime::{
    Agent, AnyWidth, Capacities, CapacityError, HostAgent, Policy, SliceAgent, Slices, State,
    policy,
};
use tpg_tests::graphs;
use tpg_tests::process::text;

policy!(mod champion = include_bytes!("../golden/v1/team-memory.tpg"));
static BLOB: &[u8] = champion::BYTES;
const NEEDED: Capacities = Capacities::of(BLOB);
const _: () = NEEDED.assert_fits(&NEEDED);

#[test]
fn an_agent_of_the_policys_own_type_decides() {
    let mut state = champion::State::new();
    let mut agent = champion::load(&mut state).expect("exactly enough");
    let policy = Policy::load(BLOB).expect("a policy");
    let mut large = Box::new(HostAgent::new(policy).expect("room"));
    for step in 0..20u8 {
        let observation = [0.25 * f32::from(step); champion::INPUTS];
        assert_eq!(large.decide(&observation), Ok(agent.decide(&observation)));
    }
    assert!(size_of_val(&agent) <= OVERHEAD);
    assert!(size_of::<champion::State>() <= NEEDED.state_bytes() + STATE_OVERHEAD);
}

/// What the compiler reads of a file is what the loader finds in it, in every version of the format.
#[test]
fn a_module_has_the_numbers_and_names_of_its_policy() {
    macro_rules! check {
        ($($file:literal),* $(,)?) => {$({
            policy!(mod known = include_bytes!($file));
            let policy = Policy::load(known::BYTES).expect("a policy");
            let header = policy.header();
            assert_eq!(known::HEADER, *header, $file);
            assert_eq!(known::INPUTS, usize::from(header.observation_len));
            assert_eq!(known::OUTPUTS, header.outputs());
            let actions = if header.outputs() == 0 { usize::from(header.actions) } else { 0 };
            assert_eq!(known::ACTIONS, actions);
            assert_eq!(known::PERIOD.as_micros(), u128::from(header.control_period_us));
            let inputs = known::INPUT_CHANNELS.map(|c| (c.name, c.unit));
            assert_eq!(inputs.to_vec(), policy.inputs().collect::<Vec<_>>(), $file);
            let outputs = known::OUTPUT_CHANNELS.map(|c| (c.name, c.unit));
            assert_eq!(outputs.to_vec(), policy.outputs().collect::<Vec<_>>(), $file);
            assert_eq!(known::CONTRACT, policy.contract(), $file);
            let mut contract = Vec::new();
            contract_bytes(header, policy.tables(), |part| contract.extend(part));
            assert_eq!(known::CONTRACT, fnv1a_64(START_64, &contract), $file);
        })*};
    }
    check!(
        "../golden/v1/team-memory.tpg",
        "../golden/v1/each.tpg",
        "../golden/v2/believed-cubic.tpg",
        "../golden/v3/team-memory.tpg",
        "../golden/v3/each.tpg",
        "../golden/v3/believed-cubic.tpg",
        "../golden/champions/cartpole-sr-sm-b23.tpg",
        "../../docs/champions/half-cheetah-b23.tpg",
    );
}

/// Every file of which the loader reads labels: the compiler's way to them finds the same.
#[test]
fn labels_and_contract_are_found_without_loading() {
    for (number, bytes) in graphs::all().iter().enumerate() {
        let policy = Policy::load(bytes).expect("a policy");
        assert_eq!(
            labels_of(bytes),
            Some(policy.tables().labels),
            "policy {number}"
        );
        assert_eq!(
            contract_of(bytes),
            Some(policy.contract()),
            "policy {number}"
        );
        for len in 0..bytes.len() {
            // It finds the labels or nothing, wherever the file ends.
            let found = labels_of(&bytes[..len]);
            assert!(
                found.is_none_or(|labels| labels == policy.tables().labels),
                "{number}"
            );
        }
    }
}

/// Bytes that a state takes beyond what the policy needs, at most.
const STATE_OVERHEAD: usize = 64;

/// Bytes that an agent takes beyond its state, at most: asked is 1 KiB. On boards, whose pointers are shorter, it is less than here.
const OVERHEAD: usize = 400;

/// Each policy with the size of the agent of its own type, which firmware has.
macro_rules! champions {
    ($($file:literal),* $(,)?) => {
        [$({
            policy!(mod known = include_bytes!($file));
            let bytes = size_of::<known::State>() + size_of::<known::Agent<'static>>();
            ($file, known::BYTES, bytes)
        }),*]
    };
}

#[test]
fn champions_take_little_more_than_their_state_and_those_of_simple_tasks_2_kib() {
    let champions = champions![
        "../golden/champions/cartpole-sr-sm-b23.tpg",
        "../golden/champions/hopper-sr-sm-b23.tpg",
        "../golden/champions/inverted-double-pendulum-sr.tpg",
        "../golden/champions/pendulum-per-episode.tpg",
        "../../docs/champions/acrobot.tpg",
        "../../docs/champions/cartpole.tpg",
        "../../docs/champions/half-cheetah-b23.tpg",
        "../../docs/champions/hopper-b23.tpg",
        "../../docs/champions/inverted-double-pendulum-b23.tpg",
        "../../docs/champions/pendulum.tpg",
    ];
    let mut chapter_2 = 0;
    for (file, bytes, agent) in champions {
        let state = Capacities::of(bytes).state_bytes();
        assert!(agent <= state + OVERHEAD, "{file}: {agent} for {state}");
        let policy = Policy::load(bytes).expect("a policy");
        let (task, cells) = (policy.tables().task, policy.tables().cells.len());
        let is_simple = ["cartpole", "acrobot", "pendulum"].map(|name| task.starts_with(name));
        println!("{file} ({task}): {agent} bytes, {state} of them the state; {cells} cells read");
        if is_simple.contains(&true) && cells <= 256 {
            chapter_2 += 1;
            assert!(agent <= 2048, "{file}: {agent}");
        }
    }
    assert_eq!(chapter_2, 5, "champions of the thesis's chapter 2");
}

#[test]
fn drawn_policies_take_little_more_than_their_state() {
    for (number, bytes) in graphs::all().iter().enumerate() {
        let needed = Capacities::of(bytes);
        let mut words = vec![0.0; needed.words];
        let mut bids = vec![0.0; needed.programs];
        let mut visited = vec![false; needed.teams];
        let mut streams: Vec<_> = (0..needed.streams).map(|_| Pcg32::new(0, 0)).collect();
        let slices = Slices {
            words: &mut words,
            bids: &mut bids,
            visited: &mut visited,
            streams: &mut streams,
        };
        let state = size_of_val(slices.words)
            + size_of_val(slices.bids)
            + size_of_val(slices.visited)
            + size_of_val(slices.streams);
        assert_eq!(state, needed.state_bytes(), "policy {number}");
        let policy = Policy::load(bytes).expect("a policy");
        let agent: SliceAgent<'_, '_, AnyWidth> = SliceAgent::new_in(policy, slices).expect("room");
        assert!(size_of_val(&agent) <= OVERHEAD, "policy {number}");
    }
}

#[test]
fn a_policy_that_is_loaded_later_is_refused_with_both_numbers() {
    let policy = Policy::load(BLOB).expect("a policy");
    let refused = Agent::<'_, AnyWidth, State<16, 64, 64, 64>>::new(policy).map(|_| ());
    let error = CapacityError {
        resource: Resource::Words,
        needed: NEEDED.words,
        available: 16,
    };
    assert_eq!(refused, Err(error));
}

/// Compiles a firmware-like crate around a policy; what the compiler said if it failed.
fn compile(folder: &Path, policy: &[u8], check: &str) -> Result<(), String> {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let write = |name: &str, bytes: &[u8]| {
        std::fs::write(folder.join(name), bytes).expect("a file of the crate");
    };
    let runtime = root.join("runtime");
    let manifest = format!(
        "[package]\nname = \"firmware\"\nedition = \"2024\"\n[workspace]\n\
         [dependencies]\ntpg-runtime = {{ path = {:?} }}\n[lib]\npath = \"lib.rs\"\n",
        text(&runtime)
    );
    write("Cargo.toml", manifest.as_bytes());
    std::fs::copy(root.join("Cargo.lock"), folder.join("Cargo.lock")).expect("the versions");
    write("champion.tpg", policy);
    let source = format!(
        "#![no_std]\nuse tpg_runtime::Capacities;\n\
         pub static BLOB: &[u8] = include_bytes!(\"champion.tpg\");\n\
         pub const NEEDED: Capacities = Capacities::of(BLOB);\n{check}\n"
    );
    write("lib.rs", source.as_bytes());
    let output = Command::new(env!("CARGO"))
        .args(["check", "--quiet", "--offline"])
        .current_dir(folder)
        .env("CARGO_TARGET_DIR", folder.join("target"))
        .output()
        .expect("cargo runs");
    if output.status.success() {
        return Ok(());
    }
    Err(String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn what_does_not_fit_does_not_compile() {
    let folder = tempfile::tempdir().expect("a folder");
    let fails = |policy: &[u8], check: &str, message: &str| {
        let said = compile(folder.path(), policy, check).expect_err(message);
        assert!(said.contains(message), "no {message:?} in: {said}");
    };
    let agent = "tpg_runtime::policy!(pub mod champion = super::BLOB);";
    let available = |words: usize| {
        format!(
            "{agent}\nconst AVAILABLE: Capacities = Capacities {{ words: {words}, ..NEEDED }};\n\
             const _: () = NEEDED.assert_fits(&AVAILABLE);"
        )
    };
    let words = NEEDED.words;
    let message = format!("policy needs words = {words}, available are {}", words - 1);
    fails(BLOB, &available(words - 1), &message);
    fails(b"TPG", agent, "3 bytes are fewer than a header's 72");
    fails(&[b'x'; 100], agent, "the file does not begin with TPGB");
    let mut newer = BLOB.to_vec();
    newer[4] = 9;
    let versions = "the file has format version 9, this build reads versions 1 to 3";
    fails(&newer, agent, versions);
    let cut = &BLOB[..BLOB.len() - 5];
    let lengths = format!(
        "its header announces {} bytes, the file has {}",
        BLOB.len(),
        cut.len()
    );
    fails(cut, agent, &lengths);
    compile(folder.path(), BLOB, &available(words)).expect("what fits compiles");
    let decide = |inputs: &str| {
        format!(
            "{agent}\npub fn f(agent: &mut champion::Agent<'_>) {{ agent.decide(&[0.0; {inputs}]); }}"
        )
    };
    fails(BLOB, &decide("champion::INPUTS + 1"), "expected an array");
    compile(folder.path(), BLOB, &decide("champion::INPUTS")).expect("the right length compiles");
}
