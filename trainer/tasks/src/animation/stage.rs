//! MuJoCo's own renderer, set up for a robot.

use std::sync::Arc;

use mujoco_rs::prelude::{MjData, MjModel, MjtCamLight, MjtJoint, MjvCamera, RendererError};
use mujoco_rs::renderer::MjRenderer;

use super::film::DRAWN;
use crate::exit_status::Failure;
use crate::task::Simulation;

/// What to do where there is no OpenGL.
const NEEDED: &str =
    "MuJoCo's renderer needs EGL and a driver, on Debian: apt-get install libegl1 libgl1-mesa-dri";

/// A robot in front of a camera.
pub(super) struct Stage {
    renderer: MjRenderer,
    /// A copy of the simulation, so that drawing changes nothing of it.
    data: MjData<Arc<MjModel>>,
    /// The body that the camera follows, where the model has no camera that does.
    followed: Option<usize>,
}

impl Stage {
    /// Sets up a renderer for pictures of this width and height.
    ///
    /// # Errors
    /// A [`Failure`] of the simulator where there is no EGL or no driver.
    pub(super) fn new(simulation: &Simulation, [width, height]: [u16; 2]) -> Result<Self, Failure> {
        let mut model = MjModel::clone(simulation.model());
        let (width, height) = (u32::from(width), u32::from(height));
        prepare(&mut model, [width, height]);
        let mut data = MjData::new(Arc::new(model));
        data.forward();
        let (camera, followed) = camera(&data);
        let renderer = MjRenderer::builder();
        let renderer = renderer.width(width).height(height).camera(camera);
        let renderer = renderer
            .build(data.model())
            .map_err(|error| failed(&error))?;
        Ok(Stage {
            renderer,
            data,
            followed,
        })
    }

    /// Draws a state of the simulation: red, green, blue, and so on.
    ///
    /// # Errors
    /// A [`Failure`] of the simulator where it cannot be drawn.
    pub(super) fn draw(&mut self, state: &[f64]) -> Result<&[u8], Failure> {
        self.data.set_state(state, DRAWN)?;
        self.data.forward();
        if let Some(body) = self.followed {
            self.renderer.camera_mut().lookat = self.data.subtree_com()[body];
        }
        let drawn = self.renderer.sync_data(&mut self.data);
        let drawn = drawn.and_then(|()| self.renderer.render());
        drawn.map_err(|error| failed(&error))?;
        Ok(self.renderer.rgb_flat().unwrap_or_default())
    }
}

/// Leaves out what takes a processor most of its time: shadows, mirrors, several samples for each pixel.
fn prepare(model: &mut MjModel, [width, height]: [u32; 2]) {
    let visual = model.vis_mut();
    (visual.quality.shadowsize, visual.quality.offsamples) = (0, 0);
    visual.global.offwidth = width.cast_signed();
    visual.global.offheight = height.cast_signed();
    model.mat_reflectance_mut().fill(0.0);
}

/// The model's first camera that goes along; else one that follows a robot that travels, or one that sees all.
fn camera(data: &Simulation) -> (MjvCamera, Option<usize>) {
    let model = data.model();
    let along = |mode: &MjtCamLight| {
        matches!(
            mode,
            MjtCamLight::mjCAMLIGHT_TRACK | MjtCamLight::mjCAMLIGHT_TRACKCOM
        )
    };
    if let Some(camera) = model.cam_mode().iter().position(along) {
        return (MjvCamera::new_fixed(camera), None);
    }
    match travelling(model) {
        Some(body) => (beside(data, body), Some(body)),
        None => (MjvCamera::new_free(model), None),
    }
}

/// A camera at the side of a body, as far away as the body and what hangs on it ask for, and a little above.
fn beside(data: &Simulation, body: usize) -> MjvCamera {
    /// Degrees.
    const ELEVATION: f64 = -12.0;
    /// Distance for a sphere of radius 1; its edges are seen from 2.6, with MuJoCo's usual field of view of 45 degrees.
    const DISTANCE: f64 = 3.1;
    let model = data.model();
    let centre = data.subtree_com()[body];
    let geoms = model.geom_bodyid().iter().zip(model.geom_rbound());
    let geoms = geoms.zip(data.geom_xpos());
    let reaches = geoms.filter_map(|((owner, radius), position)| {
        let root = *model.body_rootid().get(usize::try_from(*owner).ok()?)?;
        let squares = position.iter().zip(centre).map(|(a, b)| (a - b) * (a - b));
        (usize::try_from(root) == Ok(body)).then(|| squares.sum::<f64>().sqrt() + radius)
    });
    MjvCamera {
        lookat: centre,
        distance: DISTANCE * reaches.fold(0.0, f64::max).max(1e-3),
        elevation: ELEVATION,
        ..MjvCamera::new_free(model)
    }
}

/// The body of the model's first joint, if it can go away: an arm stays where it is mounted.
fn travelling(model: &MjModel) -> Option<usize> {
    let root = *model.jnt_bodyid().first()?;
    let joints = model.jnt_bodyid().iter().zip(model.jnt_type());
    let mut own = joints.filter(|(body, _)| **body == root);
    let travels =
        own.any(|(_, joint)| matches!(joint, MjtJoint::mjJNT_FREE | MjtJoint::mjJNT_SLIDE));
    travels.then(|| usize::try_from(root).ok()).flatten()
}

/// The failure of a renderer, with what to do.
fn failed(error: &RendererError) -> Failure {
    let why = match error {
        RendererError::GlutinError(error) => error.to_string(),
        error => error.to_string(),
    };
    Failure::peer(anyhow::anyhow!("cannot draw: {why}; {NEEDED}"))
}
