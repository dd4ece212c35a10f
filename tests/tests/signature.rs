//! Signed policies: what is signed, what is forged, and what a board with a key takes.

#[path = "slots/board.rs"]
mod board;

use std::fs;

use board::{BUILT_IN, Board, policies, provenance, sealed};
use tpg_board::serial::Rules;
use tpg_board::sim::SimFlash;
use tpg_runtime::signature::{PUBLIC_PREFIX, SignatureError, parse_key, verify};
use tpg_runtime::wire::{Refusal, Request, Signed, SlotState};
use tpg_runtime::{Blob, Policy};
use tpg_tests::golden;
use tpg_tests::process::{stderr, text, tpg, tpg_json, tpg_ok};
use tpg_tools::signature::{SecretKey, sign};

/// RFC 8032, section 7.1, test 1.
const SECRET: &str = "9d61b19deffd5a60ba844af492ec2cc44449c5697b326919703bac031cae7f60";
const PUBLIC: &str = "d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a";
/// Room for a signed policy in each slot.
const FLASH: usize = 4096;

fn secret() -> SecretKey {
    SecretKey::parse(format!("tpg-ed25519-secret {SECRET}\n").as_bytes()).expect("a key")
}

fn public() -> [u8; 32] {
    parse_key(format!("{PUBLIC_PREFIX}{PUBLIC}").as_bytes(), PUBLIC_PREFIX).expect("a key")
}

fn signed(file: &[u8], release: u32) -> Vec<u8> {
    let policy = Policy::load(file).expect("valid");
    sign(&policy, &secret(), Some(release)).expect("small")
}

fn verified(file: &[u8], key: &[u8; 32]) -> Result<(), SignatureError> {
    verify(&Blob::decode(file).expect("a whole file"), key)
}

/// The bytes of `minimal.tpg`, as the specification prints them.
fn minimal() -> Vec<u8> {
    let page = include_str!("../../docs/format-3.md");
    let begin = page.find("**`minimal.tpg`**").expect("the example");
    let block = page[begin..].split("```").nth(1).expect("its bytes");
    let byte = |text: &str| u8::from_str_radix(text, 16).expect("a byte");
    (block.lines().skip(1))
        .flat_map(|line| line.split_whitespace().skip(1).map(byte))
        .collect()
}

#[test]
fn the_file_of_the_specification_is_signed_as_it_says() {
    assert_eq!(secret().public(), public());
    let minimal = minimal();
    assert_eq!(minimal.len(), 212);
    let file = signed(&minimal, 0);
    assert_eq!(file.len(), 300);
    let digits: String = (file[232..296].iter())
        .map(|byte| format!("{byte:02x}"))
        .collect();
    let page = include_str!("../../docs/format-3.md");
    assert!(page.contains(&digits), "{digits}");
    let golden = golden::path("v3/signed.tpg");
    if std::env::var("TPG_ACCEPT").is_ok() {
        fs::write(&golden, &file).expect("written");
    }
    assert_eq!(file, fs::read(golden).expect("a golden file"));
    assert_eq!(verified(&file, &public()), Ok(()));
    assert_eq!(verified(&minimal, &public()), Err(SignatureError::Unsigned));
}

#[test]
fn every_forged_bit_is_refused() {
    let file = signed(BUILT_IN, 7);
    let policy = Policy::load(&file).expect("valid");
    assert_eq!(policy.header().release, 7);
    assert_eq!(verified(&file, &public()), Ok(()));
    for at in 0..file.len() - 4 {
        let mut forged = file.clone();
        forged[at] ^= 1 << (at % 8);
        // With the checksum mended, only the signature tells.
        if let Ok(blob) = Blob::decode(&sealed(forged)) {
            assert!(verify(&blob, &public()).is_err(), "byte {at}");
        }
    }
    let mut other = public();
    other[31] ^= 1;
    assert_ne!(verified(&file, &other), Ok(()));
    other[0] ^= 1;
    let begin = public()[..8].try_into().expect("8 bytes");
    assert_eq!(
        verified(&file, &other),
        Err(SignatureError::OtherKey(begin))
    );
}

#[test]
fn a_board_with_a_key_takes_what_its_owner_signed_and_nothing_else() {
    let rules = Rules {
        key: Some(public()),
        ..Rules::DEFAULT
    };
    let [a, b, _] = policies();
    let (flash, stranger) = (SimFlash::new(FLASH), SecretKey::generate().expect("random"));
    let mut board = Board::start_by(rules, &flash);
    board.update(&signed(&a, 0)).expect("signed");
    board.session.confirm().expect("working memory");
    let slot = board.slot(1).expect("a slot");
    assert_eq!(
        (slot.state, slot.signed),
        (SlotState::Confirmed, Signed::Verified)
    );
    assert_eq!(board.slot(0).expect("a slot").signed, Signed::No);
    let by_another = sign(&Policy::load(&b).expect("valid"), &stranger, None).expect("small");
    let mut forged = signed(&b, 0);
    let last_of_provenance = 71;
    forged[last_of_provenance] ^= 1;
    for (file, detail) in [(b.clone(), 0), (by_another, 1), (sealed(forged), 2)] {
        assert_eq!(board.update(&file), Err((Refusal::Signature, detail)));
        assert_eq!(board.running(), provenance(&a));
    }
    // Whoever stored a policy past the updater, or before the firmware had this key.
    let mut open = Board::start(&flash);
    open.update(&b).expect("no key, no signature");
    open.session.confirm().expect("working memory");
    assert_eq!(open.slot(2).expect("a slot").signed, Signed::No);
    let mut board = Board::start_by(rules, &flash);
    assert_eq!(board.running(), provenance(&a), "verified at each start");
    assert_eq!(board.slot(2).expect("a slot").state, SlotState::Unusable);
    board.update(&signed(&b, 0)).expect("signed");
    assert_eq!(board.running(), provenance(&b));
}

#[test]
fn a_board_that_compares_releases_refuses_lower_ones() {
    let rules = Rules {
        releases: true,
        ..Rules::DEFAULT
    };
    let [a, b, _] = policies();
    let flash = SimFlash::new(FLASH);
    let mut board = Board::start_by(rules, &flash);
    // One that is not confirmed does not count.
    board.update(&signed(&a, 9)).expect("newer");
    board.update(&signed(&a, 5)).expect("newer");
    board.session.confirm().expect("working memory");
    let used = flash.used();
    assert_eq!(board.update(&signed(&b, 4)), Err((Refusal::Release, 5)));
    assert_eq!(flash.used(), used, "nothing is written");
    board.update(&signed(&b, 5)).expect("equal");
    board.session.confirm().expect("working memory");
    assert_eq!(board.slot(2).expect("a slot").release, 5);
    // A host that announces another number is found out.
    let lower = signed(&a, 4);
    let begin = Request::Begin {
        bytes: lower.len() as u32,
        contract: tpg_runtime::wire::contract_of(&lower),
        release: 6,
        forced: true,
    };
    board.step(begin).expect("it says 6");
    for (k, bytes) in lower.chunks(64).enumerate() {
        let at = 64 * k as u32;
        board.step(Request::Store { at, bytes }).expect("in order");
    }
    assert_eq!(board.step(Request::Commit), Err((Refusal::Release, 5)));
}

#[test]
fn the_command_makes_keys_signs_and_verifies() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let (key, public, out) = (path("key"), path("key.pub"), path("signed.tpg"));
    let (key, public, out) = (text(&key), text(&public), text(&out));
    tpg_ok(&["keygen", key]);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        let mode = fs::metadata(key).expect("a file").permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
    }
    let again = tpg(["keygen", key]);
    assert_eq!(again.status.code(), Some(2), "{again:?}");
    let file = golden::path("champions/hopper-sr-sm-b23.tpg");
    let file = text(&file);
    let report = tpg_json(&[
        "sign",
        file,
        "--key",
        key,
        "--out",
        out,
        "--release",
        "3",
        "--json",
    ]);
    assert_eq!(report["release"], 3);
    let report = tpg_json(&["sign", out, "--verify", public, "--json"]);
    assert_eq!(
        (&report["verified"], &report["release"]),
        (&true.into(), &3.into())
    );
    for (arguments, status, said) in [
        (&["sign", file, "--verify", public][..], 3, "is not signed"),
        (&["sign", out, "--verify", key], 3, "no public key"),
        (
            &["sign", file, "--key", public, "--out", out],
            3,
            "no secret key",
        ),
        (&["sign", file, "--key", key], 2, "--out"),
        (&["sign", file], 2, "--key"),
    ] {
        let output = tpg(arguments);
        assert_eq!(
            output.status.code(),
            Some(status),
            "{arguments:?}: {output:?}"
        );
        assert!(stderr(&output).contains(said), "{arguments:?}: {output:?}");
    }
}
