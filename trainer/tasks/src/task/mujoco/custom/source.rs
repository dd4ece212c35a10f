//! Values of a model that a task's file can name.

use super::unknown;
use mujoco_rs::prelude::{MjData, MjModel, MjtJoint};
use std::{ffi::c_char, sync::Arc};

/// A value that the simulation has at every moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Source {
    Position(usize),
    Velocity(usize),
    Sine(usize),
    Cosine(usize),
    Sensor(usize),
    Site { site: usize, axis: usize },
}

impl Source {
    /// Finds what a text such as `qpos:hinge` or `site:tip.z` stands for.
    pub(super) fn find(text: &str, model: &MjModel) -> Result<Self, String> {
        const FORMS: &str = "a source is qpos:JOINT, qvel:JOINT, sin:JOINT, cos:JOINT, sensor:NAME, sensor:NAME[i] or \
                             site:NAME.x, .y or .z";
        let (kind, name) = text
            .split_once(':')
            .ok_or_else(|| format!("source = {text:?}: {FORMS}"))?;
        let joint = || joint(name, model).map_err(|why| format!("source = {text:?}: {why}"));
        match kind {
            "qpos" => Ok(Self::Position(joint()?.0)),
            "qvel" => Ok(Self::Velocity(joint()?.1)),
            "sin" => Ok(Self::Sine(joint()?.0)),
            "cos" => Ok(Self::Cosine(joint()?.0)),
            "sensor" => sensor(name, model).map_err(|why| format!("source = {text:?}: {why}")),
            "site" => site(name, model).map_err(|why| format!("source = {text:?}: {why}")),
            _ => Err(format!("source = {text:?}: {FORMS}")),
        }
    }

    /// The value now; sites and sensors are those of one step of physics before, as MuJoCo leaves them.
    pub(super) fn read(self, data: &MjData<Arc<MjModel>>) -> f64 {
        let at = |values: &[f64], index: usize| values.get(index).copied().unwrap_or(0.0);
        match self {
            Self::Position(index) => at(data.qpos(), index),
            Self::Velocity(index) => at(data.qvel(), index),
            Self::Sine(index) => libm::sin(at(data.qpos(), index)),
            Self::Cosine(index) => libm::cos(at(data.qpos(), index)),
            Self::Sensor(index) => at(data.sensordata(), index),
            Self::Site { site, axis } => data
                .site_xpos()
                .get(site)
                .map_or(0.0, |position| at(position, axis)),
        }
    }
}

/// The names of a model's objects of one kind, in their order; an unnamed one is empty.
///
/// Read from the model's own table, since mujoco-rs's search by name panics on a name that holds a zero byte.
pub(super) fn names<'a>(model: &'a MjModel, addresses: &[i32]) -> Vec<&'a str> {
    let bytes = |chars: &'a [c_char]| -> &'a [u8] {
        // SAFETY: `c_char` has the size, alignment and every bit pattern of `u8`.
        unsafe { std::slice::from_raw_parts(chars.as_ptr().cast::<u8>(), chars.len()) }
    };
    let all = bytes(model.names());
    let name = |&address: &i32| {
        let rest = usize::try_from(address)
            .ok()
            .and_then(|start| all.get(start..));
        let name = rest.and_then(|rest| rest.split(|byte| *byte == 0).next());
        std::str::from_utf8(name.unwrap_or_default()).unwrap_or_default()
    };
    addresses.iter().map(name).collect()
}

/// The number of the object with this name.
pub(super) fn number(kind: &str, name: &str, names: &[&str]) -> Result<usize, String> {
    let named: Vec<&str> = names.iter().copied().filter(|n| !n.is_empty()).collect();
    names
        .iter()
        .position(|known| *known == name && !name.is_empty())
        .ok_or_else(|| unknown(kind, name, &named))
}

fn index(values: &[i32], at: usize) -> usize {
    let value = values.get(at).copied().unwrap_or_default();
    usize::try_from(value).unwrap_or_default()
}

/// Where the position and the velocity of a joint with one degree of freedom stand.
fn joint(name: &str, model: &MjModel) -> Result<(usize, usize), String> {
    let number = number("joint", name, &names(model, model.name_jntadr()))?;
    let kind = model.jnt_type().get(number);
    if !matches!(kind, Some(MjtJoint::mjJNT_HINGE | MjtJoint::mjJNT_SLIDE)) {
        return Err(format!(
            "the joint {name:?} is neither a hinge nor a slide; observe it by sensors or sites"
        ));
    }
    Ok((
        index(model.jnt_qposadr(), number),
        index(model.jnt_dofadr(), number),
    ))
}

fn sensor(text: &str, model: &MjModel) -> Result<Source, String> {
    let (name, element) = match text.strip_suffix(']').and_then(|t| t.rsplit_once('[')) {
        Some((name, element)) => (name, Some(element)),
        None => (text, None),
    };
    let number = number("sensor", name, &names(model, model.name_sensoradr()))?;
    let count = index(model.sensor_dim(), number);
    let element = match element {
        Some(element) => element.parse().unwrap_or(usize::MAX),
        None if count == 1 => 0,
        None => usize::MAX,
    };
    if element >= count {
        return Err(format!(
            "the sensor {name:?} has {count} values: choose one by an index below {count} in brackets"
        ));
    }
    Ok(Source::Sensor(index(model.sensor_adr(), number) + element))
}

fn site(text: &str, model: &MjModel) -> Result<Source, String> {
    let axis = |axis: &str| ["x", "y", "z"].iter().position(|known| *known == axis);
    let (name, axis) = text
        .rsplit_once('.')
        .and_then(|(name, letter)| Some((name, axis(letter)?)))
        .ok_or("a site's coordinate is NAME.x, NAME.y or NAME.z")?;
    let site = number("site", name, &names(model, model.name_siteadr()))?;
    Ok(Source::Site { site, axis })
}
