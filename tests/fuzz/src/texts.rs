//! Files that the trainer reads: checkpoints, configurations, task descriptions, traces, rows of experiments.

use std::fs;
use std::path::PathBuf;
use std::sync::OnceLock;

use sha2::{Digest as _, Sha256};
use tempfile::TempDir;
use tpg_experiments::row::read_row;
use tpg_runtime::{HostAgent, Policy};
use tpg_tasks::task::{self, Rng};
use tpg_tasks::trace::replay;
use tpg_trainer::config::{Preset, Settings, resolve};
use tpg_trainer::session;

use super::BUILT_IN;

const MODEL: &str = include_str!("../../../docs/examples/crane/crane.xml");
/// Where the body of a checkpoint begins: behind magic, version and SHA-256.
const BODY: usize = 8 + 4 + 32;

/// A file of this process, in memory where the system offers that.
fn file(name: &str) -> PathBuf {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let memory = tempfile::tempdir_in("/dev/shm");
        let folder = memory
            .or_else(|_| tempfile::tempdir())
            .expect("a temporary folder");
        fs::write(folder.path().join("crane.xml"), MODEL).expect("written");
        folder
    });
    folder.path().join(name)
}

/// Any bytes as a checkpoint, with the digest that they should have. What loads can write its champion.
///
/// # Panics
/// If a promise is broken.
pub fn checkpoint(data: &[u8]) {
    let mut sealed = data.to_vec();
    // Otherwise nearly all changes would end at the digest.
    if let Some((head, body)) = sealed.split_at_mut_checked(BODY) {
        head[BODY - 32..].copy_from_slice(&Sha256::digest(body));
    }
    let path = file("checkpoint");
    fs::write(&path, sealed).expect("written");
    if let Ok(checkpoint) = session::load(&path) {
        let _ = checkpoint.session.export_champion();
    }
}

/// Any text as the configuration of a run.
///
/// # Panics
/// If a promise is broken.
pub fn configuration(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else {
        return;
    };
    let preset = Preset::find("cartpole-sr-sm").expect("a preset");
    if let Ok(config) = resolve(&preset, Some(text), &[]) {
        // Other tasks would read other files.
        if config.task.starts_with("cartpole") {
            let _ = Settings::new(&config);
        }
    }
}

/// Any text as the description of a robot, whose model is a small one. What loads takes steps.
///
/// # Panics
/// If a promise is broken.
pub fn task(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else {
        return;
    };
    // Paths in a description lead to files, and only this one may be read.
    if text.matches("model").count() > 1 || !text.contains("model = \"crane.xml\"") {
        return;
    }
    let path = file("crane.toml");
    fs::write(&path, text).expect("written");
    let Ok(mut task) = task::create(&path.to_string_lossy()) else {
        return;
    };
    task.reset(&mut Rng::new(7));
    let mut observation = vec![0.0; task.spec().inputs.len()];
    task.observe(&mut observation);
}

/// Any bytes as a trace.
///
/// # Panics
/// If a promise is broken.
pub fn trace(data: &[u8]) {
    let policy = Policy::load(BUILT_IN).expect("valid");
    let mut agent = Box::new(HostAgent::new(policy).expect("fits"));
    let _ = replay(data, BUILT_IN, &mut agent);
}

/// Any bytes as a row of an experiment.
///
/// # Panics
/// If a promise is broken.
pub fn rows(data: &[u8]) {
    let path = file("cartpole.sr.1.csv");
    fs::write(&path, data).expect("written");
    let _ = read_row(&path);
}
