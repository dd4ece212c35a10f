//! The data of the page.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use super::series::{Series, unit};
use super::solids::{DrawnMesh, DrawnSolid, meshes};
use super::tape::{Decision, Notes, Tape};
use crate::page::base64;
use crate::task::{ActionSpace, Channel, Pose, Scene, Spec};

/// Programs whose bids a page shows at most: those that act most often, then those that bid most often.
const PROGRAMS: usize = 48;
/// Bytes of an episode's poses above which only every second, third, ... of them is kept.
const POSE_BYTES: usize = 6_000_000;
/// Ratio of the greatest bid to the middle one above which bids are drawn on a scale of powers of ten.
const WIDE: f64 = 100.0;
/// What stands for a program that is not shown.
const OTHER: u16 = u16::MAX;

/// What was recorded, in words.
#[derive(Debug, Serialize)]
pub(super) struct Facts {
    pub(super) policy: String,
    pub(super) task: String,
    pub(super) observability: String,
    pub(super) disturbances: Vec<String>,
    pub(super) seed: u64,
    /// Seconds between two decisions.
    pub(super) period: f64,
}

#[derive(Debug, Serialize)]
pub(super) struct Document {
    version: &'static str,
    facts: Facts,
    solids: Vec<DrawnSolid>,
    meshes: Vec<DrawnMesh>,
    /// Where each solid was at the start: its position and its rotation.
    rest: Vec<[f32; 7]>,
    /// The solids that move, by number.
    moving: Vec<usize>,
    /// Steps from one kept pose to the next.
    stride: usize,
    inputs: Vec<Named>,
    outputs: Vec<Named>,
    /// How many actions there are to choose from; none where an action has values.
    choices: Option<u16>,
    programs: Vec<Program>,
    /// Programs that bid, shown or not.
    bidders: usize,
    /// Whether bids are given by the area sine of what they are.
    wide: bool,
    episodes: Vec<Episode>,
}

#[derive(Debug, Serialize)]
struct Named {
    name: String,
    unit: String,
}

#[derive(Debug, Serialize)]
struct Program {
    id: u16,
    /// Decisions, or outputs given, that were its own.
    acted: u64,
    /// The actions that it led to.
    #[serde(skip_serializing_if = "BTreeSet::is_empty")]
    actions: BTreeSet<u16>,
}

#[derive(Debug, Serialize)]
struct Episode {
    steps: usize,
    total: f64,
    terminated: bool,
    unstable: bool,
    poses: Poses,
    truth: Series,
    /// What the policy saw, where that was neither the truth nor blank.
    #[serde(skip_serializing_if = "Option::is_none")]
    seen: Option<Series>,
    /// A byte for each step, 1 where the policy saw nothing at all; as Base64.
    blank: String,
    action: Series,
    reward: Series,
    bids: Series,
    /// Which of `programs` acted in each step, once for each output where these have programs; two bytes each, as Base64.
    acted: String,
    /// How many of those there are in a step.
    actors: usize,
}

/// Poses of the moving solids: positions as shares of a box, then rotations.
#[derive(Debug, Serialize)]
struct Poses {
    frames: usize,
    positions: Series,
    /// Four numbers each, in 32767ths, two bytes each, as Base64.
    rotations: String,
}

impl Document {
    pub(super) fn new(
        facts: Facts,
        scene: &Scene,
        inputs: &[Channel],
        spec: &Spec,
        tape: &Tape,
    ) -> Self {
        let solids = scene.solids.len();
        let rest: Vec<Pose> = tape.episodes.first().map_or_else(Vec::new, |notes| {
            notes.poses.iter().take(solids).copied().collect()
        });
        let moves = |solid: &usize| {
            let mut poses = tape.episodes.iter().flat_map(|notes| {
                let poses = notes.poses.get(*solid..).unwrap_or_default();
                poses.iter().step_by(solids)
            });
            poses.any(|pose| *pose != rest[*solid])
        };
        let moving: Vec<usize> = (0..rest.len()).filter(moves).collect();
        let longest = tape.episodes.iter().map(|notes| notes.rewards.len()).max();
        let stride = (14 * moving.len() * longest.unwrap_or(0)).div_ceil(POSE_BYTES);
        let stride = stride.max(1);
        let (programs, bidders) = programs(tape, spec.actions);
        let number: BTreeMap<u16, u16> = (programs.iter().zip(0..))
            .map(|(program, number)| (program.id, number))
            .collect();
        let wide = wide(tape);
        let outputs = match spec.actions {
            ActionSpace::Discrete(_) => 1,
            ActionSpace::Continuous { len, .. } => len.into(),
        };
        let episode = |notes: &Notes| Episode {
            steps: notes.rewards.len(),
            total: notes.rewards.iter().sum(),
            terminated: notes.terminated,
            unstable: notes.unstable,
            poses: poses(notes, solids, &moving, stride),
            truth: Series::new(&wider(&notes.truth[..notes.seen.len()]), inputs.len()),
            seen: seen(notes, inputs.len()),
            blank: base64(&blank(notes, inputs.len())),
            action: Series::new(&wider(&notes.actions), outputs),
            reward: Series::new(&notes.rewards, 1),
            bids: Series::new(&bids(notes, &number, wide), programs.len()),
            acted: acted(notes, &number),
            actors: actors(notes),
        };
        Document {
            version: env!("CARGO_PKG_VERSION"),
            facts,
            solids: scene.solids.iter().map(DrawnSolid::new).collect(),
            meshes: meshes(scene),
            rest: rest.iter().map(seven).collect(),
            stride,
            inputs: inputs.iter().map(named).collect(),
            outputs: spec.outputs.iter().map(named).collect(),
            choices: match spec.actions {
                ActionSpace::Discrete(count) => Some(count),
                ActionSpace::Continuous { .. } => None,
            },
            episodes: tape.episodes.iter().map(episode).collect(),
            moving,
            programs,
            bidders,
            wide,
        }
    }
}

fn named(channel: &Channel) -> Named {
    Named {
        name: channel.name.clone(),
        unit: channel.unit.clone(),
    }
}

fn seven(pose: &Pose) -> [f32; 7] {
    let ([x, y, z], [w, i, j, k]) = (pose.position, pose.rotation);
    [x, y, z, w, i, j, k]
}

fn wider(values: &[f32]) -> Vec<f64> {
    values.iter().map(|value| f64::from(*value)).collect()
}

/// The programs to show, the most active first, and how many bid in all.
fn programs(tape: &Tape, actions: ActionSpace) -> (Vec<Program>, usize) {
    let mut found: BTreeMap<u16, (u64, u64, BTreeSet<u16>)> = BTreeMap::new();
    for decision in tape.episodes.iter().flat_map(|notes| &notes.decisions) {
        for (program, _) in &decision.bids {
            found.entry(*program).or_default().1 += 1;
        }
        for program in &decision.acted {
            let (acted, _, leads_to) = found.entry(*program).or_default();
            *acted += 1;
            // With values to set, the number that a program leads to says nothing.
            if let (ActionSpace::Discrete(_), Some(action)) = (actions, decision.action) {
                leads_to.insert(action);
            }
        }
    }
    let bidders = found.len();
    let mut programs: Vec<_> = found.into_iter().collect();
    programs.sort_by_key(|(id, (acted, bids, _))| (u64::MAX - acted, u64::MAX - bids, *id));
    programs.truncate(PROGRAMS);
    let program = |(id, (acted, _, actions))| Program { id, acted, actions };
    (programs.into_iter().map(program).collect(), bidders)
}

/// Whether bids differ by so much that only a scale of powers of ten shows them.
fn wide(tape: &Tape) -> bool {
    let decisions = tape.episodes.iter().flat_map(|notes| &notes.decisions);
    let bids = decisions.flat_map(|decision: &Decision| &decision.bids);
    let mut sizes: Vec<f64> = bids.map(|(_, bid)| f64::from(bid.abs())).collect();
    sizes.retain(|size| size.is_finite());
    sizes.sort_by(f64::total_cmp);
    match (sizes.get(sizes.len() / 2), sizes.last()) {
        (Some(middle), Some(greatest)) => *greatest > WIDE * middle.max(0.01),
        _ => false,
    }
}

/// Each step's bids of the programs that are shown; missing where a program did not bid.
fn bids(notes: &Notes, number: &BTreeMap<u16, u16>, wide: bool) -> Vec<f64> {
    let mut values = vec![f64::NAN; notes.decisions.len() * number.len()];
    let steps = values.chunks_exact_mut(number.len().max(1));
    for (step, decision) in steps.zip(&notes.decisions) {
        for (program, bid) in &decision.bids {
            if let Some(number) = number.get(program) {
                let bid = f64::from(*bid);
                step[usize::from(*number)] = if wide { bid.asinh() } else { bid };
            }
        }
    }
    values
}

fn actors(notes: &Notes) -> usize {
    let actors = notes.decisions.iter().map(|decision| decision.acted.len());
    actors.max().unwrap_or(0)
}

fn acted(notes: &Notes, number: &BTreeMap<u16, u16>) -> String {
    let mut bytes = Vec::new();
    for decision in &notes.decisions {
        for k in 0..actors(notes) {
            let program = decision.acted.get(k);
            let number = program.and_then(|program| number.get(program));
            bytes.extend(number.copied().unwrap_or(OTHER).to_le_bytes());
        }
    }
    base64(&bytes)
}

/// For each step 1 if the policy saw nothing, else 0.
fn blank(notes: &Notes, inputs: usize) -> Vec<u8> {
    let steps = notes.seen.chunks_exact(inputs.max(1));
    steps
        .map(|step| u8::from(step.iter().all(|value| value.is_nan())))
        .collect()
}

/// What was seen, if some of it was neither the truth nor blank.
fn seen(notes: &Notes, inputs: usize) -> Option<Series> {
    let steps = notes.seen.chunks_exact(inputs.max(1));
    let mut pairs = steps.zip(notes.truth.chunks_exact(inputs.max(1)));
    let disturbed = pairs.any(|(seen, truth)| {
        let same = seen
            .iter()
            .zip(truth)
            .all(|(a, b)| a.to_bits() == b.to_bits());
        !same && !seen.iter().all(|value| value.is_nan())
    });
    disturbed.then(|| Series::new(&wider(&notes.seen), inputs))
}

fn poses(notes: &Notes, solids: usize, moving: &[usize], stride: usize) -> Poses {
    let (mut positions, mut rotations) = (Vec::new(), Vec::new());
    let frames = notes.poses.chunks_exact(solids.max(1)).step_by(stride);
    for frame in frames.clone() {
        for solid in moving {
            let pose = frame[*solid];
            positions.extend(pose.position.map(f64::from));
            rotations.extend(pose.rotation.iter().flat_map(|part| unit(*part)));
        }
    }
    Poses {
        frames: frames.len(),
        positions: Series::new(&positions, 3),
        rotations: base64(&rotations),
    }
}
