//! Values of a model that a task's file can name.

use super::arrays::{Array, Data, KINDS, Kind, Owner, owners};
use super::names::{label, names, number};
use super::pairwise::pairwise;
use mujoco_rs::prelude::{MjModel, MjtObjBase, MjtSensor};
use std::ops::Range;

/// The state that values are read from.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moment<'a> {
    pub data: &'a Data,
    /// The goals of this episode, in the order of the file.
    pub goals: &'a [f64],
}

/// A value that the simulation has at every moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Source {
    Element {
        array: Array,
        index: usize,
    },
    Sine(usize),
    Cosine(usize),
    /// Angular (0 to 2) and linear (3 to 5) velocity of a body's frame, in the axes of the world.
    FrameVelocity {
        body: usize,
        axis: usize,
    },
    /// A coordinate of the centre of all mass.
    Centre(usize),
    Goal(usize),
    Time,
}

/// What a text stands for.
#[derive(Debug)]
pub(super) struct Found {
    pub sources: Vec<Source>,
    /// The elements of one array that they are, if they are.
    pub span: Option<(Array, Range<usize>)>,
    /// Whether they are velocities.
    pub velocity: bool,
    /// Whether the text stands for a block of values, be it one of a single value.
    pub block: bool,
}

impl Source {
    /// Finds the one value that a text such as `qpos:hinge` or `site:tip.z` stands for.
    pub(super) fn find(text: &str, model: &MjModel, goals: &[String]) -> Result<Self, String> {
        let found = find(text, model, goals)?;
        match found.sources[..] {
            [only] => Ok(only),
            _ => Err(format!(
                "source = {text:?}: it stands for {} values, and one is needed",
                found.sources.len()
            )),
        }
    }

    /// The value now; all but positions, velocities and goals are those of one step of physics before, as MuJoCo leaves
    /// them.
    pub(super) fn read(self, moment: Moment<'_>) -> f64 {
        let data = moment.data;
        let at = |values: &[f64], index: usize| values.get(index).copied().unwrap_or(0.0);
        match self {
            Self::Element { array, index } => at(array.values(data), index),
            Self::Sine(index) => libm::sin(at(data.qpos(), index)),
            Self::Cosine(index) => libm::cos(at(data.qpos(), index)),
            Self::FrameVelocity { body, axis } => {
                let all = data.object_velocity(MjtObjBase::mjOBJ_XBODY, body, false);
                at(&all, axis)
            }
            Self::Centre(axis) => centre(data, axis),
            Self::Goal(index) => at(moment.goals, index),
            Self::Time => data.time(),
        }
    }

    /// Whether it is known as soon as positions, velocities and goals are.
    pub(super) fn is_state(self) -> bool {
        match self {
            Self::Element { array, .. } => matches!(array, Array::Qpos | Array::Qvel),
            Self::Sine(_) | Self::Cosine(_) | Self::Goal(_) => true,
            Self::FrameVelocity { .. } | Self::Centre(_) | Self::Time => false,
        }
    }
}

/// A coordinate of the centre of all mass, in the order in which NumPy's `einsum` and `sum` add.
fn centre(data: &Data, axis: usize) -> f64 {
    let masses = data.model().body_mass();
    let weighted = (masses.iter().zip(data.xipos())).fold(0.0, |sum, (mass, place)| {
        sum + mass * place.get(axis).copied().unwrap_or(0.0)
    });
    weighted / pairwise(masses.len(), |i| masses[i])
}

/// Finds the values that a text stands for.
pub(super) fn find(text: &str, model: &MjModel, goals: &[String]) -> Result<Found, String> {
    look_up(text, model, goals).map_err(|why| format!("source = {text:?}: {why}"))
}

fn look_up(text: &str, model: &MjModel, goals: &[String]) -> Result<Found, String> {
    if text == "time" {
        return Ok(single(Source::Time, false));
    }
    let (word, rest) = text.split_once(':').ok_or_else(forms)?;
    match word {
        "sin" | "cos" => {
            let index = hinge(rest, model)?;
            let source = if word == "sin" {
                Source::Sine
            } else {
                Source::Cosine
            };
            Ok(single(source(index), false))
        }
        "com" => {
            let axis = axis(rest).ok_or("the centre of mass is com:x, com:y or com:z")?;
            Ok(single(Source::Centre(axis), false))
        }
        "goal" => {
            let known: Vec<&str> = goals.iter().map(String::as_str).collect();
            Ok(single(Source::Goal(number("goal", rest, &known)?), false))
        }
        "xvel" => {
            let known = names(model, model.name_bodyadr());
            let (body, part) = choose("body", rest, &known, 6)?;
            let sources = part.map(|axis| Source::FrameVelocity { body, axis });
            Ok(Found {
                sources: sources.collect(),
                span: None,
                velocity: true,
                block: rest.ends_with(']') && rest.contains(".."),
            })
        }
        _ => {
            let kind = KINDS.iter().find(|kind| kind.0 == word).ok_or_else(forms)?;
            element(kind, rest, model)
        }
    }
}

fn single(source: Source, velocity: bool) -> Found {
    Found {
        sources: vec![source],
        span: None,
        velocity,
        block: false,
    }
}

fn forms() -> String {
    let words: Vec<&str> = KINDS.iter().map(|kind| kind.0).collect();
    format!(
        "a source is KIND:NAME, such as qpos:JOINT, with [i], [a..b] or .x behind it where it has several values, or \
         KIND:* for all; the kinds are {}, sin, cos, xvel, com, goal, and there is time",
        words.join(", ")
    )
}

fn axis(text: &str) -> Option<usize> {
    ["x", "y", "z"].iter().position(|known| *known == text)
}

/// The elements of one of MuJoCo's arrays.
fn element(kind: &Kind, text: &str, model: &MjModel) -> Result<Found, String> {
    let &(word, array, owner, width, velocity) = kind;
    let (known, spans) = owners(owner, width, model);
    let noun = match owner {
        Owner::Coordinates | Owner::Freedoms => "joint",
        Owner::Sensor => "sensor",
        Owner::Controls | Owner::Forces => "actuator",
        Owner::Tendon => "tendon",
        Owner::Site => "site",
        Owner::Geom => "geom",
        Owner::Body => "body",
    };
    let span = if text == "*" || text.starts_with("*[") && text.ends_with(']') {
        let total = spans.last().map_or(0, |span| span.end);
        // As NumPy's indices do, those of an array of rows count rows.
        let row = width.max(1);
        let rows = match text.strip_prefix("*[").and_then(|t| t.strip_suffix(']')) {
            None => 0..total / row,
            Some(range) => part(range, total / row).ok_or_else(|| {
                format!(
                    "{word}:* has {} rows: [{range}] is no part of them",
                    total / row
                )
            })?,
        };
        rows.start * row..rows.end * row
    } else {
        let exact = known
            .iter()
            .position(|name| *name == text && !text.is_empty());
        let (index, within) = match exact {
            Some(index) => (index, None),
            None => {
                let (name, suffix) = split(text, width);
                let index = number(noun, name, &known).map_err(|why| {
                    let hint = if width == 3 && suffix.is_none() {
                        "; a coordinate is NAME.x, NAME.y or NAME.z"
                    } else {
                        ""
                    };
                    format!("{why}{hint}")
                })?;
                (index, suffix)
            }
        };
        let span = spans[index].clone();
        let count = span.len();
        let within = match within {
            None if count == 1 => Some(0..1),
            None => None,
            Some(range) => part(range, count),
        };
        let within = within.ok_or_else(|| {
            let last = if width == 3 { ", .x, .y or .z" } else { "" };
            format!(
                "the {} has {count} values: choose one by an index below {count} in brackets{last}, or all by [..]",
                label(noun, index, &known)
            )
        })?;
        span.start + within.start..span.start + within.end
    };
    if span.is_empty() {
        return Err("it stands for no value".into());
    }
    let velocity = velocity || owner == Owner::Sensor && velocities(&span, model);
    Ok(Found {
        sources: span
            .clone()
            .map(|index| Source::Element { array, index })
            .collect(),
        span: Some((array, span)),
        velocity,
        block: text.starts_with('*') || text.ends_with(']') && text.contains(".."),
    })
}

/// Splits a name from an index, a range or a coordinate behind it.
fn split(text: &str, width: usize) -> (&str, Option<&str>) {
    if let Some((name, range)) = text.strip_suffix(']').and_then(|t| t.rsplit_once('[')) {
        return (name, Some(range));
    }
    match text.rsplit_once('.') {
        Some((name, letter)) if width == 3 && axis(letter).is_some() => (name, Some(letter)),
        _ => (text, None),
    }
}

/// The indices that `i`, `a..b`, `a..`, `..b`, `..` or a coordinate's letter means.
fn part(text: &str, count: usize) -> Option<Range<usize>> {
    if let Some(axis) = axis(text) {
        return (axis < count).then_some(axis..axis + 1);
    }
    let range = match text.split_once("..") {
        Some((start, end)) => {
            let bound = |text: &str, default| match text {
                "" => Some(default),
                text => text.parse().ok(),
            };
            bound(start, 0)?..bound(end, count)?
        }
        None => {
            let index: usize = text.parse().ok()?;
            index..index.checked_add(1)?
        }
    };
    (range.start < range.end && range.end <= count).then_some(range)
}

/// An object and a part of its `width` values.
fn choose(
    noun: &str,
    text: &str,
    known: &[&str],
    width: usize,
) -> Result<(usize, Range<usize>), String> {
    let (name, suffix) = split(text, width);
    let index = number(noun, name, known)?;
    let part = suffix.and_then(|range| part(range, width));
    let part = part.ok_or_else(|| {
        format!(
            "the {} has {width} values: choose one by an index below {width} in brackets, or all by [..]",
            label(noun, index, known)
        )
    })?;
    Ok((index, part))
}

/// The coordinate of a hinge or a slide.
fn hinge(text: &str, model: &MjModel) -> Result<usize, String> {
    let (known, spans) = owners(Owner::Coordinates, 0, model);
    let index = number("joint", text, &known)?;
    match spans[index].len() {
        1 => Ok(spans[index].start),
        _ => Err(format!(
            "the {} is no hinge and no slide, so it has no sine",
            label("joint", index, &known)
        )),
    }
}

/// The coordinates of a joint, and its degrees of freedom, with the part that brackets choose.
pub(super) fn joint(text: &str, model: &MjModel) -> Result<(Range<usize>, Range<usize>), String> {
    let (known, coordinates) = owners(Owner::Coordinates, 0, model);
    let (_, freedoms) = owners(Owner::Freedoms, 0, model);
    let (name, suffix) = if known.contains(&text) {
        (text, None)
    } else {
        split(text, 0)
    };
    let index = number("joint", name, &known)?;
    let (coordinates, freedoms) = (&coordinates[index], &freedoms[index]);
    let Some(range) = suffix else {
        return Ok((coordinates.clone(), freedoms.clone()));
    };
    let part = part(range, coordinates.len()).ok_or_else(|| {
        format!(
            "the {} has {} coordinates: [{range}] is no part of them",
            label("joint", index, &known),
            coordinates.len()
        )
    })?;
    let within = |all: &Range<usize>| {
        (all.start + part.start).min(all.end)..(all.start + part.end).min(all.end)
    };
    Ok((within(coordinates), within(freedoms)))
}

/// Whether these elements are those of sensors of velocity.
fn velocities(span: &Range<usize>, model: &MjModel) -> bool {
    let (_, spans) = owners(Owner::Sensor, 0, model);
    let mut sensors = (spans.iter().zip(model.sensor_type()))
        .filter(|(of, _)| of.start < span.end && span.start < of.end);
    sensors.all(|(_, kind)| {
        matches!(
            kind,
            MjtSensor::mjSENS_VELOCIMETER
                | MjtSensor::mjSENS_GYRO
                | MjtSensor::mjSENS_JOINTVEL
                | MjtSensor::mjSENS_TENDONVEL
                | MjtSensor::mjSENS_ACTUATORVEL
                | MjtSensor::mjSENS_BALLANGVEL
                | MjtSensor::mjSENS_JOINTLIMITVEL
                | MjtSensor::mjSENS_TENDONLIMITVEL
                | MjtSensor::mjSENS_FRAMELINVEL
                | MjtSensor::mjSENS_FRAMEANGVEL
                | MjtSensor::mjSENS_SUBTREELINVEL
        )
    })
}
