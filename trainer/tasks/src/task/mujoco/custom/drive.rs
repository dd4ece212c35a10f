//! The actuators that a policy sets.

use super::description::{self, finite};
use super::source::{names, number};
use crate::task::Channel;
use mujoco_rs::prelude::MjModel;

/// One actuator: the control is `middle + half · value` for a policy's value within -1 and 1.
#[derive(Debug)]
pub(super) struct Drive {
    pub control: usize,
    pub middle: f64,
    pub half: f64,
}

/// Finds the actuators and their ranges.
pub(super) fn drives(
    actuators: &[description::Actuator],
    model: &MjModel,
) -> Result<(Vec<Drive>, Vec<Channel>), String> {
    let known = names(model, model.name_actuatoradr());
    let ranges = model.actuator_ctrlrange();
    if known.len() != ranges.len() {
        return Err("actuators with several inputs are not supported".into());
    }
    let (mut drives, mut outputs) = (Vec::<Drive>::new(), Vec::new());
    for actuator in actuators {
        let name = &actuator.name;
        let control = number("actuator", name, &known)?;
        if drives.iter().any(|drive| drive.control == control) {
            return Err(format!("the actuator {name:?} is named twice"));
        }
        // MuJoCo gives an actuator without a range 0 and 0.
        let range = ranges
            .get(control)
            .copied()
            .filter(|[low, high]| low < high);
        let [low, high] = match (actuator.low, actuator.high, range) {
            (Some(low), Some(high), _) => [low, high],
            (low, high, Some(range)) => [low.unwrap_or(range[0]), high.unwrap_or(range[1])],
            _ => {
                return Err(format!(
                    "the actuator {name:?} has no ctrlrange in the model: give low and high"
                ));
            }
        };
        let (low, high) = (finite("actuator.low", low)?, finite("actuator.high", high)?);
        let outside = range.is_some_and(|range| low < range[0] || high > range[1]);
        if low >= high || outside {
            return Err(format!(
                "the actuator {name:?} goes from {low} to {high}: low lies below high, and both within the model's \
                 ctrlrange"
            ));
        }
        drives.push(Drive {
            control,
            middle: (low + high) / 2.0,
            half: (high - low) / 2.0,
        });
        outputs.push(Channel {
            name: name.clone(),
            unit: actuator
                .unit
                .clone()
                .unwrap_or_else(|| format!("{low}..{high}")),
            velocity: false,
        });
    }
    Ok((drives, outputs))
}
