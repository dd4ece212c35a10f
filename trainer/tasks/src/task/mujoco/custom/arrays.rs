//! MuJoCo's arrays, and the objects that their elements belong to.

use super::names::names;
use mujoco_rs::prelude::{MjData, MjModel, MjtJoint};
use std::ops::Range;
use std::sync::Arc;

/// A simulated robot's state.
pub(super) type Data = MjData<Arc<MjModel>>;

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
pub(super) enum Owner {
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
pub(super) type Kind = (&'static str, Array, Owner, usize, bool);

pub(super) const KINDS: [Kind; 20] = [
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

/// The names of the owners, and the elements of the array that each has.
pub(super) fn owners(
    owner: Owner,
    width: usize,
    model: &MjModel,
) -> (Vec<&str>, Vec<Range<usize>>) {
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
