//! The steps of a run, taken again: by MuJoCo alone, and by the task without a policy.

use std::convert::Infallible;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use cpu_time::ThreadTime;
use mujoco_rs::prelude::{MjData, MjModel, MjtDisableBit};
use tpg_runtime::{Action, Reset};
use tpg_tasks::eval::{Arena, Controller, EpisodeSeeds, Reply};
use tpg_tasks::task::mujoco::MODELS_DIR;
use tpg_tasks::task::{Rng, Spec, Step, Task};

/// A robot as MuJoCo sees it.
pub struct Robot {
    /// File of its model.
    file: &'static str,
    frame_skip: u32,
    /// What MuJoCo is spared beside islands and sensors, as in the task.
    spared: i32,
    reset: fn(&mut MjData<Arc<MjModel>>, &mut Rng),
    /// The position that is observed first.
    first: usize,
}

pub const HOPPER: Robot = Robot {
    file: "hopper.xml",
    frame_skip: 4,
    spared: 0,
    first: 1,
    reset: |data, rng| {
        for x in data.qpos_mut() {
            *x += rng.uniform(-5e-3, 5e-3);
        }
        for x in data.qvel_mut() {
            *x += rng.uniform(-5e-3, 5e-3);
        }
    },
};

pub const HALF_CHEETAH: Robot = Robot {
    file: "half_cheetah.xml",
    frame_skip: 5,
    spared: 0,
    first: 1,
    reset: |data, rng| {
        for x in data.qpos_mut() {
            *x += rng.uniform(-0.1, 0.1);
        }
        for x in data.qvel_mut() {
            *x += rng.normal() * 0.1;
        }
    },
};

pub const DOUBLE_PENDULUM: Robot = Robot {
    file: "inverted_double_pendulum.xml",
    spared: MjtDisableBit::mjDSBL_CONTACT as i32,
    first: 0,
    ..HALF_CHEETAH
};

/// One episode of a run.
#[derive(Clone)]
pub struct Recorded {
    /// The stream of its initial state, before it was used.
    start: Rng,
    /// All actions, one after another.
    actions: Vec<f32>,
    /// What was observed before the last action.
    last: Vec<f32>,
}

/// Episodes in the order in which they were run.
pub type Tape = Arc<Mutex<Vec<Recorded>>>;

/// A task whose episodes go onto a tape.
pub struct Recording {
    task: Box<dyn Task>,
    tape: Tape,
}

impl Recording {
    pub fn new(task: Box<dyn Task>, tape: &Tape) -> Self {
        Recording {
            task,
            tape: tape.clone(),
        }
    }
}

impl Task for Recording {
    fn spec(&self) -> &Spec {
        self.task.spec()
    }

    fn reset(&mut self, rng: &mut Rng) {
        self.tape.lock().expect("no panic").push(Recorded {
            start: rng.clone(),
            actions: Vec::new(),
            last: vec![0.0; self.task.spec().inputs.len()],
        });
        self.task.reset(rng);
    }

    fn observe(&self, observation: &mut [f32]) {
        self.task.observe(observation);
    }

    fn step(&mut self, action: Action<'_>) -> Step {
        let mut tape = self.tape.lock().expect("no panic");
        if let (Some(episode), Action::Continuous(values)) = (tape.last_mut(), action) {
            episode.actions.extend(values);
            self.task.observe(&mut episode.last);
        }
        self.task.step(action)
    }
}

/// CPU time of `mj_step` over all episodes, resets apart; the states are those of the run.
pub fn bare(robot: &Robot, tape: &[Recorded]) -> Duration {
    let mut model =
        MjModel::from_xml(Path::new(MODELS_DIR).join(robot.file)).expect("Gymnasium's model");
    // The options of the tasks.
    model.opt_mut().disableflags |=
        robot.spared | MjtDisableBit::mjDSBL_ISLAND as i32 | MjtDisableBit::mjDSBL_SENSOR as i32;
    let mut data = MjData::new(Arc::new(model));
    let mut spent = Duration::ZERO;
    for episode in tape {
        data.reset();
        (robot.reset)(&mut data, &mut episode.start.clone());
        data.forward();
        let actions = episode.actions.chunks_exact(data.ctrl().len());
        let steps = actions.len();
        let started = ThreadTime::now();
        for (k, action) in actions.enumerate() {
            if k + 1 == steps {
                let (q, seen) = (data.qpos()[robot.first] as f32, episode.last[0]);
                assert_eq!(q.to_bits(), seen.to_bits(), "not the states of the run");
            }
            for (out, x) in data.ctrl_mut().iter_mut().zip(action) {
                *out = f64::from(*x);
            }
            for _ in 0..robot.frame_skip {
                data.step();
            }
        }
        spent += started.elapsed();
    }
    spent
}

/// CPU time of a task over all episodes, resets and observations included.
pub fn task(task: &mut dyn Task, tape: &[Recorded]) -> Duration {
    let outputs = task.spec().outputs.len();
    let mut observation = vec![0.0; task.spec().inputs.len()];
    let started = ThreadTime::now();
    for episode in tape {
        task.reset(&mut episode.start.clone());
        task.observe(&mut observation);
        for action in episode.actions.chunks_exact(outputs) {
            task.step(Action::Continuous(action));
            task.observe(&mut observation);
        }
    }
    started.elapsed()
}

/// Answers with recorded actions.
struct Player<'a> {
    actions: &'a [f32],
    outputs: usize,
}

impl Controller for Player<'_> {
    type Error = Infallible;

    fn reset(&mut self, _: Reset, _: u64) -> Result<(), Infallible> {
        Ok(())
    }

    fn decide(&mut self, _: &[f32]) -> Result<Reply<'_>, Infallible> {
        let (action, rest) = self.actions.split_at(self.outputs);
        self.actions = rest;
        Ok(Reply {
            action: Action::Continuous(action),
            instructions: 0,
        })
    }
}

/// CPU time of the task behind its wrappers over all episodes, resets and all, without a policy.
pub fn environment(arena: &mut Arena, tape: &[Recorded], seeds: &[u64]) -> Duration {
    let outputs = arena.task().spec().outputs.len();
    let starts: Vec<Rng> = seeds
        .iter()
        .map(|seed| EpisodeSeeds::new(*seed).initial_state)
        .collect();
    let started = ThreadTime::now();
    for episode in tape {
        let seed = starts.iter().position(|start| *start == episode.start);
        let mut player = Player {
            actions: &episode.actions,
            outputs,
        };
        let seed = seeds[seed.expect("a seed of the run")];
        let Ok(_) = arena.episode(&mut player, Reset::Agent, seed);
        assert!(player.actions.is_empty(), "not the episode of the run");
    }
    started.elapsed()
}
