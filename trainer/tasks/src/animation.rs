//! An episode as an animated GIF, drawn by MuJoCo's own renderer: for places that cannot show a page.
//!
//! It is drawn without a display, by EGL. States are kept while the episode runs and drawn afterwards, on a copy of the
//! simulation: what is drawn is what happened, and drawing changes nothing.
//!
//! | file | what it holds |
//! |---|---|
//! | `film` | the states that are kept while the episode runs |
//! | `stage` | the renderer, its quality and its camera |

mod film;
mod stage;

use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::sync::{Arc, Mutex};

use tpg_runtime::{HostAgent, Policy, Reset};

use crate::eval::{Arena, Conditions, EvaluationError};
use crate::exit_status::{Failure, Fault as _};
use crate::gif_writer::{Palette, Writer};
use crate::score::Setup;
use crate::task::create;

use film::{Film, FilmedTask, lock};
use stage::Stage;

/// Simulated seconds that an animation shows at most.
pub const SECONDS: u32 = 30;
/// Hundredths of a second for which the last picture stays before the animation begins anew.
const LAST: u64 = 100;
/// Pictures whose colours the palette is made of, at most.
const SAMPLES: usize = 16;

/// What draws the first episode of a scoring command.
pub struct Animator {
    stage: Stage,
    size: [u16; 2],
}

/// What an animation shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shown {
    /// Pictures.
    pub pictures: usize,
    /// Simulated time from the first picture to the last, in seconds.
    pub seconds: f64,
}

impl Animator {
    /// Sets up the renderer for pictures of this width and height, in pixels.
    ///
    /// # Errors
    /// A [`Failure`] of usage if MuJoCo does not simulate the task, of the simulator if there is no EGL or no driver.
    pub fn new(setup: &Setup, size: [u16; 2]) -> Result<Self, Failure> {
        let (task, _) = setup.task_and_wrappers()?;
        let simulation = task.simulation().ok_or_else(|| {
            Failure::usage(anyhow::anyhow!(
                "MuJoCo, whose renderer draws animations, does not simulate {}; --view OUT.html draws every task",
                setup.task
            ))
        })?;
        Ok(Animator {
            stage: Stage::new(simulation, size)?,
            size,
        })
    }

    /// Runs the first episode once more, the same in every bit, and writes its first [`SECONDS`] as a GIF.
    ///
    /// # Errors
    /// A [`Failure`] if policy or task cannot be used, if the renderer fails, or if the file, `path` in messages, cannot be
    /// written.
    pub fn write(mut self, setup: &Setup, to: impl Write, path: &Path) -> Result<Shown, Failure> {
        let film = film(setup)?;
        let pictures = &film.pictures;
        let mut samples = Vec::new();
        for moment in pictures
            .iter()
            .step_by(pictures.len().div_ceil(SAMPLES).max(1))
        {
            samples.extend_from_slice(self.stage.draw(&moment.state)?);
        }
        let unwritable = |result: io::Result<()>| result.or_unwritable(path);
        let writer = Writer::new(BufWriter::new(to), self.size, Palette::of(&samples));
        let mut writer = writer.or_unwritable(path)?;
        let ends = pictures.iter().skip(1).map(|moment| moment.hundredths);
        let last = pictures.last().map_or(0, |moment| moment.hundredths);
        for (moment, end) in pictures.iter().zip(ends.chain([last + LAST])) {
            let time = end.saturating_sub(moment.hundredths);
            let time = u16::try_from(time).unwrap_or(u16::MAX);
            unwritable(writer.picture(self.stage.draw(&moment.state)?, time))?;
        }
        unwritable(writer.finish())?;
        Ok(Shown {
            pictures: pictures.len(),
            seconds: last as f64 / 100.0,
        })
    }
}

/// The first episode.
fn film(setup: &Setup) -> Result<Film, Failure> {
    let policy = Policy::load(&setup.blob)?;
    let agent = HostAgent::new(policy);
    let mut agent = Box::new(agent.or_bad_input(format!("cannot run {}", setup.file.display()))?);
    let (task, wrappers) = setup.task_and_wrappers()?;
    let steps = u64::from(SECONDS) * 1_000_000 / u64::from(task.spec().period_us.max(1));
    let film = Arc::new(Mutex::new(Film::default()));
    let mut arena = Arena::new(Box::new(FilmedTask::new(task, Arc::clone(&film))), wrappers);
    arena.impose(Conditions {
        max_steps: u32::try_from(steps).unwrap_or(u32::MAX).max(1),
        ..Conditions::default()
    });
    let mut controller = setup.disturbed(&arena, &mut *agent)?;
    for seed in setup.episode_seeds().take(1) {
        let run = arena.episode(&mut controller, Reset::Agent, seed);
        run.map_err(|source| EvaluationError { episode: 0, source })?;
    }
    Ok(std::mem::take(&mut *lock(&film)))
}

/// Tries to draw a robot.
///
/// # Errors
/// A [`Failure`] of the simulator that says what is missing.
pub fn try_to_draw() -> Result<(), Failure> {
    let task = create("hopper")?;
    let Some(simulation) = task.simulation() else {
        return Ok(());
    };
    let state = simulation.state(film::DRAWN);
    Stage::new(simulation, [64, 48])?.draw(&state)?;
    Ok(())
}
