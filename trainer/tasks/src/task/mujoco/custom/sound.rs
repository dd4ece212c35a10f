//! Refuses a compiled model with numbers that no simulation can use.
//!
//! MuJoCo compiles a model whose mass or gravity is not a number, and then fails in every step.

use super::names::{label, names};
use mujoco_rs::prelude::MjModel;

/// Checks the numbers that the physics reads.
pub(super) fn check(model: &MjModel) -> Result<(), String> {
    let opt = model.opt();
    if !(opt.timestep.is_finite() && opt.timestep > 0.0) {
        return Err(format!(
            "the timestep is {}: give <option timestep=\"...\"/> a finite number above 0",
            opt.timestep
        ));
    }
    let options = [
        ("gravity", &opt.gravity[..]),
        ("wind", &opt.wind),
        ("magnetic field", &opt.magnetic),
        (
            "density, viscosity or impratio",
            &[opt.density, opt.viscosity, opt.impratio],
        ),
    ];
    for (what, values) in options {
        if let Some(value) = values.iter().find(|value| !value.is_finite()) {
            return Err(format!(
                "the {what} of the model is {value}: give <option> a finite number"
            ));
        }
    }
    bodies(model)?;
    joints(model)?;
    let geoms = names(model, model.name_geomadr());
    let of_geom = |what, values: &[f64], width| finite("geom", &geoms, what, values, width);
    of_geom("size", model.geom_size().as_flattened(), 3)?;
    of_geom("position", model.geom_pos().as_flattened(), 3)?;
    of_geom("orientation", model.geom_quat().as_flattened(), 4)?;
    of_geom("friction", model.geom_friction().as_flattened(), 3)?;
    of_geom("margin", model.geom_margin(), 1)?;
    actuators(model)
}

fn bodies(model: &MjModel) -> Result<(), String> {
    let names = names(model, model.name_bodyadr());
    let check = |what, values: &[f64], width| finite("body", &names, what, values, width);
    check("mass", model.body_mass(), 1)?;
    check("inertia", model.body_inertia().as_flattened(), 3)?;
    check("position", model.body_pos().as_flattened(), 3)?;
    check("orientation", model.body_quat().as_flattened(), 4)?;
    check("centre of mass", model.body_ipos().as_flattened(), 3)?;
    check("gravity compensation", model.body_gravcomp(), 1)
}

fn joints(model: &MjModel) -> Result<(), String> {
    let names = names(model, model.name_jntadr());
    let check = |what, values: &[f64], width| finite("joint", &names, what, values, width);
    check("position", model.jnt_pos().as_flattened(), 3)?;
    check("axis", model.jnt_axis().as_flattened(), 3)?;
    check("stiffness", model.jnt_stiffness(), 1)?;
    check("range", model.jnt_range().as_flattened(), 2)?;
    // Degrees of freedom have no names; the joint that they belong to does.
    let owners: Vec<&str> = (model.dof_jntid().iter())
        .map(|&joint| {
            let joint = usize::try_from(joint).unwrap_or(usize::MAX);
            names.get(joint).copied().unwrap_or_default()
        })
        .collect();
    let check = |what, values: &[f64]| finite("joint", &owners, what, values, 1);
    check("damping", model.dof_damping())?;
    check("armature", model.dof_armature())?;
    check("frictionloss", model.dof_frictionloss())?;
    let plain = |what, values: &[f64]| finite("coordinate", &[], what, values, 1);
    plain("initial position", model.qpos0())?;
    plain("spring reference", model.qpos_spring())
}

fn actuators(model: &MjModel) -> Result<(), String> {
    let names = names(model, model.name_actuatoradr());
    let check = |what, values: &[f64]| {
        let width = values.len() / names.len().max(1);
        finite("actuator", &names, what, values, width)
    };
    check("gain", model.actuator_gainprm().as_flattened())?;
    check("bias", model.actuator_biasprm().as_flattened())?;
    check("dynamics", model.actuator_dynprm().as_flattened())?;
    check("gear", model.actuator_gear().as_flattened())?;
    check("control range", model.actuator_ctrlrange().as_flattened())?;
    check("force range", model.actuator_forcerange().as_flattened())
}

/// Refuses the first of the objects one of whose `width` values is not finite.
///
/// A range may be infinite, for that means no limit.
fn finite(
    kind: &str,
    names: &[&str],
    what: &str,
    values: &[f64],
    width: usize,
) -> Result<(), String> {
    let bad = |value: &f64| value.is_nan() || value.is_infinite() && !what.ends_with("range");
    match values.iter().position(bad) {
        None => Ok(()),
        Some(at) => Err(format!(
            "the {what} of the {} is {}: give a finite number",
            label(kind, at / width.max(1), names),
            values[at]
        )),
    }
}
