//! Models that differ from episode to episode.
//!
//! A task that asks for it keeps two copies of the model, one that its simulation uses and one to change for the next
//! episode; any other task shares the compiled model with all of its kind.

use super::description::Scales;
use crate::task::Rng;
use crate::task::mujoco::sim::Sim;
use mujoco_rs::prelude::{MjModel, MjtGain};
use std::sync::Arc;

/// What a description scales, and the copy that is not in use.
#[derive(Debug)]
pub(super) struct Randomize {
    scales: Scales,
    /// The model as its file has it.
    original: Arc<MjModel>,
    spare: Arc<MjModel>,
}

impl Randomize {
    /// Checks what is to be scaled; `None` where nothing is.
    pub(super) fn new(scales: Scales, original: &Arc<MjModel>) -> Result<Option<Self>, String> {
        if scales.all().iter().all(|(_, range)| range.is_none()) {
            return Ok(None);
        }
        let scalable =
            |kind: &MjtGain| matches!(kind, MjtGain::mjGAIN_FIXED | MjtGain::mjGAIN_AFFINE);
        if scales.actuator_gain.is_some() && !original.actuator_gaintype().iter().all(scalable) {
            return Err(
                "randomize.actuator-gain: the model has a muscle or another actuator whose gain is no factor; leave the \
                 key out"
                    .into(),
            );
        }
        Ok(Some(Self {
            scales,
            original: Arc::clone(original),
            spare: Arc::new((**original).clone()),
        }))
    }

    /// Draws the factors of an episode and gives the simulation a model with them, before it is reset.
    ///
    /// The stream of the initial state stays where it is, so that it is the same with and without.
    pub(super) fn draw(&mut self, sim: &mut Sim, rng: &Rng) {
        let mut rng = Rng::new(rng.clone().word());
        let mut factor = |range: Option<[f64; 2]>| {
            // One word each, whether or not the file has the key, so that one key does not change another.
            let drawn = rng.uniform(0.0, 1.0);
            range.map_or(1.0, |[low, high]| low + (high - low) * drawn)
        };
        let scales = self.scales;
        let factors = Factors {
            mass: factor(scales.mass),
            inertia: factor(scales.inertia),
            friction: factor(scales.friction),
            damping: factor(scales.damping),
            gain: factor(scales.actuator_gain),
            gravity: factor(scales.gravity),
        };
        // The simulation has the other copy, so this one is nobody else's.
        if let Some(model) = Arc::get_mut(&mut self.spare) {
            factors.apply(&self.original, model);
        }
        let spare = Arc::clone(&self.original);
        let model = std::mem::replace(&mut self.spare, spare);
        self.spare = sim.data.swap_model(model);
    }
}

/// The factors of one episode.
struct Factors {
    mass: f64,
    inertia: f64,
    friction: f64,
    damping: f64,
    gain: f64,
    gravity: f64,
}

impl Factors {
    /// Makes a copy the original times the factors.
    fn apply(&self, original: &MjModel, model: &mut MjModel) {
        let scale = |to: &mut [f64], from: &[f64], factor: f64| {
            for (to, from) in to.iter_mut().zip(from) {
                *to = from * factor;
            }
        };
        scale(model.body_mass_mut(), original.body_mass(), self.mass);
        scale(
            model.body_subtreemass_mut(),
            original.body_subtreemass(),
            self.mass,
        );
        scale(
            model.body_inertia_mut().as_flattened_mut(),
            original.body_inertia().as_flattened(),
            self.mass * self.inertia,
        );
        scale(
            model.geom_friction_mut().as_flattened_mut(),
            original.geom_friction().as_flattened(),
            self.friction,
        );
        scale(
            model.pair_friction_mut().as_flattened_mut(),
            original.pair_friction().as_flattened(),
            self.friction,
        );
        scale(
            model.dof_damping_mut(),
            original.dof_damping(),
            self.damping,
        );
        scale(
            model.actuator_biasprm_mut().as_flattened_mut(),
            original.actuator_biasprm().as_flattened(),
            self.gain,
        );
        // SAFETY: `new` has checked that every gain is fixed or affine, so these are factors, and no size or address.
        let gains = unsafe { model.actuator_gainprm_mut() };
        scale(
            gains.as_flattened_mut(),
            original.actuator_gainprm().as_flattened(),
            self.gain,
        );
        scale(
            &mut model.opt_mut().gravity,
            &original.opt().gravity,
            self.gravity,
        );
    }
}
