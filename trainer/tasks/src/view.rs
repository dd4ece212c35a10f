//! Episodes as a page to look at: the robot in three dimensions, and beside it what the policy saw, did and earned.
//!
//! The page is one HTML file that needs neither network nor library. It shows what happened: the task and the agent are
//! followed while they run, and the runtime's own observer tells which programs bid what.
//!
//! | file | what it holds |
//! |---|---|
//! | `tape` | what is noted while episodes run |
//! | `series` | numbers in two bytes each |
//! | `solids` | solids and meshes, thinned out where they are large |
//! | `document` | all of it as the page's data |
//! | `page/*` | the page itself: style, drawing, plots |

mod document;
mod series;
mod solids;
mod tape;

use std::sync::{Arc, Mutex, PoisonError};

use tpg_runtime::{HostAgent, Policy, Reset};

use crate::eval::{Arena, EvaluationError};
use crate::exit_status::{Failure, Fault as _};
use crate::page;
use crate::score::Setup;
use crate::task::stack_text;

use document::{Document, Facts};
use tape::{Tape, WatchedAgent, WatchedTask};

/// Episodes that a page shows at most.
pub const EPISODES: u32 = 10;
/// Bytes of notes after which no further episode is begun.
const ENOUGH: usize = 24_000_000;

const STYLE: &str = include_str!("view/page/view.css");
const BODY: &str = include_str!("view/page/view.html");
const SCRIPTS: [&str; 5] = [
    include_str!("view/page/data.js"),
    include_str!("view/page/shapes.js"),
    include_str!("view/page/drawing.js"),
    include_str!("view/page/plots.js"),
    include_str!("view/page/player.js"),
];

/// A page, and how many of the episodes it shows.
#[derive(Debug, Clone)]
pub struct View {
    /// The HTML file.
    pub html: String,
    /// Episodes that it shows: the first ones.
    pub episodes: u32,
}

/// Runs the first episodes of a scoring command once more, and makes a page of them.
///
/// They are the same in every bit, as disturbed as they were then. At most [`EPISODES`] are shown, fewer if they are long.
///
/// # Errors
/// A [`Failure`] if the policy or the task cannot be used.
pub fn view(setup: &Setup) -> Result<View, Failure> {
    let policy = Policy::load(&setup.blob)?;
    let agent = HostAgent::new(policy);
    let agent = agent.or_bad_input(format!("cannot run {}", setup.file.display()))?;
    let (task, wrappers) = setup.task_and_wrappers()?;
    let (scene, spec) = (task.scene(), task.spec().clone());
    let inputs = wrappers.inputs().to_vec();
    let tape = Arc::new(Mutex::new(Tape::default()));
    let task = WatchedTask::new(task, wrappers.clone(), Arc::clone(&tape));
    let mut arena = Arena::new(Box::new(task), wrappers);
    let agent = WatchedAgent::new(Box::new(agent), Arc::clone(&tape));
    let mut controller = setup.disturbed(&arena, agent)?;
    let notes = || tape.lock().unwrap_or_else(PoisonError::into_inner);
    let mut episodes = 0;
    for seed in setup.episode_seeds().take(EPISODES as usize) {
        let what = match episodes {
            0 => Reset::Agent,
            _ => Reset::Episode,
        };
        let run = arena.episode(&mut controller, what, seed);
        run.map_err(|source| EvaluationError {
            episode: episodes as usize,
            source,
        })?;
        episodes += 1;
        if notes().bytes() > ENOUGH {
            break;
        }
    }
    let file = setup.file.file_name().unwrap_or_default();
    let document = Document::new(
        Facts {
            policy: file.to_string_lossy().into_owned(),
            task: setup.task.clone(),
            observability: stack_text(&setup.observability),
            disturbances: setup.disturb.iter().map(ToString::to_string).collect(),
            seed: setup.seed,
            period: f64::from(spec.period_us) / 1e6,
        },
        &scene,
        &inputs,
        &spec,
        &notes(),
    );
    Ok(View {
        html: page::page(STYLE, BODY, &document, &SCRIPTS)?,
        episodes,
    })
}
