//! The control loop of the firmware templates, with a plant whose clock the test sets: what is late or wrong is never used.

use std::fs;
use std::path::Path;

use tpg_board::control::{Channel, Control, Outcome, Plant, fits};
use tpg_runtime::{Action, HostAgent, Policy};

const PERIOD_US: u32 = 1_000;
const INPUTS: usize = 11;

/// What was done to the plant, in order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Event {
    Fed,
    Acted,
    Safe,
}

#[derive(Debug, Default)]
struct Simulated {
    now_us: u64,
    /// How long reading the sensors takes.
    sensing_us: u64,
    /// What the sensors show, a multiple of an element's index.
    shown: f32,
    forbidden: bool,
    refusing: bool,
    events: Vec<Event>,
    /// When each period began.
    begun_us: Vec<u64>,
    actions: Vec<Vec<f32>>,
}

impl Plant for Simulated {
    fn now_us(&mut self) -> u64 {
        self.now_us += 1;
        self.now_us
    }

    fn feed_watchdog(&mut self) {
        self.events.push(Event::Fed);
        self.begun_us.push(self.now_us);
    }

    fn sense(&mut self, observation: &mut [f32]) -> bool {
        assert!(observation.iter().all(|value| value.is_nan()));
        for (at, value) in observation.iter_mut().enumerate() {
            *value = self.shown * at as f32;
        }
        self.now_us += self.sensing_us;
        !self.forbidden
    }

    fn act(&mut self, action: Action<'_>) -> bool {
        let Action::Continuous(values) = action else {
            return false;
        };
        if self.refusing {
            return false;
        }
        self.events.push(Event::Acted);
        self.actions.push(values.to_vec());
        true
    }

    fn make_safe(&mut self) {
        self.events.push(Event::Safe);
    }
}

/// A champion with this path in the repository.
fn policy(path: &str) -> Vec<u8> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    fs::read(root.join(path)).expect("a champion")
}

fn champion() -> Vec<u8> {
    policy("firmware-examples/champion.tpg")
}

fn agent(bytes: &[u8]) -> Box<HostAgent<'_>> {
    Box::new(HostAgent::new(Policy::load(bytes).expect("valid")).expect("fits"))
}

#[test]
fn a_plant_is_driven_once_in_each_period_without_drift() {
    let bytes = champion();
    let (mut agent, mut plant) = (agent(&bytes), Simulated::default());
    let mut control = Control::new(PERIOD_US, PERIOD_US, 2);
    let outcomes: Vec<_> = (0..5)
        .map(|_| control.period::<INPUTS, _, _>(&mut agent, &mut plant))
        .collect();
    assert_eq!(outcomes[..2], [Outcome::Recovering; 2]);
    assert_eq!(outcomes[2..], [Outcome::Driven; 3]);
    let expected = [Event::Fed, Event::Safe, Event::Fed, Event::Safe];
    assert_eq!(plant.events[..4], expected);
    assert_eq!(plant.events[4..], [Event::Fed, Event::Acted].repeat(3));
    let steps: Vec<u64> = plant.begun_us.windows(2).map(|w| w[1] - w[0]).collect();
    // The first one is read from the clock twice.
    assert_eq!(steps[1..], [u64::from(PERIOD_US); 3]);
}

#[test]
fn a_late_action_is_not_used_and_the_next_one_waits() {
    let bytes = champion();
    let (mut agent, mut plant) = (agent(&bytes), Simulated::default());
    let mut control = Control::new(PERIOD_US, PERIOD_US / 2, 1);
    let mut period = |plant: &mut Simulated, sensing_us| {
        plant.sensing_us = sensing_us;
        plant.events.clear();
        control.period::<INPUTS, _, _>(&mut agent, plant)
    };
    assert_eq!(period(&mut plant, 100), Outcome::Recovering);
    assert_eq!(period(&mut plant, 100), Outcome::Driven);
    // Past the deadline, within the period.
    assert_eq!(period(&mut plant, 600), Outcome::Late);
    assert_eq!(plant.events, [Event::Fed, Event::Safe]);
    assert_eq!(period(&mut plant, 100), Outcome::Recovering);
    assert_eq!(plant.events, [Event::Fed, Event::Safe]);
    assert_eq!(period(&mut plant, 100), Outcome::Driven);
    // Several periods long: the ones that were missed are not made up for.
    assert_eq!(period(&mut plant, 3_500), Outcome::Late);
    assert_eq!(plant.events, [Event::Fed, Event::Safe]);
    let end = plant.now_us;
    assert_eq!(period(&mut plant, 100), Outcome::Recovering);
    assert_eq!(period(&mut plant, 100), Outcome::Driven);
    let begun = plant.begun_us.last_chunk::<2>().expect("two periods");
    assert!(begun[0] - end < 10, "{begun:?} after {end}");
    assert!((990..=1_010).contains(&(begun[1] - begun[0])), "{begun:?}");
}

#[test]
fn what_is_forbidden_or_wrong_leaves_the_plant_safe() {
    let bytes = champion();
    let (mut agent, mut plant) = (agent(&bytes), Simulated::default());
    let mut control = Control::new(PERIOD_US, PERIOD_US, 0);
    plant.forbidden = true;
    let outcome = control.period::<INPUTS, _, _>(&mut agent, &mut plant);
    assert_eq!(outcome, Outcome::Stopped);
    plant.forbidden = false;
    plant.refusing = true;
    let outcome = control.period::<INPUTS, _, _>(&mut agent, &mut plant);
    assert_eq!(outcome, Outcome::Failed);
    plant.refusing = false;
    // An observation that the policy was not evolved for.
    let outcome = control.period::<{ INPUTS + 1 }, _, _>(&mut agent, &mut plant);
    assert_eq!(outcome, Outcome::Failed);
    assert_eq!(plant.events, [Event::Fed, Event::Safe].repeat(3));
    assert!(plant.actions.is_empty());
}

/// This champion keeps its registers, so what it saw before a stop would change what it does afterwards.
#[test]
fn driving_begins_with_an_episode() {
    let bytes = policy("docs/champions/pendulum.tpg");
    let (mut agent, mut plant) = (agent(&bytes), Simulated::default());
    let mut control = Control::new(PERIOD_US, PERIOD_US, 1);
    let shown = [0.1, 0.1, 0.2, 0.3, 0.9, 0.5, 0.1, 0.2, 0.3];
    for (at, shown) in shown.into_iter().enumerate() {
        plant.shown = shown;
        plant.forbidden = at == 4;
        control.period::<2, _, _>(&mut agent, &mut plant);
    }
    let (first, second) = plant.actions.split_at(3);
    assert_eq!(first, second);
}

#[test]
fn converters_clamp_and_labels_are_compared() {
    let torque = Channel {
        label: ("thigh_torque", "200 N m"),
        zero_step: 1_024.0,
        unit_per_step: 1.0 / 1_024.0,
    };
    let steps = [-1.0, 0.0, 0.5, 1.0, 7.0, -7.0, f32::NAN].map(|value| torque.step(value, 2_048));
    assert_eq!(steps, [0, 1_024, 1_536, 2_048, 2_048, 0, 0]);
    let values = [0, 1_024, 2_048].map(|step| torque.value(step).to_bits());
    assert_eq!(values, [-1.0f32, 0.0, 1.0].map(f32::to_bits));
    let bytes = champion();
    let policy = Policy::load(&bytes).expect("valid");
    let labels = |labels: Vec<(&str, &str)>| -> Vec<Channel> {
        let label = |(name, unit): (&str, &str)| {
            (
                name.to_owned().leak() as &str,
                unit.to_owned().leak() as &str,
            )
        };
        let channel = |label| Channel { label, ..torque };
        labels.into_iter().map(label).map(channel).collect()
    };
    let (sensors, mut actuators) = (
        labels(policy.inputs().collect()),
        labels(policy.outputs().collect()),
    );
    assert!(fits(&policy, &sensors, &actuators));
    assert!(!fits(&policy, &sensors[1..], &actuators));
    actuators.swap(0, 1);
    assert!(!fits(&policy, &sensors, &actuators));
}
