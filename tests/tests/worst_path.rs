//! A policy's worst path runs all its programs in every decision.

use std::fs;
use std::path::PathBuf;

use tpg_board::trial::Generator;
use tpg_runtime::blob::{encode, encoded_bound};
use tpg_runtime::{HostAgent, Policy, Reset};
use tpg_tests::firmware::{M4F, repository};
use tpg_tests::process::{stderr, text, tpg, tpg_json, tpg_ok};
use tpg_tests::{golden, graphs};
use tpg_tools::footprint::{Firmware, Profile};
use tpg_tools::worst_path::{worst_path, worst_path_without_code};

/// The champions of the documents and of the tests.
fn champions() -> Vec<PathBuf> {
    let folders = [
        repository().join("docs/champions"),
        golden::path("champions"),
    ];
    let mut files: Vec<_> = (folders.iter())
        .flat_map(|folder| fs::read_dir(folder).expect("a folder"))
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "tpg"))
        .collect();
    files.sort();
    files
}

/// The policy instructions of some decisions: least and most.
fn instructions(bytes: &[u8]) -> (u32, u32) {
    let policy = Policy::load(bytes).unwrap_or_else(|error| panic!("{error}"));
    let mut agent = Box::new(HostAgent::new(policy).expect("fits"));
    agent.reset(Reset::Agent, 1);
    let mut observation = vec![0.0; usize::from(policy.header().observation_len)];
    let mut generator = Generator::new(3);
    let mut seen = (u32::MAX, 0);
    for _ in 0..100 {
        generator.observe(&mut observation);
        let decision = agent.decide(&observation).expect("the right length");
        seen.0 = seen.0.min(decision.instructions);
        seen.1 = seen.1.max(decision.instructions);
    }
    seen
}

#[test]
fn the_worst_path_runs_every_program() {
    let mut policies = graphs::all();
    policies.extend(
        champions()
            .iter()
            .map(|path| fs::read(path).expect("a file")),
    );
    let mut longer = 0;
    for (number, bytes) in policies.iter().enumerate() {
        let policy = Policy::load(bytes).expect("valid");
        let code = policy.tables().code.len() as u32;
        let (_, most) = instructions(bytes);
        let (least, worst) = instructions(&worst_path(&policy).expect("encodes"));
        let (_, bare) = instructions(&worst_path_without_code(&policy).expect("encodes"));
        assert!(least >= code, "policy {number}: {least} of {code}");
        assert!(worst >= most, "policy {number}: {worst}, {most} seen");
        // What a front end multiplies, by what is missing, counts too.
        if policy.front_end().is_none() {
            assert_eq!((least, worst, bare), (code, code, 0), "policy {number}");
        }
        // The worst path has version 3, where single elements can be missing: the front end of an older file does less.
        if policy.header().has_missing_values() || policy.front_end().is_none() {
            let bound = policy.bounds().instructions;
            assert!(bare + code <= bound, "policy {number}: {bare} + {code}");
            assert!(worst <= bound, "policy {number}: {worst} of {bound}");
        }
        longer += usize::from(worst > most);
    }
    assert!(longer >= 10, "{longer} policies have a longer worst path");
}

#[test]
fn no_decision_takes_more_than_the_costs_of_operations_allow() {
    if !M4F.is_available() {
        return;
    }
    let firmware = Firmware::find(Some(&repository().join("firmware-examples"))).expect("sources");
    let champions = champions();
    assert!(champions.len() >= 10, "{champions:?}");
    for path in champions {
        let costs = firmware.costs(&M4F, Profile::Size, &path).expect("counts");
        let name = path.file_name().expect("a name").display();
        let [bound, worst_path, seen] = [
            costs.machine_instructions_bound,
            costs.machine_instructions_worst_path,
            costs.machine_instructions_seen,
        ];
        println!("{name}: bound {bound}, worst path {worst_path}, seen {seen}");
        assert!(bound >= seen && bound >= worst_path, "{name}: {costs:?}");
        // A bound that says nothing would hold too.
        assert!(bound <= 3 * worst_path, "{name}: {costs:?}");
    }
}

#[test]
fn a_deadline_is_met_or_not() {
    if !M4F.is_available() {
        return;
    }
    let file = golden::path("champions/hopper-sr-sm-b23.tpg");
    let folder = repository().join("firmware-examples");
    let common = ["footprint", text(&file), "--firmware", text(&folder)];
    let fast = tpg_json(&[&common[..], &["--deadline-mhz", "168", "--json"]].concat());
    let deadline = &fast["deadlines"][0];
    let number = |key: &str| {
        deadline[key]
            .as_f64()
            .unwrap_or_else(|| panic!("{key}: {fast}"))
    };
    assert_eq!(deadline["met"], true, "{fast}");
    let cycles = 2.0 * number("machine_instructions");
    assert!((number("estimate_us") - cycles / 168.0).abs() < 1e-6);
    let seen = &fast["targets"][0]["machine_instructions_worst_seen"];
    assert!(number("machine_instructions") >= seen.as_f64().expect("a number"));
    let slow = tpg([&common[..], &["--deadline-mhz", "1"]].concat());
    let said = String::from_utf8(slow.stdout).expect("text");
    assert_eq!(slow.status.code(), Some(5), "{said}");
    assert!(said.contains("an estimate: NOT MET"), "{said}");
}

#[test]
fn what_a_deadline_lacks_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("timeless.tpg");
    let cartpole = fs::read(repository().join("docs/champions/cartpole.tpg")).expect("a file");
    let cartpole = Policy::load(&cartpole).expect("valid");
    let mut header = *cartpole.header();
    header.control_period_us = 0;
    let mut timeless = vec![0; encoded_bound(cartpole.tables())];
    encode(&header, cartpole.tables(), &mut timeless).expect("the bound is enough");
    fs::write(&file, timeless).expect("written");
    let output = tpg(["footprint", text(&file), "--deadline-mhz", "100"]);
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("--period-us"), "{message}");
    for wrong in ["0", "-1", "nan", "fast"] {
        let output = tpg(["footprint", text(&file), &format!("--deadline-mhz={wrong}")]);
        assert_eq!(
            output.status.code(),
            Some(2),
            "{wrong}: {}",
            stderr(&output)
        );
    }
}

/// The files beside the examples, for their program `cycles`.
#[test]
fn the_examples_worst_path_is_that_of_their_champion() {
    let folder = repository().join("firmware-examples");
    let made = tempfile::NamedTempFile::new().expect("a file");
    let champion = folder.join("champion.tpg");
    tpg_ok(&[
        "footprint",
        text(&champion),
        "--worst-path",
        text(made.path()),
    ]);
    let committed = fs::read(folder.join("champion-worst-path.tpg")).expect("a file");
    assert_eq!(fs::read(made.path()).expect("written"), committed);
}
