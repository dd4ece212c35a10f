//! A policy that needs a group of instructions which this build leaves out is refused, and says which feature it needs.
//!
//! With every group built, the golden policies load; `cargo test -p tpg-runtime --no-default-features --features classic
//! --test groups` shows the refusals.

use tpg_runtime::isa::Group;
use tpg_runtime::{Blob, Policy, VerifyError};

const GOLDEN: [&[u8]; 5] = [
    include_bytes!("golden/classic.tpg"),
    include_bytes!("golden/copies.tpg"),
    include_bytes!("golden/reactive.tpg"),
    include_bytes!("golden/team-memory.tpg"),
    include_bytes!("golden/zero.tpg"),
];

#[test]
fn a_policy_loads_where_its_groups_are_built() {
    for bytes in GOLDEN {
        let blob = Blob::decode(bytes).expect("a golden policy");
        let header = blob.header();
        let missing = Group::ALL
            .into_iter()
            .find(|group| header.groups & group.bit() != 0 && !group.is_built());
        match (Policy::load(bytes), missing) {
            (Ok(_), None) => {}
            (Err(error), Some(group)) => {
                let feature = group.feature();
                assert_eq!(error, VerifyError::Unsupported { feature });
                assert!(error.to_string().contains(feature.name()), "{error}");
            }
            (loaded, missing) => panic!("{missing:?} is missing, loaded: {}", loaded.is_ok()),
        }
    }
}

#[test]
fn a_policy_with_a_front_end_loads_where_those_are_built() {
    for bytes in [
        include_bytes!("golden/standardised.tpg").as_slice(),
        include_bytes!("golden/believed-cubic.tpg"),
    ] {
        let loaded = Policy::load(bytes);
        if cfg!(not(feature = "front-end")) {
            let error = loaded.expect_err("a front end");
            assert!(matches!(error, VerifyError::Unsupported { .. }), "{error}");
            assert!(error.to_string().contains("feature"), "{error}");
        } else if cfg!(feature = "all-operations") {
            assert!(loaded.is_ok());
        }
    }
}

#[test]
fn a_policy_with_a_history_loads_where_those_are_built() {
    let loaded = Policy::load(include_bytes!("golden/history.tpg"));
    if cfg!(not(feature = "history")) {
        let error = loaded.expect_err("a history");
        assert!(matches!(error, VerifyError::Unsupported { .. }), "{error}");
        // Its instructions are scalar ones, and those are looked at first.
        let missing = match cfg!(feature = "scalar") {
            true => "`history`",
            false => "`scalar`",
        };
        assert!(error.to_string().contains(missing), "{error}");
    } else if cfg!(feature = "all-operations") {
        assert!(loaded.is_ok());
    }
}

#[test]
fn a_policy_with_programs_for_each_output_loads_where_those_are_built() {
    let loaded = Policy::load(include_bytes!("golden/each.tpg"));
    if cfg!(not(feature = "action-programs")) {
        let error = loaded.expect_err("programs for each output");
        assert!(matches!(error, VerifyError::Unsupported { .. }), "{error}");
        assert!(error.to_string().contains("feature"), "{error}");
    } else if cfg!(feature = "all-operations") {
        assert!(loaded.is_ok());
    }
}

#[test]
fn the_default_build_has_every_group() {
    let all = Group::ALL.into_iter().all(Group::is_built);
    assert_eq!(all, cfg!(feature = "all-operations"));
}
