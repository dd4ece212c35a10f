//! `tpg convert`: old files in the newest format decide as before, and know their contract.

use std::fs;
use std::path::Path;

use tpg_runtime::{Header, HostAgent, Policy, Reset};
use tpg_tests::process::{stderr, text, tpg, tpg_json, tpg_ok};
use tpg_tests::random::Dice;
use tpg_tests::{golden, old_format, samples};

fn champion(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../docs/champions/{name}.tpg"))
}

#[test]
fn champions_decide_the_same_bits_and_get_a_contract() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("new.tpg");
    for name in ["cartpole", "hopper-b23", "half-cheetah-b23"] {
        let old = fs::read(champion(name)).expect("a champion");
        let said = tpg_json(&[
            "convert",
            text(&champion(name)),
            "--out",
            text(&out),
            "--json",
        ]);
        let new = fs::read(&out).expect("written");
        let [before, after] = [&old, &new].map(|bytes| Policy::load(bytes).expect("a policy"));
        assert!(before.header().version < 3);
        assert_eq!(said["from_version"], before.header().version);
        assert_eq!(
            (said["version"].as_u64(), after.header().version),
            (Some(3), 3)
        );
        assert_eq!(said["bytes"], new.len());
        assert_eq!(after.header().contract, before.contract());
        assert_eq!(said["contract"], format!("{:016x}", before.contract()));
        assert_eq!(after.header().provenance, before.header().provenance);
        let [mut one, mut other] = [before, after].map(|policy| {
            let mut agent = Box::new(HostAgent::new(policy).expect("room"));
            agent.reset(Reset::Agent, 9);
            agent
        });
        let mut dice = Dice::new(3);
        let inputs = usize::from(before.header().observation_len);
        for step in 0..300 {
            let observation: Vec<f32> = match step % 4 {
                0 => vec![f32::NAN; inputs],
                _ => (0..inputs).map(|_| dice.number() + 0.001).collect(),
            };
            let decision = format!("{:?}", one.decide(&observation));
            assert_eq!(
                decision,
                format!("{:?}", other.decide(&observation)),
                "{name}, {step}"
            );
            if step % 100 == 99 {
                one.reset(Reset::Episode, step);
                other.reset(Reset::Episode, step);
            }
        }
        let bits = |agent: &HostAgent<'_>| {
            agent
                .words()
                .iter()
                .map(|x| x.to_bits())
                .collect::<Vec<_>>()
        };
        assert_eq!(bits(&one), bits(&other), "{name}");
    }
}

/// Episodes with blackouts: tasks send what is missing as NaN, so both files score the same.
#[test]
fn a_champion_scores_the_same_episodes() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("new.tpg");
    let old = golden::path("champions/cartpole-sr-sm-b23.tpg");
    tpg_ok(&["convert", text(&old), "--out", text(&out)]);
    let score = |file: &Path| {
        let report = tpg_json(&[
            "eval",
            text(file),
            "--episodes",
            "5",
            "--seed",
            "4",
            "--json",
        ]);
        report["returns"].clone()
    };
    assert_eq!(score(&old), score(&out));
}

#[test]
fn a_front_end_of_version_2_is_told_what_changes() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("new.tpg");
    let note = "whoever sent zeros for a lost one sends NaN";
    let output = tpg([
        "convert",
        text(&champion("hopper-b23")),
        "--out",
        text(&out),
    ]);
    assert!(stderr(&output).contains(note), "{}", stderr(&output));
    let output = tpg(["convert", text(&champion("cartpole")), "--out", text(&out)]);
    assert_eq!(stderr(&output), "");
}

#[test]
fn a_file_of_the_newest_version_is_copied_with_its_signature() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("copy.tpg");
    let signed = golden::path("v3/signed.tpg");
    let output = tpg_ok(&["convert", text(&signed), "--out", text(&out)]);
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.contains("has version 3 already"), "{said}");
    assert_eq!(
        fs::read(&signed).expect("there"),
        fs::read(&out).expect("copied")
    );
}

#[test]
fn what_cannot_be_converted_is_named_and_nothing_is_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let (file, out) = (folder.path().join("old.tpg"), folder.path().join("new.tpg"));
    // Version 1 allows a team that lists a program twice.
    let (_, mut draft) = samples::all().swap_remove(0);
    let first = draft.teams[0].members[0];
    draft.teams[0].members.push(first);
    let old = old_format(&draft.encode());
    assert_eq!(Header::peek(&old).map(|header| header.version), Some(1));
    fs::write(&file, old).expect("written");
    let refused = tpg(["convert", text(&file), "--out", text(&out)]);
    assert_eq!(refused.status.code(), Some(3));
    let said = stderr(&refused);
    assert!(
        said.contains("cannot convert") && said.contains("twice"),
        "{said}"
    );
    assert!(!out.exists());
    let missing = tpg([
        "convert",
        text(&folder.path().join("none.tpg")),
        "--out",
        text(&out),
    ]);
    assert_eq!(missing.status.code(), Some(3));
    let nowhere = folder.path().join("no/folder/new.tpg");
    let unwritable = tpg([
        "convert",
        text(&champion("cartpole")),
        "--out",
        text(&nowhere),
    ]);
    assert_eq!(unwritable.status.code(), Some(2));
    assert!(
        stderr(&unwritable).contains("no/folder"),
        "{}",
        stderr(&unwritable)
    );
}
