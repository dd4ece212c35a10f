//! Where episodes start.

use super::arrays::Data;
use super::description::{Description, Distribution, Joint, Place};
use super::expression::Expression;
use super::measure::Now;
use super::names::{names, number};
use super::source::{Moment, joint};
use super::terms::Scope;
use crate::task::Rng;
use crate::task::mujoco::sim::Sim;
use mujoco_rs::prelude::{MjModel, MjtJoint};

/// How often ranges are drawn before the last draw is taken.
const DRAWS: usize = 1000;

/// A random number that is added to one coordinate or velocity.
#[derive(Debug, Clone, Copy)]
struct Noise {
    index: usize,
    scale: f64,
    distribution: Distribution,
}

impl Noise {
    fn add(&self, values: &mut [f64], rng: &mut Rng) {
        if let Some(value) = values.get_mut(self.index) {
            *value += match self.distribution {
                Distribution::Uniform => rng.uniform(-self.scale, self.scale),
                Distribution::Normal => rng.normal() * self.scale,
            };
        }
    }
}

/// A coordinate or velocity that has a value of its own, or a range to draw it from.
#[derive(Debug, Clone, Copy)]
struct Placed {
    velocity: bool,
    index: usize,
    place: Place,
}

/// The distribution of initial states.
#[derive(Debug, Clone)]
pub(super) struct Start {
    keyframe: Option<usize>,
    positions: Vec<Noise>,
    velocities: Vec<Noise>,
    placed: Vec<Placed>,
    goals: Vec<[f64; 2]>,
    until: Option<Expression>,
}

impl Start {
    pub(super) fn new(description: &Description, scope: Scope<'_>) -> Result<Self, String> {
        let (reset, model) = (&description.reset, scope.model);
        let keyframe = reset.keyframe.as_ref().map(|name| {
            number("keyframe", name, &names(model, model.name_keyadr()))
                .map_err(|why| format!("reset.keyframe = {name:?}: {why}"))
        });
        let (positions, turns) = coordinates(model);
        let noise = |index: usize, scale: f64, distribution: Distribution| Noise {
            index,
            scale,
            distribution,
        };
        let mut start = Self {
            keyframe: keyframe.transpose()?,
            positions: Vec::new(),
            velocities: (0..model.dof_damping().len())
                .map(|index| noise(index, reset.velocity_noise, reset.velocity_distribution))
                .collect(),
            placed: Vec::new(),
            goals: description
                .goal
                .iter()
                .map(|goal| [goal.low, goal.high])
                .collect(),
            until: None,
        };
        for index in 0..model.qpos0().len() {
            let scale = if positions.contains(&index) {
                Some(reset.position_noise)
            } else if turns.contains(&index) {
                reset.orientation_noise
            } else {
                None
            };
            let scale = scale.map(|scale| noise(index, scale, reset.position_distribution));
            start.positions.extend(scale);
        }
        for joint in &reset.joint {
            let why = |why| format!("reset.joint = {:?}: {why}", joint.joint);
            start.place(joint, model).map_err(why)?;
        }
        if let Some(text) = &reset.redraw_until {
            let until = scope.expression(text)?;
            if until.any(|measure| !measure.is_state()) {
                return Err(format!(
                    "reset.redraw-until = {text:?}: only qpos, qvel, sin, cos and goal are known before the first step"
                ));
            }
            start.until = Some(until);
        }
        Ok(start)
    }

    /// Gives a joint its own start.
    fn place(&mut self, joint_: &Joint, model: &MjModel) -> Result<(), String> {
        let (coordinates, freedoms) = joint(&joint_.joint, model)?;
        for (velocity, place, scale, span) in [
            (false, joint_.position, joint_.position_noise, coordinates),
            (true, joint_.velocity, joint_.velocity_noise, freedoms),
        ] {
            let noises = if velocity {
                &mut self.velocities
            } else {
                &mut self.positions
            };
            if let Some(place) = place {
                if span.len() != 1 {
                    return Err(format!(
                        "it has {} coordinates: choose one by an index in brackets, as in {}[0]",
                        span.len(),
                        joint_.joint
                    ));
                }
                self.placed.push(Placed {
                    velocity,
                    index: span.start,
                    place,
                });
                // A value of its own has noise only where the file says so.
                if scale.is_none() {
                    noises.retain(|noise| !span.contains(&noise.index));
                }
            }
            if let Some(scale) = scale {
                let of_joint = noises
                    .iter_mut()
                    .filter(|noise| span.contains(&noise.index));
                of_joint.for_each(|noise| noise.scale = scale);
            }
        }
        Ok(())
    }

    /// Starts an episode; says whether the last draw of the ranges is one that the file accepts.
    pub(super) fn reset(&self, sim: &mut Sim, goals: &mut [f64], rng: &mut Rng) -> bool {
        let mut accepted = false;
        sim.reset(|data| {
            if let Some(key) = self.keyframe {
                // The key is one of the model's, so this cannot fail.
                let _ = data.reset_keyframe(key);
            }
            for placed in &self.placed {
                if let Place::At(value) = placed.place {
                    placed.set(data, value);
                }
            }
            for noise in &self.positions {
                noise.add(data.qpos_mut(), rng);
            }
            for noise in &self.velocities {
                noise.add(data.qvel_mut(), rng);
            }
            for _ in 0..DRAWS {
                for placed in &self.placed {
                    if let Place::Within([low, high]) = placed.place {
                        placed.set(data, rng.uniform(low, high));
                    }
                }
                for (goal, [low, high]) in goals.iter_mut().zip(&self.goals) {
                    *goal = rng.uniform(*low, *high);
                }
                let now = Now::at(Moment { data, goals });
                accepted = (self.until.as_ref()).is_none_or(|until| until.value(now) != 0.0);
                if accepted {
                    break;
                }
            }
        });
        accepted
    }
}

impl Placed {
    fn set(&self, data: &mut Data, value: f64) {
        let values = if self.velocity {
            data.qvel_mut()
        } else {
            data.qpos_mut()
        };
        if let Some(slot) = values.get_mut(self.index) {
            *slot = value;
        }
    }
}

/// The coordinates of hinges, slides and the places of free bodies; and those of orientations.
fn coordinates(model: &MjModel) -> (Vec<usize>, Vec<usize>) {
    let (mut places, mut turns) = (Vec::new(), Vec::new());
    for (kind, &start) in model.jnt_type().iter().zip(model.jnt_qposadr()) {
        let start = usize::try_from(start).unwrap_or_default();
        let (place, turn) = match kind {
            MjtJoint::mjJNT_FREE => (3, 4),
            MjtJoint::mjJNT_BALL => (0, 4),
            MjtJoint::mjJNT_SLIDE | MjtJoint::mjJNT_HINGE => (1, 0),
        };
        places.extend(start..start + place);
        turns.extend(start + place..start + place + turn);
    }
    (places, turns)
}
