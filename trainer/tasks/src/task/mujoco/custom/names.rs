//! The objects of a model: their names, and how a file calls those that have none.

use mujoco_rs::prelude::{MjModel, MjtTrn};
use std::ffi::c_char;

/// The most objects that a message lists.
const LISTED: usize = 60;

/// The names of a model's objects of one kind, in their order; an unnamed one is empty.
///
/// Read from the model's own table, since mujoco-rs's search by name panics on a name that holds a zero byte.
pub(in crate::task::mujoco) fn names<'a>(model: &'a MjModel, addresses: &[i32]) -> Vec<&'a str> {
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

/// How a message calls an object: by its name, or by its number where it has none.
pub(super) fn label(kind: &str, index: usize, names: &[&str]) -> String {
    match names.get(index) {
        Some(name) if !name.is_empty() => format!("{kind} {name:?}"),
        _ => format!("{kind} #{index}"),
    }
}

/// The number of the object that a text names: by its name, or as `#i`, counted from 0 in the model's order.
pub(super) fn number(kind: &str, text: &str, names: &[&str]) -> Result<usize, String> {
    if let Some(found) = names
        .iter()
        .position(|known| *known == text && !text.is_empty())
    {
        return Ok(found);
    }
    let numbered = text
        .strip_prefix('#')
        .and_then(|digits| digits.parse().ok());
    match numbered {
        Some(index) if index < names.len() => Ok(index),
        _ => Err(missing(kind, text, &calls(names))),
    }
}

/// What a file may call each of the objects.
pub(super) fn calls(names: &[&str]) -> Vec<String> {
    let call = |(index, name): (usize, &&str)| match *name {
        "" => format!("#{index}"),
        name => name.to_owned(),
    };
    names.iter().enumerate().map(call).collect()
}

/// Says that an object does not exist, which one is most like it, and which there are.
fn missing(kind: &str, text: &str, known: &[String]) -> String {
    let named = known.iter().filter(|name| !name.starts_with('#'));
    let likeness = |name: &&String| strsim::jaro_winkler(text, name);
    let nearest = named.max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
    let hint = nearest.map_or_else(String::new, |name| format!(", did you mean {name:?}?"));
    if known.is_empty() {
        return format!("no {kind} is called {text:?}; the model has none");
    }
    let mut list = known[..known.len().min(LISTED)].join(", ");
    if known.len() > LISTED {
        list += &format!(" and {} more", known.len() - LISTED);
    }
    let unnamed = known.iter().any(|name| name.starts_with('#'));
    let note = if unnamed {
        " (# and a number stand for one without a name)"
    } else {
        ""
    };
    format!("no {kind} is called {text:?}{hint}; there are {list}{note}")
}

/// The actuator that a text names: by its name, as `#i`, or by the only joint, tendon, site or body that it acts on.
pub(super) fn actuator(text: &str, model: &MjModel) -> Result<usize, String> {
    let known = names(model, model.name_actuatoradr());
    if let Some((kind, target)) = text.split_once(':').filter(|_| !known.contains(&text)) {
        return on_target(kind, target, model);
    }
    number("actuator", text, &known).map_err(|_| {
        let mut list = calls(&known);
        for (index, call) in list.iter_mut().enumerate() {
            if let (true, Some(target)) = (call.starts_with('#'), target(index, model)) {
                *call += &format!(" ({target})");
            }
        }
        missing("actuator", text, &list)
    })
}

/// The kinds of objects that an actuator can act on, with the names of the model's.
fn targets<'a>(kind: &str, model: &'a MjModel) -> Option<Vec<&'a str>> {
    let addresses = match kind {
        "joint" => model.name_jntadr(),
        "tendon" => model.name_tendonadr(),
        "site" => model.name_siteadr(),
        "body" => model.name_bodyadr(),
        _ => return None,
    };
    Some(names(model, addresses))
}

/// What kind of object an actuator acts on, and its number.
fn acts_on(actuator: usize, model: &MjModel) -> Option<(&'static str, usize)> {
    let kind = match model.actuator_trntype().get(actuator)? {
        MjtTrn::mjTRN_JOINT | MjtTrn::mjTRN_JOINTINPARENT => "joint",
        MjtTrn::mjTRN_TENDON => "tendon",
        MjtTrn::mjTRN_SITE | MjtTrn::mjTRN_SLIDERCRANK => "site",
        MjtTrn::mjTRN_BODY => "body",
        _ => return None,
    };
    let [target, _] = *model.actuator_trnid().get(actuator)?;
    Some((kind, usize::try_from(target).ok()?))
}

fn target(actuator: usize, model: &MjModel) -> Option<String> {
    let (kind, index) = acts_on(actuator, model)?;
    let call = calls(&targets(kind, model)?).get(index)?.clone();
    Some(format!("{kind}:{call}"))
}

fn on_target(kind: &str, text: &str, model: &MjModel) -> Result<usize, String> {
    let Some(known) = targets(kind, model) else {
        return Err(format!(
            "an actuator is NAME, #i, joint:NAME, tendon:NAME, site:NAME or body:NAME, not {kind}:{text}"
        ));
    };
    let index = number(kind, text, &known)?;
    let count = model.actuator_trntype().len();
    let mut on = (0..count).filter(|&actuator| acts_on(actuator, model) == Some((kind, index)));
    match (on.next(), on.next()) {
        (Some(only), None) => Ok(only),
        (None, _) => Err(format!(
            "no actuator acts on the {}",
            label(kind, index, &known)
        )),
        (Some(first), Some(second)) => Err(format!(
            "several actuators act on the {}: choose #{first}, #{second} or another by number",
            label(kind, index, &known)
        )),
    }
}
