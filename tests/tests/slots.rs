//! Two slots for policies: wherever the power is cut while they change, the next start decides with a working policy.

#[path = "slots/board.rs"]
mod board;

use std::fs;

use board::{BUILT_IN, Board, policies, provenance, sealed};
use tpg_board::serial::{GOOD_PERIODS, Rules};
use tpg_board::sim::SimFlash;
use tpg_board::slots::Slots;
use tpg_runtime::Policy;
use tpg_runtime::blob::contract_bytes;
use tpg_runtime::hash::{START_64, fnv1a_64};
use tpg_runtime::wire::{self, Answer, Refusal, Request, SlotState};
use tpg_tests::golden;

const FLASH: usize = 2048;
/// Bytes that the erasure of a slot changes.
const ERASURE: u64 = FLASH as u64 / 2;
/// Bytes of a mark.
const MARK: u64 = 16;

/// The built-in policy with another control period, and so another contract.
fn slower() -> Vec<u8> {
    let mut file = BUILT_IN.to_vec();
    file[48..52].copy_from_slice(&50_000_u32.to_le_bytes());
    sealed(file)
}

/// Flash in which `files` were stored and confirmed, one after another.
fn flash_with(files: &[&[u8]]) -> SimFlash {
    let flash = SimFlash::new(FLASH);
    let mut board = Board::start(&flash);
    for file in files {
        board.update(file).expect("room for it");
        board.session.confirm().expect("working memory");
    }
    flash
}

#[test]
fn updates_alternate_between_the_slots() {
    let flash = SimFlash::new(FLASH);
    let mut board = Board::start(&flash);
    assert_eq!(board.identity().slot, 0);
    for (k, file) in policies().iter().enumerate() {
        board.update(file).expect("room for it");
        board.prove();
        assert_eq!(usize::from(board.identity().slot), 1 + k % 2);
        board = Board::start(&flash);
        assert_eq!(board.running(), provenance(file), "kept");
    }
}

/// Cuts the power at every byte that `change` erases or writes, and starts the board again. `allowed` tells which
/// policies may then be in use, from the place of the cut and from the number of bytes of the whole change.
fn cut_everywhere(
    files: &[&[u8]],
    change: impl Fn(&mut Board),
    allowed: impl Fn(u64, u64) -> Vec<[u8; 16]>,
) {
    let whole = {
        let flash = flash_with(files);
        let before = flash.used();
        change(&mut Board::start(&flash));
        flash.used() - before
    };
    assert!(whole >= ERASURE, "at least an erasure: {whole}");
    let [.., new] = policies();
    // A byte that is being changed when the power goes may read as anything: as before, as wanted, or as neither.
    let torn = [0xff, 0x5a, 0x00, 0x31];
    for (cut, torn) in (0..=whole).zip(torn.into_iter().cycle()) {
        let flash = flash_with(files);
        let mut board = Board::start(&flash);
        flash.tear(torn);
        flash.cut_after(cut);
        change(&mut board);
        // Even without power for the flash the board in operation decides.
        board.decide();
        flash.cut_after(u64::MAX);
        let mut board = Board::start(&flash);
        board.decide();
        let running = board.running();
        // A mark whose last byte is torn the right way is whole.
        let cut = cut + u64::from(torn == 0x5a && cut + 1 == whole);
        let allowed = allowed(cut, whole);
        assert!(
            allowed.contains(&running),
            "cut after {cut}: {running:?}, not {allowed:?}"
        );
        // And it can be updated once more.
        board
            .update(&new)
            .unwrap_or_else(|e| panic!("cut after {cut}: {e:?}"));
        board.session.confirm().expect("working memory");
        assert_eq!(Board::start(&flash).running(), provenance(&new));
    }
}

#[test]
fn an_update_cut_at_any_byte_leaves_the_old_policy_until_the_new_one_is_confirmed() {
    let [old, new, _] = policies();
    let update = |board: &mut Board| {
        let _ = board.update(&new);
        let _ = board.session.confirm();
    };
    cut_everywhere(&[&old], update, |cut, whole| {
        let file = if cut < whole { &old } else { &new };
        vec![provenance(file)]
    });
}

#[test]
fn an_update_over_an_unconfirmed_policy_cut_at_any_byte_leaves_the_confirmed_one() {
    let [old, wrong, new] = policies();
    let update = |board: &mut Board| {
        board.update(&wrong).unwrap_or_default();
        let _ = board.update(&new);
        let _ = board.session.confirm();
    };
    cut_everywhere(&[&old], update, |cut, whole| {
        let file = if cut < whole { &old } else { &new };
        vec![provenance(file)]
    });
}

#[test]
fn a_revert_cut_at_any_byte_leaves_one_of_the_two_policies() {
    let [old, new, _] = policies();
    let revert = |board: &mut Board| {
        let _ = board.step(Request::Revert);
    };
    cut_everywhere(&[&old, &new], revert, |cut, whole| {
        let (old, new) = (provenance(&old), provenance(&new));
        if cut == whole {
            vec![old]
        } else {
            vec![old, new]
        }
    });
}

#[test]
fn an_erasure_of_both_slots_cut_at_any_byte_leaves_a_working_policy() {
    let [old, new, _] = policies();
    let erase = |board: &mut Board| {
        for number in [1, 2] {
            let _ = board.step(Request::Erase { number });
        }
    };
    cut_everywhere(&[&old, &new], erase, |cut, whole| {
        let (new, built_in) = (provenance(&new), provenance(BUILT_IN));
        if cut == whole {
            vec![built_in]
        } else {
            vec![new, built_in]
        }
    });
}

#[test]
fn an_unconfirmed_policy_is_reverted_at_the_next_start() {
    let [old, new, _] = policies();
    for cut in 0..2 * MARK {
        let flash = flash_with(&[&old]);
        let mut board = Board::start(&flash);
        board.update(&new).expect("room for it");
        flash.cut_after(cut);
        board.prove();
        flash.cut_after(u64::MAX);
        for _ in 0..3 {
            let mut board = Board::start(&flash);
            board.decide();
            // Only a whole mark confirms.
            let expected = if cut < MARK { &old } else { &new };
            assert_eq!(board.running(), provenance(expected), "cut after {cut}");
        }
    }
}

#[test]
fn only_good_periods_in_a_row_confirm() {
    let [old, new, _] = policies();
    let flash = flash_with(&[&old]);
    let mut board = Board::start(&flash);
    board.update(&new).expect("room for it");
    let state = |board: &mut Board| board.slot(2).expect("a slot").state;
    for _ in 1..GOOD_PERIODS {
        board.decide();
    }
    let refused = board.step(Request::Observe { values: &[0; 40] });
    assert_eq!(refused, Err((Refusal::Length, 10)));
    board.decide();
    assert_eq!(state(&mut board), SlotState::Unconfirmed);
    for _ in 1..GOOD_PERIODS {
        board.decide();
    }
    assert_eq!(state(&mut board), SlotState::Confirmed);
    // An application that judges for itself.
    let rules = Rules {
        confirm_after: u32::MAX,
        ..Rules::DEFAULT
    };
    let mut board = Board::start_by(rules, &flash);
    board.update(&old).expect("room for it");
    board.prove();
    let slot = board.slot(1).expect("a slot");
    assert_eq!((slot.state, slot.in_use), (SlotState::Unconfirmed, true));
    board.session.confirm().expect("working memory");
    assert_eq!(Board::start(&flash).running(), provenance(&old));
}

#[test]
fn the_way_back_is_open_at_once() {
    let [old, wrong, new] = policies();
    let flash = flash_with(&[&old]);
    let mut board = Board::start(&flash);
    board.update(&wrong).expect("room for it");
    board.step(Request::Revert).expect("a policy before it");
    assert_eq!(board.running(), provenance(&old));
    // In place of a revert, the next update.
    board.update(&wrong).expect("room for it");
    board.update(&new).expect("room for it");
    board.prove();
    assert_eq!(board.running(), provenance(&new));
    // A confirmed policy can be reverted too, down to the built-in one.
    for expected in [&old[..], BUILT_IN] {
        board.step(Request::Revert).expect("a policy before it");
        assert_eq!(board.running(), provenance(expected));
        assert_eq!(Board::start(&flash).running(), provenance(expected));
    }
    assert_eq!(board.step(Request::Revert), Err((Refusal::Oldest, 0)));
}

#[test]
fn a_policy_for_another_robot_is_refused_forced_and_reverted() {
    let [old, new, _] = policies();
    let other = slower();
    let flash = flash_with(&[&old]);
    let mut board = Board::start(&flash);
    let used = flash.used();
    assert_eq!(board.update(&other), Err((Refusal::Robot, 0)));
    assert_eq!(flash.used(), used, "nothing is written");
    board.update_by(&other, true).expect("forced");
    // The confirmed policy is what a new one is compared with, so the way back needs no force.
    board.update(&new).expect("the robot's own");
    board.update_by(&other, true).expect("forced");
    board.step(Request::Revert).expect("a policy before it");
    assert_eq!(board.running(), provenance(&old));
    // A host that announces one contract and sends another is found out before the slot counts.
    let announced = board.step(Request::Begin {
        bytes: other.len() as u32,
        contract: wire::contract_of(&old),
        release: 0,
        forced: false,
    });
    assert_eq!(announced, Ok(()));
    for (k, bytes) in other.chunks(64).enumerate() {
        let at = 64 * k as u32;
        board.step(Request::Store { at, bytes }).expect("in order");
    }
    let refused = board.step(Request::Commit);
    assert!(
        matches!(refused, Err((Refusal::Announced, _))),
        "{refused:?}"
    );
    assert_eq!(board.running(), provenance(&old));
}

#[test]
fn the_contract_is_read_in_parts() {
    let mut board = Board::start(&SimFlash::new(FLASH));
    let mut expected: Vec<u8> = Vec::new();
    let policy = Policy::load(BUILT_IN).expect("valid");
    contract_bytes(policy.header(), policy.tables(), |part| {
        expected.extend(part);
    });
    let mut read = Vec::new();
    loop {
        let at = read.len() as u32;
        let (total, part) = board.ask(Request::Contract { at }, |answer| match answer {
            Answer::Contract { total, bytes } => (total, bytes.to_vec()),
            other => panic!("{other:?}"),
        });
        assert_eq!(total as usize, expected.len());
        if part.is_empty() {
            break;
        }
        read.extend(part);
    }
    assert_eq!(read, expected);
    assert_eq!(fnv1a_64(START_64, &read), wire::contract_of(BUILT_IN));
    let beyond = board.ask(Request::Contract { at: u32::MAX }, |answer| {
        matches!(answer, Answer::Contract { bytes: [], .. })
    });
    assert!(beyond);
}

#[test]
fn the_slots_are_listed_and_erased() {
    let [old, new, other] = policies();
    let flash = flash_with(&[&old]);
    let mut board = Board::start(&flash);
    board.update(&new).expect("room for it");
    let list = |board: &mut Board| {
        [0, 1, 2].map(|number| {
            let stored = board.slot(number).expect("a slot");
            (stored.state, stored.in_use, stored.bytes)
        })
    };
    let bytes = BUILT_IN.len() as u32;
    let built_in = |in_use| (SlotState::Confirmed, in_use, bytes);
    assert_eq!(
        list(&mut board),
        [
            built_in(false),
            (SlotState::Confirmed, false, bytes),
            (SlotState::Unconfirmed, true, bytes)
        ]
    );
    assert_eq!(board.slot(3), Err((Refusal::Slot, 3)));
    assert_eq!(
        board.step(Request::Erase { number: 0 }),
        Err((Refusal::Slot, 0))
    );
    // One that a start reverted is still listed, until something takes its place.
    let mut board = Board::start(&flash);
    let reverted = (SlotState::Unconfirmed, false, bytes);
    assert_eq!(list(&mut board)[2], reverted);
    for number in [2, 1] {
        board.step(Request::Erase { number }).expect("erased");
    }
    let empty = (SlotState::Empty, false, 0);
    assert_eq!(list(&mut board), [built_in(true), empty, empty]);
    assert_eq!(Board::start(&flash).running(), provenance(BUILT_IN));
    board.update(&other).expect("room for it");
    assert_eq!(board.running(), provenance(&other));
}

#[test]
fn what_is_wrong_is_refused_and_changes_nothing() {
    let [old, new, _] = policies();
    let flash = SimFlash::new(FLASH);
    let mut board = Board::start(&flash);
    assert_eq!(board.step(Request::Commit), Err((Refusal::Order, 0)));
    let room = FLASH as u32 / 2 - 32;
    let begin = |bytes| Request::Begin {
        bytes,
        contract: wire::contract_of(&old),
        release: 0,
        forced: false,
    };
    let too_long = begin(room + 1);
    assert_eq!(board.step(too_long), Err((Refusal::Room, room)));
    board.update(&old).expect("room for it");
    board.session.confirm().expect("working memory");
    let mut damaged = new.clone();
    damaged[100] ^= 1;
    let refused = board.update_by(&damaged, true);
    assert!(matches!(refused, Err((Refusal::Policy, _))), "{refused:?}");
    let other = fs::read(golden::path("champions/cartpole-sr-sm-b23.tpg")).expect("a champion");
    assert_eq!(board.update(&other), Err((Refusal::Robot, 0)));
    let forced = board.update_by(&other, true);
    assert!(matches!(forced, Err((Refusal::Capacity, _))), "{forced:?}");
    board.step(begin(100)).expect("room for it");
    let skipped = Request::Store {
        at: 64,
        bytes: &new[64..100],
    };
    assert_eq!(board.step(skipped), Err((Refusal::Order, 0)));
    board.decide();
    assert_eq!(board.identity().provenance, provenance(&old));
    assert_eq!(Board::start(&flash).identity().provenance, provenance(&old));
    // Without flash there are no updates, but the policy built in decides.
    assert_eq!(Slots::open(SimFlash::new(FLASH), |_, _| true).number(), 0);
}
