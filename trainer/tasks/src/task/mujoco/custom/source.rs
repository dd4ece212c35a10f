//! Values of a model that a task's file can name.

use super::names::{label, names, number};
use mujoco_rs::prelude::{MjData, MjModel, MjtJoint, MjtObjBase, MjtSensor};
use std::ops::{Add, Range};
use std::sync::Arc;

/// A simulated robot's state.
pub(super) type Data = MjData<Arc<MjModel>>;

/// The state that values are read from.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moment<'a> {
    pub data: &'a Data,
    /// The goals of this episode, in the order of the file.
    pub goals: &'a [f64],
}

/// One of MuJoCo's arrays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Array {
    Qpos,
    Qvel,
    Qacc,
    QfrcActuator,
    QfrcConstraint,
    QfrcPassive,
    Sensor,
    SitePosition,
    GeomPosition,
    BodyPosition,
    BodyOrientation,
    BodyCentre,
    SubtreeCentre,
    BodyInertia,
    BodyVelocity,
    ContactForce,
    Control,
    ActuatorForce,
    TendonLength,
    TendonVelocity,
}

impl Array {
    pub(super) fn values(self, data: &Data) -> &[f64] {
        match self {
            Self::Qpos => data.qpos(),
            Self::Qvel => data.qvel(),
            Self::Qacc => data.qacc(),
            Self::QfrcActuator => data.qfrc_actuator(),
            Self::QfrcConstraint => data.qfrc_constraint(),
            Self::QfrcPassive => data.qfrc_passive(),
            Self::Sensor => data.sensordata(),
            Self::SitePosition => data.site_xpos().as_flattened(),
            Self::GeomPosition => data.geom_xpos().as_flattened(),
            Self::BodyPosition => data.xpos().as_flattened(),
            Self::BodyOrientation => data.xquat().as_flattened(),
            Self::BodyCentre => data.xipos().as_flattened(),
            Self::SubtreeCentre => data.subtree_com().as_flattened(),
            Self::BodyInertia => data.cinert().as_flattened(),
            Self::BodyVelocity => data.cvel().as_flattened(),
            Self::ContactForce => data.cfrc_ext().as_flattened(),
            Self::Control => data.ctrl(),
            Self::ActuatorForce => data.actuator_force(),
            Self::TendonLength => data.ten_length(),
            Self::TendonVelocity => data.ten_velocity(),
        }
    }
}

/// What the elements of an array belong to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Owner {
    /// A joint's coordinates.
    Coordinates,
    /// A joint's degrees of freedom.
    Freedoms,
    Sensor,
    /// An actuator's controls.
    Controls,
    /// An actuator's forces.
    Forces,
    Tendon,
    Site,
    Geom,
    Body,
}

/// One kind of source: its word, its array, what owns the elements, how many an owner has where all have the same number,
/// whether they are velocities.
type Kind = (&'static str, Array, Owner, usize, bool);

const KINDS: [Kind; 20] = [
    ("qpos", Array::Qpos, Owner::Coordinates, 0, false),
    ("qvel", Array::Qvel, Owner::Freedoms, 0, true),
    ("qacc", Array::Qacc, Owner::Freedoms, 0, false),
    (
        "qfrc_actuator",
        Array::QfrcActuator,
        Owner::Freedoms,
        0,
        false,
    ),
    (
        "qfrc_constraint",
        Array::QfrcConstraint,
        Owner::Freedoms,
        0,
        false,
    ),
    (
        "qfrc_passive",
        Array::QfrcPassive,
        Owner::Freedoms,
        0,
        false,
    ),
    ("sensor", Array::Sensor, Owner::Sensor, 0, false),
    ("site", Array::SitePosition, Owner::Site, 3, false),
    ("geom", Array::GeomPosition, Owner::Geom, 3, false),
    ("xpos", Array::BodyPosition, Owner::Body, 3, false),
    ("xquat", Array::BodyOrientation, Owner::Body, 4, false),
    ("xipos", Array::BodyCentre, Owner::Body, 3, false),
    ("subtree_com", Array::SubtreeCentre, Owner::Body, 3, false),
    ("cinert", Array::BodyInertia, Owner::Body, 10, false),
    ("cvel", Array::BodyVelocity, Owner::Body, 6, true),
    ("cfrc_ext", Array::ContactForce, Owner::Body, 6, false),
    ("ctrl", Array::Control, Owner::Controls, 0, false),
    (
        "actuator_force",
        Array::ActuatorForce,
        Owner::Forces,
        0,
        false,
    ),
    ("ten_length", Array::TendonLength, Owner::Tendon, 1, false),
    (
        "ten_velocity",
        Array::TendonVelocity,
        Owner::Tendon,
        1,
        true,
    ),
];

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

/// Sums like NumPy: by eight partial sums from eight values on, in halves beyond 128.
pub(super) fn pairwise<T: Copy + Default + Add<Output = T>>(
    count: usize,
    value: impl Fn(usize) -> T,
) -> T {
    if count == 0 {
        return T::default();
    }
    sum(0, count, &value)
}

fn sum<T: Copy + Add<Output = T>>(start: usize, count: usize, value: &impl Fn(usize) -> T) -> T {
    const LANES: usize = 8;
    const BLOCK: usize = 128;
    let rest = |from: usize, begun: T| (from..start + count).fold(begun, |sum, i| sum + value(i));
    if count < LANES {
        return rest(start + 1, value(start));
    }
    if count > BLOCK {
        let half = count / 2 / LANES * LANES;
        return sum(start, half, value) + sum(start + half, count - half, value);
    }
    let mut lanes: [T; LANES] = std::array::from_fn(|k| value(start + k));
    let whole = count / LANES * LANES;
    for i in (LANES..whole).step_by(LANES) {
        for (k, lane) in lanes.iter_mut().enumerate() {
            *lane = *lane + value(start + i + k);
        }
    }
    let [a, b, c, d, e, f, g, h] = lanes;
    rest(start + whole, ((a + b) + (c + d)) + ((e + f) + (g + h)))
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

/// The names of the owners, and the elements of the array that each has.
fn owners(owner: Owner, width: usize, model: &MjModel) -> (Vec<&str>, Vec<Range<usize>>) {
    let spans = |starts: &[i32], counts: &[i32]| -> Vec<Range<usize>> {
        let span = |(&start, &count): (&i32, &i32)| {
            let start = usize::try_from(start).unwrap_or_default();
            start..start + usize::try_from(count).unwrap_or_default()
        };
        starts.iter().zip(counts).map(span).collect()
    };
    let widths = |free: i32, ball: i32| -> Vec<i32> {
        let width = |kind: &MjtJoint| match kind {
            MjtJoint::mjJNT_FREE => free,
            MjtJoint::mjJNT_BALL => ball,
            MjtJoint::mjJNT_SLIDE | MjtJoint::mjJNT_HINGE => 1,
        };
        model.jnt_type().iter().map(width).collect()
    };
    let rows = |count: usize| (0..count).map(|i| i * width..(i + 1) * width).collect();
    match owner {
        Owner::Coordinates => (
            names(model, model.name_jntadr()),
            spans(model.jnt_qposadr(), &widths(7, 4)),
        ),
        Owner::Freedoms => (
            names(model, model.name_jntadr()),
            spans(model.jnt_dofadr(), &widths(6, 3)),
        ),
        Owner::Sensor => (
            names(model, model.name_sensoradr()),
            spans(model.sensor_adr(), model.sensor_dim()),
        ),
        Owner::Controls => (
            names(model, model.name_actuatoradr()),
            spans(model.actuator_ctrladr(), model.actuator_ctrlnum()),
        ),
        Owner::Forces => (
            names(model, model.name_actuatoradr()),
            spans(model.actuator_outadr(), model.actuator_outnum()),
        ),
        Owner::Tendon => {
            let known = names(model, model.name_tendonadr());
            let rows = rows(known.len());
            (known, rows)
        }
        Owner::Site => {
            let known = names(model, model.name_siteadr());
            let rows = rows(known.len());
            (known, rows)
        }
        Owner::Geom => {
            let known = names(model, model.name_geomadr());
            let rows = rows(known.len());
            (known, rows)
        }
        Owner::Body => {
            let known = names(model, model.name_bodyadr());
            let rows = rows(known.len());
            (known, rows)
        }
    }
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
