//! Robots out of files: the description, and the model, which all robots of one kind share.

use super::description::{Description, Part};
use super::files::{read, sources};
use super::plant::Robot;
use super::sound;
use crate::task::mujoco::sim::compile;
use crate::task::{Randomization, Task, UnknownTask};
use mujoco_rs::error::MjModelError;
use mujoco_rs::prelude::{MjModel, MjtDisableBit};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// Makes the task that a TOML file describes; names of built-in tasks are taken.
pub(in crate::task) fn load(
    path: &Path,
    taken: &[&str],
    randomization: Randomization,
) -> Result<Box<dyn Task>, UnknownTask> {
    let bad = |path: &Path, why: String| UnknownTask::BadFile {
        path: path.to_owned(),
        why,
    };
    let (mut description, model_path) = read(path)?;
    if randomization == Randomization::Off {
        description.stop_randomizing();
    }
    if taken.contains(&description.name.as_str()) {
        let why = format!("name = {:?}: a built-in task has it", description.name);
        return Err(bad(path, why));
    }
    let mut key = format!("{}{:?}", model_path.display(), description.leave_out);
    for (name, digest) in sources(path)? {
        key += &format!("{name}{digest:02x?}");
    }
    let compiled = || compile(|| prepared(&description, || MjModel::from_xml(&model_path)));
    let model = shared(&key, false, compiled).map_err(|why| bad(&model_path, why))?;
    sound::check(&model).map_err(|why| bad(&model_path, why))?;
    let name = model_path.to_string_lossy();
    let task = Robot::new(&description, model, &name).map_err(|why| bad(path, why))?;
    Ok(Box::new(task))
}

/// Compiles a model and tells MuJoCo what it need not compute.
fn prepared(
    description: &Description,
    read: impl FnOnce() -> Result<MjModel, MjModelError>,
) -> Result<MjModel, MjModelError> {
    let mut model = read()?;
    for part in &description.leave_out {
        model.opt_mut().disableflags |= match part {
            Part::Contacts => MjtDisableBit::mjDSBL_CONTACT as i32,
            Part::Islands => MjtDisableBit::mjDSBL_ISLAND as i32,
            Part::Sensors => MjtDisableBit::mjDSBL_SENSOR as i32,
        };
    }
    Ok(model)
}

/// The compiled models of this process that are in use, or are to be kept.
type Models = BTreeMap<String, (Weak<MjModel>, Option<Arc<MjModel>>)>;

/// The model of this key, compiled by the first who asks and shared by all who ask while one of them has it.
fn shared(
    key: &str,
    keep: bool,
    compile: impl FnOnce() -> Result<Arc<MjModel>, String>,
) -> Result<Arc<MjModel>, String> {
    static MODELS: Mutex<Models> = Mutex::new(BTreeMap::new());
    let mut models = MODELS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(model) = models.get(key).and_then(|(model, _)| model.upgrade()) {
        return Ok(model);
    }
    let model = compile()?;
    models.retain(|_, (model, _)| model.strong_count() > 0);
    let kept = keep.then(|| Arc::clone(&model));
    models.insert(key.to_owned(), (Arc::downgrade(&model), kept));
    Ok(model)
}

impl Robot {
    /// Makes a robot of a description and the text of its model, which is compiled once and then shared.
    pub(super) fn with_text(description: &Description, text: &str) -> Result<Self, String> {
        let key = format!("{}{:?}", description.model, description.leave_out);
        let model = shared(&key, true, || {
            compile(|| prepared(description, || MjModel::from_xml_string(text)))
        })?;
        Self::new(description, model, &description.model)
    }
}
