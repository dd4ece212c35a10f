//! The file format: pinned, and refusing whatever is not exactly a policy.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;

use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};
use tpg_runtime::blob::{
    ActionKind, DecodeError, InitialValues, MemoryModel, Missing, RegisterMode, ResetScope,
    WriteDistribution,
};
use tpg_runtime::isa::{EDITIONS, FINGERPRINT, Group, Op};
use tpg_runtime::parts::Field;
use tpg_runtime::{Blob, Policy, Reset, VerifyError};
use tpg_tests::draft::TestAgent;
use tpg_tests::{golden, mend, samples};

/// The samples' names and blobs.
fn samples() -> Vec<(&'static str, Vec<u8>)> {
    let samples = [
        samples::all(),
        samples::perceiving(),
        samples::large(),
        samples::remembering(),
    ];
    let samples = samples.into_iter().flatten();
    samples.map(|(name, s)| (name, s.encode())).collect()
}

/// Blobs of all versions: the samples, and the same as files of versions 1 and 2.
fn blobs() -> Vec<(&'static str, Vec<u8>)> {
    let read = |version: u16, name: &'static str| {
        let path = golden::path(&format!("v{version}/{name}.tpg"));
        (name, fs::read(path).expect("a golden file"))
    };
    let old = samples::perceiving()
        .into_iter()
        .map(|(name, _)| read(2, name));
    let older = samples::old_names().map(|name| read(1, name));
    samples().into_iter().chain(old).chain(older).collect()
}

/// The first word of an error's debug form: its variant.
fn variant(error: impl std::fmt::Debug) -> String {
    let text = format!("{error:?}");
    let end = text.find([' ', '(']).unwrap_or(text.len());
    text[..end].to_owned()
}

#[test]
fn samples_are_the_golden_files_of_their_versions() {
    for (name, blob) in samples() {
        let version = blob[4];
        golden::assert_bytes(&format!("v{version}/{name}.tpg"), &blob);
        let policy = Policy::load(&blob).unwrap_or_else(|error| panic!("{name}: {error}"));
        let mut agent = TestAgent::new(policy).expect("enough room");
        let observation = vec![0.5; usize::from(policy.header().observation_len)];
        let decision = agent.decide(&observation).expect("right length");
        assert!(decision.instructions > 0, "{name}");
        let mut mended = blob.clone();
        mend(&mut mended);
        assert_eq!(mended, blob, "{name}: the checksum is CRC-32 (IEEE)");
    }
    let mut code: Vec<Op> = samples::all()
        .iter()
        .flat_map(|(_, draft)| draft.programs[0].code.iter().map(|i| i.op))
        .collect();
    code.sort_unstable();
    code.dedup();
    assert_eq!(code, Op::ALL, "every operation occurs in a sample");
}

#[test]
fn every_truncation_and_trailing_byte_is_refused() {
    for (name, blob) in blobs() {
        for len in 0..blob.len() {
            match Blob::decode(&blob[..len]) {
                Err(DecodeError::Truncated { needed, got }) => {
                    assert!(got == len && needed > len, "{name}, {len}: {needed}, {got}");
                }
                other => panic!("{name} cut to {len} bytes: {other:?}"),
            }
        }
        let mut longer = blob.clone();
        for count in 1..=9 {
            longer.push(0);
            let error = Blob::decode(&longer).expect_err("trailing bytes");
            assert_eq!(error, DecodeError::TrailingBytes { count }, "{name}");
        }
        println!("{name}: {} truncations refused", blob.len());
    }
}

#[test]
fn every_single_bit_flip_is_refused() {
    for (name, mut blob) in blobs() {
        let mut counts: BTreeMap<String, usize> = BTreeMap::new();
        for bit in 0..blob.len() * 8 {
            blob[bit / 8] ^= 1 << (bit % 8);
            let error = Blob::decode(&blob).expect_err(name);
            assert!(!error.to_string().is_empty());
            *counts.entry(variant(error)).or_default() += 1;
            blob[bit / 8] ^= 1 << (bit % 8);
        }
        println!("{name}: {} flips refused: {counts:?}", blob.len() * 8);
        assert_eq!(counts.values().sum::<usize>(), blob.len() * 8);
    }
}

#[test]
fn other_versions_and_instruction_sets_name_both_sides_and_the_way_out() {
    let (_, blob) = blobs().swap_remove(0);
    let mut newer = blob.clone();
    newer[4..6].copy_from_slice(&7u16.to_le_bytes());
    mend(&mut newer);
    let error = Blob::decode(&newer).expect_err("version 7");
    assert_eq!(
        error,
        DecodeError::Version {
            file: 7,
            supported: 3
        }
    );
    let text = error.to_string();
    assert!(
        text.contains("version 7") && text.contains("versions 1 to 3") && text.contains("export")
    );
    let mut other = blob;
    other[8] ^= 1;
    mend(&mut other);
    let text = Blob::decode(&other).expect_err("other table").to_string();
    assert!(text.contains(&format!("{FINGERPRINT:08x}")) && text.contains("export"));
}

/// A file names the oldest edition that has its operations, and holds no others.
#[test]
fn a_file_has_no_operation_beyond_its_edition() {
    let [first, second] = EDITIONS.map(|edition| edition.fingerprint.to_le_bytes());
    for (name, blob) in samples() {
        let expected = if name == "copies" { second } else { first };
        assert_eq!(blob[8..12], expected, "{name}");
        let mut other = blob.clone();
        other[8..12].copy_from_slice(if name == "copies" { &first } else { &second });
        mend(&mut other);
        let loaded = Policy::load(&other).map(|_| ());
        if name == "copies" {
            let refused = VerifyError::Decode(DecodeError::HeaderField {
                field: Field::Groups,
            });
            assert_eq!(loaded, Err(refused));
            // Without the bit of their group, it is the code that is refused.
            other[52] &= !(Group::Copies.bit() as u8);
            mend(&mut other);
            let refused = VerifyError::Group {
                program: 0,
                instruction: 0,
            };
            assert_eq!(Policy::load(&other).map(|_| ()), Err(refused));
        } else {
            assert_eq!(
                loaded,
                Ok(()),
                "{name}: a newer edition has all older operations"
            );
        }
    }
    let (name, mut old) = blobs().pop().expect("a file of version 1");
    old[8..12].copy_from_slice(&second);
    mend(&mut old);
    let error = Blob::decode(&old).expect_err(name);
    assert!(
        matches!(error, DecodeError::InstructionSet { .. }),
        "{error}"
    );
}

/// A policy whose front end was put into the section and announced in the header, whatever they say.
fn with_front_end(announced: Option<u16>, section: &[u8]) -> Result<(), VerifyError> {
    let (_, mut draft) = samples::perceiving().swap_remove(2);
    draft.header.front_end = announced;
    draft.front_end = section.to_vec();
    Policy::load(&draft.encode()).map(|_| ())
}

#[test]
fn only_a_sound_front_end_that_the_header_announces_is_taken() {
    let (_, draft) = samples::perceiving().swap_remove(2);
    let (sound, words) = (draft.front_end, draft.header.front_end);
    assert_eq!(with_front_end(words, &sound), Ok(()));
    let malformed = Err(VerifyError::FrontEndMalformed);
    // Header and section must agree.
    assert_eq!(with_front_end(None, &sound), malformed);
    assert_eq!(with_front_end(words, &[]), malformed);
    let other = words.map(|words| words + 1);
    let error = with_front_end(other, &sound).expect_err("other words");
    assert!(
        matches!(
            error,
            VerifyError::Header {
                field: Field::FrontEndWords,
                ..
            } | VerifyError::FrontEndMalformed
                | VerifyError::Record { .. }
        ),
        "{error}"
    );
    let changed = |at: usize, value: u8| {
        let mut section = sound.clone();
        section[at] = value;
        with_front_end(words, &section)
    };
    let (inputs, columns) = (4, 8 + 2 * 4 * 4);
    for (at, value, what) in [
        (0, 3, "an unknown kind"),
        (0, 1, "a model of something that holds"),
        (1, 0, "no degree"),
        (1, 2, "fewer coefficients than the degree needs"),
        (1, 4, "a degree beyond the limit"),
        (2, 3, "fewer columns than there are"),
        (4, 0, "words that lie elsewhere"),
        (6, 1, "a reserved byte"),
        (8 + 3, 0xff, "a mean that is no number"),
        (8 + 4 * inputs + 3, 0xff, "a scale that is no number"),
        (columns + 2, 0, "a column twice"),
        (columns + 6, 9, "a column that does not exist"),
        (sound.len() - 1, 0x7f, "a coefficient that is no number"),
    ] {
        let mut changed = changed(at, value);
        if value == 0xff || value == 0x7f {
            // The exponent's last bit lies in the byte before.
            let mut section = sound.clone();
            (section[at - 1], section[at]) = (0x80, value);
            changed = with_front_end(words, &section);
        }
        assert_eq!(changed, malformed, "{what}");
    }
    for len in 1..sound.len() {
        assert_eq!(
            with_front_end(words, &sound[..len]),
            malformed,
            "{len} bytes"
        );
    }
    let longer = [&sound[..], &[0; 4]].concat();
    assert_eq!(with_front_end(words, &longer), malformed);
}

/// What became of a blob with changed bytes and a right checksum.
fn load_and_decide(blob: &[u8], observed: f32) -> Result<&'static str, TestCaseError> {
    let policy = match Policy::load(blob) {
        Ok(policy) => policy,
        Err(VerifyError::Decode(_)) => return Ok("refused when decoded"),
        Err(error) => {
            prop_assert!(!error.to_string().is_empty());
            return Ok("refused when verified");
        }
    };
    let Ok(mut agent) = TestAgent::new(policy) else {
        return Ok("too large for the agent");
    };
    let observation = vec![observed; usize::from(policy.header().observation_len)];
    for (round, what) in [Reset::Agent, Reset::Episode].into_iter().enumerate() {
        agent.reset(what, round as u64);
        for _ in 0..3 {
            let decision = agent.decide(&observation).expect("right length");
            prop_assert!(decision.instructions <= policy.bounds().instructions);
            prop_assert!(decision.teams <= policy.bounds().teams);
        }
        prop_assert!(agent.words().iter().all(|x| x.is_finite()));
    }
    Ok("decided within its bounds")
}

#[test]
fn changed_tables_are_refused_or_decide_within_their_bounds() {
    let blobs = blobs();
    let config = Config {
        cases: 30_000,
        failure_persistence: None,
        ..Config::default()
    };
    let mut runner =
        TestRunner::new_with_rng(config.clone(), TestRunner::deterministic().rng().clone());
    let edits = prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4);
    let strategy = (0..blobs.len(), edits, prop::num::f32::ANY);
    let counts = std::cell::RefCell::new(BTreeMap::<&str, usize>::new());
    let result = runner.run(&strategy, |(sample, edits, observed)| {
        let mut blob = blobs[sample].1.clone();
        let covered = blob.len() - 4;
        for (index, byte) in edits {
            blob[index.index(covered)] = byte;
        }
        mend(&mut blob);
        let end = load_and_decide(&blob, observed)?;
        *counts.borrow_mut().entry(end).or_default() += 1;
        Ok(())
    });
    println!("{} changed blobs: {:?}", config.cases, counts.borrow());
    if let Err(error) = result {
        panic!("{error}");
    }
}

/// Every byte of the header and of each record, set to its extremes.
#[test]
fn extreme_bytes_never_panic() {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for (_, blob) in blobs() {
        for at in 0..blob.len() - 4 {
            for byte in [0, 1, 0x7f, 0x80, 0xff] {
                let mut changed = blob.clone();
                changed[at] = byte;
                mend(&mut changed);
                let end = load_and_decide(&changed, 1.0).expect("within bounds");
                *counts.entry(end).or_default() += 1;
            }
        }
    }
    println!("bytes set to their extremes: {counts:?}");
}

fn write_op(text: &mut String, op: Op) {
    let [a, b] = op.operands();
    let (code, name, destination) = (op as u8, op.mnemonic(), op.destination());
    let _ = writeln!(text, "Op {code} {name}: {destination:?} <- {a:?}, {b:?}");
}

#[test]
fn codes_are_pinned() {
    let mut text = String::from(
        "# Codes of format version 1. A changed or removed line is a new version; older builds refuse a code that they do not know.\n",
    );
    macro_rules! codes {
        ($($name:ident)*) => {$(
            for value in $name::ALL {
                let _ = writeln!(text, "{} {} {}", stringify!($name), *value as u16, value.name());
            }
        )*};
    }
    codes! { ActionKind RegisterMode InitialValues ResetScope MemoryModel WriteDistribution }
    // Lines are added at the end, so that the file shows what each edition added.
    for group in Group::ALL.iter().filter(|group| **group != Group::Copies) {
        let _ = writeln!(text, "Group {} {group:?}", group.bit());
    }
    for op in Op::ALL.iter().filter(|op| op.group() != Group::Copies) {
        write_op(&mut text, *op);
    }
    let [first, second] = EDITIONS.map(|edition| edition.fingerprint);
    let _ = writeln!(text, "fingerprint {first:08x}");
    codes! { Missing }
    let _ = writeln!(text, "edition 1 fingerprint {first:08x}");
    let _ = writeln!(text, "Group {} {:?}", Group::Copies.bit(), Group::Copies);
    for op in Op::ALL.iter().filter(|op| op.group() == Group::Copies) {
        write_op(&mut text, *op);
    }
    let _ = writeln!(text, "edition 2 fingerprint {second:08x}");
    golden::assert_text("isa.txt", &text);
}
