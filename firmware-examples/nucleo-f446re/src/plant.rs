//! Template for your own plant: which sensor is which input, in which unit, and what is safe.

use tpg_runtime::{Action, Policy};

/// One channel of the policy, named and measured as the policy's labels say.
pub struct Channel {
    /// Name and unit that the label must have: another order or unit is found before the first decision.
    pub label: (&'static str, &'static str),
    /// What one step of your converter is, in that unit.
    pub unit_per_step: f32,
}

/// edit 2: your sensors, in the policy's order; `tpg inspect` lists its inputs.
pub const SENSORS: [Channel; 0] = [];

/// edit 3: your actuators, in the policy's order.
pub const ACTUATORS: [Channel; 0] = [];

/// edit 4: what an actuator does when nobody decides, in steps of its converter.
pub const SAFE: i16 = 0;

/// Whether the policy was evolved for these channels.
pub fn fits(policy: &Policy<'_>) -> bool {
    policy.inputs().eq(SENSORS.iter().map(|c| c.label))
        && policy.outputs().eq(ACTUATORS.iter().map(|c| c.label))
}

/// edit 5: reads the converters into the observation, in the policy's units.
pub fn sense(observation: &mut [f32]) {
    for (value, channel) in observation.iter_mut().zip(&SENSORS) {
        *value = f32::from(read_converter(channel)) * channel.unit_per_step;
    }
}

/// Drives the actuators; the policy has clamped its action to the range in its header.
pub fn act(action: Action<'_>) {
    if let Action::Continuous(values) = action {
        for (value, channel) in values.iter().zip(&ACTUATORS) {
            write_converter(channel, (value / channel.unit_per_step) as i16);
        }
    }
}

/// Drives every actuator to where it does no harm.
pub fn make_safe() {
    for channel in &ACTUATORS {
        write_converter(channel, SAFE);
    }
}

fn read_converter(_: &Channel) -> i16 {
    0
}

fn write_converter(_: &Channel, steps: i16) {
    core::hint::black_box(steps);
}
