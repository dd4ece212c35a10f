//! The section of ranges in version 3: outputs are clamped, the contract has them, and what makes no sense is refused.

use tpg_runtime::blob::{self, contract_bytes};
use tpg_runtime::hash::{START_64, fnv1a_64};
use tpg_runtime::parts::Table;
use tpg_runtime::tables::Range;
use tpg_runtime::{Action, Policy, VerifyError};
use tpg_tests::draft::{Draft, TestAgent};
use tpg_tests::random::Dice;
use tpg_tests::samples;

#[test]
fn ranges_clamp_outputs_and_belong_to_the_contract() {
    for (name, draft) in samples::large() {
        let Some(found) = draft
            .ranges
            .get(usize::from(draft.header.observation_len)..)
        else {
            continue;
        };
        let file = draft.encode();
        let policy = Policy::load(&file).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(policy.output_ranges().eq(found.iter().copied()), "{name}");
        let inputs = draft.ranges[..draft.ranges.len() - found.len()].iter();
        assert!(policy.input_ranges().eq(inputs.copied()), "{name}");
        assert_eq!(blob::contract_of(&file), Some(policy.contract()), "{name}");
        let without = Draft {
            ranges: Vec::new(),
            ..draft.clone()
        }
        .encode();
        let free = Policy::load(&without).expect("a policy");
        assert_ne!(free.contract(), policy.contract(), "{name}");
        let mut bytes = Vec::new();
        contract_bytes(policy.header(), policy.tables(), |part| {
            bytes.extend_from_slice(part);
        });
        assert_eq!(fnv1a_64(START_64, &bytes), policy.contract(), "{name}");
        let [mut one, mut other] = [policy, free].map(|p| TestAgent::new(p).expect("room"));
        let (mut dice, mut clamped) = (Dice::new(3), 0);
        for _ in 0..50 {
            let inputs = usize::from(policy.header().observation_len);
            let observation: Vec<f32> = (0..inputs).map(|_| dice.number()).collect();
            let within = one.decide(&observation).expect("its length").action;
            let freely = other.decide(&observation).expect("its length").action;
            let (Action::Continuous(within), Action::Continuous(freely)) = (within, freely) else {
                panic!("{name} is continuous");
            };
            for ((x, y), range) in within.iter().zip(freely).zip(found) {
                let wanted = y.clamp(range.low, range.high);
                assert_eq!(x.to_bits(), wanted.to_bits(), "{name}");
                clamped += usize::from(x.to_bits() != y.to_bits());
            }
        }
        assert!(clamped > 0, "{name}: the header's range is the wider one");
    }
}

#[test]
fn ranges_that_are_unsound_or_say_nothing_are_refused() {
    let samples = samples::large().into_iter();
    let (_, ranged) = samples
        .into_iter()
        .find(|(n, _)| *n == "ranges")
        .expect("it is there");
    let load = |ranges: &[Range]| {
        let draft = Draft {
            ranges: ranges.to_vec(),
            ..ranged.clone()
        };
        Policy::load(&draft.encode()).map(|_| ())
    };
    let (good, inputs) = (
        &ranged.ranges[..],
        usize::from(ranged.header.observation_len),
    );
    assert_eq!(load(good), Ok(()));
    let with = |index: usize, low: f32, high: f32| {
        let mut ranges = good.to_vec();
        ranges[index] = Range { low, high };
        load(&ranges)
    };
    let infinite = f32::INFINITY;
    let unsound = [
        (0, f32::NAN, 1.0),
        (1, 0.0, f32::NAN),
        (1, 2.0, 1.0),
        (2, -0.0, 1.0),
        (2, -1.0, -0.0),
        (3, infinite, infinite),
        (3, -infinite, -infinite),
        (inputs, -infinite, 0.5),
        (inputs + 1, -1.0, infinite),
    ];
    for (index, low, high) in unsound {
        let refused = VerifyError::Record {
            table: Table::Ranges,
            index: index as u32,
        };
        assert_eq!(
            with(index, low, high),
            Err(refused),
            "{index}: {low} to {high}"
        );
    }
    assert_eq!(load(&good[1..]), Err(VerifyError::Ranges), "one too few");
    assert_eq!(
        with(inputs, -0.5, 0.25),
        Err(VerifyError::Ranges),
        "the header says -1"
    );
    assert_eq!(
        with(inputs + 1, 0.0, 2.0),
        Err(VerifyError::Ranges),
        "the header says 1"
    );
    let mut needless = vec![Range::ALL; inputs];
    needless.resize(
        good.len(),
        Range {
            low: -1.0,
            high: 1.0,
        },
    );
    assert_eq!(
        load(&needless),
        Err(VerifyError::Ranges),
        "what holds without them"
    );
}
