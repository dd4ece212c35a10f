//! Files of policies, and the policies that pass verification.

use tpg_runtime::rng::Pcg32;
use tpg_runtime::{
    Action, AnyWidth, Capacities, Header, HostAgent, Policy, Reset, SliceAgent, Slices,
};
use tpg_test_policies::old_format::mend;

/// Bytes at the end of an input of [`policy`], from which observations are made.
const OBSERVED: usize = 64;
const DECISIONS: usize = 12;

/// Any bytes as a file: as they are, and with the lengths and the checksum that they should have.
///
/// # Panics
/// If a promise is broken.
pub fn loader(data: &[u8]) {
    let _ = Header::peek(data);
    let _ = Policy::load(data);
    let Some(file) = sealed(data) else { return };
    if let Ok(policy) = Policy::load(&file) {
        let header = Header::peek(&file).expect("what loads has a header");
        assert_eq!(header, *policy.header());
    }
}

/// A file whose lengths and checksum are right. Otherwise nearly all changes would end there.
fn sealed(data: &[u8]) -> Option<Vec<u8>> {
    let mut file = data.to_vec();
    let length = usize::from(u16::from_le_bytes(*file.get(6..)?.first_chunk()?));
    let body = file.len().checked_sub(length + 4)?;
    file.get_mut(12..16)?
        .copy_from_slice(&u32::try_from(body).ok()?.to_le_bytes());
    mend(&mut file);
    Some(file)
}

/// A file, then [`OBSERVED`] bytes. If the file is a policy, agents on an array and on slices decide alike, within the
/// bound and the range of actions, whatever they observe.
///
/// # Panics
/// If a promise is broken.
pub fn policy(data: &[u8]) {
    let Some((file, observed)) = data.split_last_chunk::<OBSERVED>() else {
        return;
    };
    let Some(file) = sealed(file) else { return };
    let Ok(policy) = Policy::load(&file) else {
        return;
    };
    let needed = Capacities::needed_by(policy.header());
    // What does not fit the agent of hosts is refused there, and takes long here.
    if needed.words > 20_000 || policy.bounds().weighted_operations > 2_000_000 {
        return;
    }
    let Ok(agent) = HostAgent::new(policy) else {
        return;
    };
    let mut agent = Box::new(agent);
    let (mut words, mut bids) = (vec![0.0; needed.words], vec![0.0; needed.programs]);
    let mut visited = vec![false; needed.teams];
    let mut streams = vec![Pcg32::new(0, 0); needed.streams];
    let slices = Slices {
        words: &mut words,
        bids: &mut bids,
        visited: &mut visited,
        streams: &mut streams,
    };
    let mut twin: SliceAgent<'_, '_, AnyWidth> =
        SliceAgent::new_in(policy, slices).expect("as much as it needs");
    let values: Vec<f32> = observed
        .chunks_exact(4)
        .map(|bytes| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
        .collect();
    let length = usize::from(policy.header().observation_len);
    for step in 0..DECISIONS {
        match step {
            4 => (
                agent.reset(Reset::Episode, 7),
                twin.reset(Reset::Episode, 7),
            ),
            8 => (agent.reset(Reset::Agent, 9), twin.reset(Reset::Agent, 9)),
            _ => ((), ()),
        };
        let observation: Vec<f32> = (0..length)
            .map(|k| values[(k * 5 + step * 3) % values.len()])
            .collect();
        let (one, other) = if step == 10 {
            (Ok(agent.decide_blind()), Ok(twin.decide_blind()))
        } else {
            (agent.decide(&observation), twin.decide(&observation))
        };
        let (one, other) = (one.expect("its length"), other.expect("its length"));
        assert_eq!(bits(one.action), bits(other.action));
        assert_eq!(
            (one.winner, one.instructions, one.teams),
            (other.winner, other.instructions, other.teams)
        );
        assert!(one.instructions <= policy.bounds().instructions);
        assert!(one.teams <= policy.bounds().teams);
        check_action(one.action, &policy);
    }
}

fn bits(action: Action<'_>) -> Vec<u32> {
    match action {
        Action::Discrete(number) => vec![u32::from(number)],
        Action::Continuous(values) => values.iter().map(|value| value.to_bits()).collect(),
    }
}

fn check_action(action: Action<'_>, policy: &Policy<'_>) {
    let header = policy.header();
    match action {
        Action::Discrete(number) => assert!(number < header.actions),
        Action::Continuous(values) => {
            assert_eq!(values.len(), usize::from(header.actions));
            for (value, range) in values.iter().zip(policy.output_ranges()) {
                assert!((range.low..=range.high).contains(value), "{values:?}");
            }
        }
    }
}
