//! The actuators that a policy sets.

use super::description::{self, finite};
use super::measure::Effort;
use super::names::{actuator as find, label, names};
use super::pairwise::pairwise;
use crate::task::{ActionSpace, Channel};
use mujoco_rs::prelude::MjModel;
use tpg_runtime::Action;

/// One actuator: the control is `middle + half · value` for a policy's value within -1 and 1.
#[derive(Debug, Clone)]
struct Drive {
    control: usize,
    middle: f64,
    half: f64,
    /// The most that the control changes in one control step.
    step: f64,
}

/// Everything that a policy sets.
#[derive(Debug, Clone)]
pub(super) struct Drives {
    drives: Vec<Drive>,
    /// The actions to choose from, as controls of each drive, one after the other; none where the outputs are continuous.
    table: Vec<Vec<f64>>,
}

impl Drives {
    /// Finds the actuators, their ranges and the actions; `period` is the number of seconds of a control step.
    pub(super) fn new(
        description: &description::Description,
        model: &MjModel,
        period: f64,
    ) -> Result<(Self, Vec<Channel>, ActionSpace), String> {
        let (drives, outputs) = drives(&description.actuator, model, period)?;
        let len = u16::try_from(drives.len()).map_err(|_| "too many actuators")?;
        if description.action.is_empty() {
            let table = Vec::new();
            let actions = ActionSpace::Continuous {
                len,
                low: -1.0,
                high: 1.0,
            };
            return Ok((Self { drives, table }, outputs, actions));
        }
        let mut table = Vec::new();
        for action in &description.action {
            let name = &action.name;
            if action.controls.len() != drives.len() {
                return Err(format!(
                    "the action {name:?} has {} controls: there are {} actuators, and it needs one for each",
                    action.controls.len(),
                    drives.len()
                ));
            }
            for ((control, drive), output) in action.controls.iter().zip(&drives).zip(&outputs) {
                let within = (control - drive.middle).abs() <= drive.half;
                if !within {
                    return Err(format!(
                        "the action {name:?} sets {:?} to {control}, which is not within its range of {} to {}",
                        output.name,
                        drive.middle - drive.half,
                        drive.middle + drive.half
                    ));
                }
            }
            table.push(action.controls.clone());
        }
        if table.len() < 2 {
            return Err("one [[action]] leaves nothing to choose: give two or more".into());
        }
        let count = u16::try_from(table.len()).map_err(|_| "too many actions")?;
        let index = Channel {
            name: "action".into(),
            unit: "index".into(),
            velocity: false,
            range: None,
        };
        let drives = Self { drives, table };
        Ok((drives, vec![index], ActionSpace::Discrete(count)))
    }

    /// Sets the controls for an action; returns what they cost.
    pub(super) fn set(&self, action: Action<'_>, controls: &mut [f64]) -> Effort {
        if self.table.is_empty() {
            let values = match action {
                Action::Continuous(values) => values,
                Action::Discrete(_) => &[],
            };
            let value = |k: usize| values.get(k).copied().unwrap_or(0.0);
            for (k, drive) in self.drives.iter().enumerate() {
                drive.set(drive.middle + drive.half * f64::from(value(k)), controls);
            }
            return self.effort(value);
        }
        let chosen = match action {
            Action::Discrete(index) => self.table.get(usize::from(index)),
            Action::Continuous(_) => None,
        };
        let Some(row) = chosen.or(self.table.first()) else {
            return Effort::default();
        };
        for (drive, &control) in self.drives.iter().zip(row) {
            drive.set(control, controls);
        }
        self.effort(|k| {
            let drive = &self.drives[k];
            ((row[k] - drive.middle) / drive.half) as f32
        })
    }

    fn effort(&self, output: impl Fn(usize) -> f32) -> Effort {
        let square = |k| output(k) * output(k);
        let count = self.drives.len();
        Effort {
            in_order: (0..count).fold(0.0, |sum, k| sum + square(k)),
            pairwise: pairwise(count, square),
        }
    }
}

impl Drive {
    fn set(&self, target: f64, controls: &mut [f64]) {
        if let Some(control) = controls.get_mut(self.control) {
            *control = if self.step == f64::INFINITY {
                target
            } else {
                target.clamp(*control - self.step, *control + self.step)
            };
        }
    }
}

/// Finds the actuators and their ranges.
fn drives(
    actuators: &[description::Actuator],
    model: &MjModel,
    period: f64,
) -> Result<(Vec<Drive>, Vec<Channel>), String> {
    let known = names(model, model.name_actuatoradr());
    let ranges = model.actuator_ctrlrange();
    if known.len() != ranges.len() {
        return Err("actuators with several inputs are not supported".into());
    }
    let (mut drives, mut outputs) = (Vec::<Drive>::new(), Vec::<Channel>::new());
    for actuator in actuators {
        let name = &actuator.name;
        let control = find(actuator.actuator.as_ref().unwrap_or(name), model)?;
        let called = label("actuator", control, &known);
        if drives.iter().any(|drive| drive.control == control) {
            return Err(format!("the {called} is named twice"));
        }
        if outputs.iter().any(|output| output.name == *name) {
            return Err(format!(
                "actuator.name = {name:?}: two actuators have this name; give each its own"
            ));
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
                    "the {called} has no ctrlrange in the model: give low and high"
                ));
            }
        };
        let (low, high) = (finite("actuator.low", low)?, finite("actuator.high", high)?);
        let outside = range.is_some_and(|range| low < range[0] || high > range[1]);
        if low >= high || outside {
            return Err(format!(
                "the {called} goes from {low} to {high}: low lies below high, and both within the model's ctrlrange"
            ));
        }
        let rate = actuator.rate_limit;
        if rate.is_some_and(|rate| !(rate.is_finite() && rate > 0.0)) {
            return Err(format!(
                "actuator.rate-limit = {} of {name:?}: must be a finite number above 0, in units of the control per \
                 second",
                rate.unwrap_or_default()
            ));
        }
        let middle = (low + high) / 2.0;
        drives.push(Drive {
            control,
            // The zero that changes no other zero when it is added: an output of -0 stays one, as in Gymnasium.
            middle: if middle == 0.0 { -0.0 } else { middle },
            half: (high - low) / 2.0,
            step: rate.map_or(f64::INFINITY, |rate| rate * period),
        });
        outputs.push(Channel {
            name: name.clone(),
            unit: actuator
                .unit
                .clone()
                .unwrap_or_else(|| format!("{low}..{high}")),
            velocity: false,
            range: None,
        });
    }
    Ok((drives, outputs))
}
