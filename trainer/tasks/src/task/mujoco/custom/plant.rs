//! The task that a description makes.

use super::description::Description;
use super::drive::{Drive, drives};
use super::source::Source;
use super::terms::{Reward, Termination};
use crate::task::mujoco::sim::{Sim, UNSTABLE, compile};
use crate::task::spec::round;
use crate::task::{ActionSpace, Channel, Rng, Spec, Step, Task, Terms, UnknownTask};
use mujoco_rs::prelude::{MjModel, MjtJoint};
use sha2::{Digest as _, Sha256};
use std::path::{Path, PathBuf};
use std::{fs, sync::Arc};
use tpg_runtime::Action;

/// One element of the observation; without a clip in the file, `clip` is infinite.
#[derive(Debug)]
struct Input {
    source: Source,
    clip: f64,
}

/// A task that a file describes.
#[derive(Debug)]
struct Custom {
    spec: Spec,
    sim: Sim,
    /// Seconds of one control step.
    period: f64,
    inputs: Vec<Input>,
    drives: Vec<Drive>,
    rewards: Vec<Reward>,
    terminations: Vec<Termination>,
    /// Coordinates that the initial noise moves: all but those of orientations.
    noisy: Vec<usize>,
    position_noise: f64,
    velocity_noise: f64,
}

/// Makes the task that a TOML file describes; names of built-in tasks are taken.
pub(in crate::task) fn load(path: &Path, taken: &[&str]) -> Result<Box<dyn Task>, UnknownTask> {
    let bad = |path: &Path, why: String| UnknownTask::BadFile {
        path: path.to_owned(),
        why,
    };
    let (description, model_path) = read(path)?;
    if taken.contains(&description.name.as_str()) {
        let why = format!("name = {:?}: a built-in task has it", description.name);
        return Err(bad(path, why));
    }
    let model = compile(|| MjModel::from_xml(&model_path)).map_err(|why| bad(&model_path, why))?;
    let task = Custom::new(&description, model).map_err(|why| bad(path, why))?;
    Ok(Box::new(task))
}

/// Hash over the file that describes a task and its model's file, the same wherever they lie.
pub(in crate::task) fn digest(path: &Path) -> Result<String, UnknownTask> {
    let (_, model_path) = read(path)?;
    let mut hasher = Sha256::new();
    for file in [path, &model_path] {
        let bytes = fs::read(file).map_err(|error| unreadable(file, &error))?;
        hasher.update((bytes.len() as u64).to_le_bytes());
        hasher.update(bytes);
    }
    Ok(hasher
        .finalize()
        .iter()
        .map(|b| format!("{b:02x}"))
        .collect())
}

/// Reads a description; its model lies beside it.
fn read(path: &Path) -> Result<(Description, PathBuf), UnknownTask> {
    let text = fs::read_to_string(path).map_err(|error| unreadable(path, &error))?;
    let description = Description::read(&text).map_err(|why| UnknownTask::BadFile {
        path: path.to_owned(),
        why,
    })?;
    let model_path = path.with_file_name(&description.model);
    // MuJoCo reads the file itself, but says less when it cannot.
    fs::File::open(&model_path).map_err(|error| unreadable(&model_path, &error))?;
    Ok((description, model_path))
}

fn unreadable(path: &Path, error: &std::io::Error) -> UnknownTask {
    UnknownTask::BadFile {
        path: path.to_owned(),
        why: format!("cannot be read: {error}"),
    }
}

impl Custom {
    fn new(description: &Description, model: Arc<MjModel>) -> Result<Self, String> {
        let inputs = description.observation.iter().map(|o| {
            let source = Source::find(&o.source, &model)?;
            let clip = o.clip.unwrap_or(f64::INFINITY);
            Ok::<_, String>(Input { source, clip })
        });
        let inputs: Vec<Input> = inputs.collect::<Result<_, _>>()?;
        let (drives, outputs) = drives(&description.actuator, &model)?;
        let rewards = description.reward.iter().map(|r| Reward::new(r, &model));
        let terminations = description.termination.iter();
        let terminations = terminations.map(|t| Termination::new(t, &model));
        let channels = description.observation.iter().zip(&inputs);
        let channels = channels.map(|(o, input)| Channel {
            name: o.name.clone(),
            unit: o.unit.clone(),
            velocity: o
                .velocity
                .unwrap_or(matches!(input.source, Source::Velocity(_))),
        });
        let (rewards, terminations) = (
            rewards.collect::<Result<_, _>>()?,
            terminations.collect::<Result<_, _>>()?,
        );
        let noisy = noisy(&model);
        let mut sim = Sim::with_model(model, description.frame_skip)?;
        sim.reset(|_| {});
        let period = sim.period();
        Ok(Self {
            spec: Spec {
                name: description.name.clone(),
                inputs: channels.collect(),
                outputs,
                actions: ActionSpace::Continuous {
                    len: u16::try_from(drives.len()).map_err(|_| "too many actuators")?,
                    low: -1.0,
                    high: 1.0,
                },
                max_steps: description.max_steps,
                period_us: period_us(period, description.period_us)?,
            },
            sim,
            period,
            inputs,
            drives,
            rewards,
            terminations,
            noisy,
            position_noise: description.reset.position_noise,
            velocity_noise: description.reset.velocity_noise,
        })
    }
}

/// The control period in whole microseconds, which the file may state too.
fn period_us(period: f64, stated: Option<u32>) -> Result<u32, String> {
    /// Microseconds by which a product of decimal fractions may miss a whole number.
    const SLACK: f64 = 1e-3;
    let exact = period * 1e6;
    let whole = exact.round();
    if !((exact - whole).abs() <= SLACK && (1.0..=f64::from(u32::MAX)).contains(&whole)) {
        return Err(format!(
            "the control period, the model's timestep times frame-skip, is {period} s: it must be a whole number of \
             microseconds"
        ));
    }
    match stated {
        Some(stated) if f64::from(stated).to_bits() != whole.to_bits() => Err(format!(
            "period-us = {stated}: the model's timestep times frame-skip is {whole} microseconds"
        )),
        _ => Ok(whole as u32),
    }
}

/// The coordinates of hinges and slides, and the places of free bodies.
fn noisy(model: &MjModel) -> Vec<usize> {
    let joints = model.jnt_type().iter().zip(model.jnt_qposadr());
    let coordinates = joints.flat_map(|(kind, &start)| {
        let count = match kind {
            MjtJoint::mjJNT_FREE => 3,
            MjtJoint::mjJNT_BALL => 0,
            MjtJoint::mjJNT_SLIDE | MjtJoint::mjJNT_HINGE => 1,
        };
        start..start + count
    });
    coordinates
        .filter_map(|index| usize::try_from(index).ok())
        .collect()
}

impl Task for Custom {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn reset(&mut self, rng: &mut Rng) {
        let (position, velocity) = (self.position_noise, self.velocity_noise);
        let noisy = &self.noisy;
        self.sim.reset(|data| {
            for &index in noisy {
                if let Some(q) = data.qpos_mut().get_mut(index) {
                    *q += rng.uniform(-position, position);
                }
            }
            for v in data.qvel_mut() {
                *v += rng.uniform(-velocity, velocity);
            }
        });
    }

    fn observe(&self, observation: &mut [f32]) {
        for (out, input) in observation.iter_mut().zip(&self.inputs) {
            let value = input.source.read(&self.sim.data);
            *out = round(value.clamp(-input.clip, input.clip));
        }
    }

    fn step(&mut self, action: Action<'_>) -> Step {
        let values = match action {
            Action::Continuous(values) => values,
            Action::Discrete(_) => &[],
        };
        for reward in &mut self.rewards {
            reward.begin(&self.sim.data);
        }
        let controls = self.sim.data.ctrl_mut();
        let mut norm = 0.0;
        for (k, drive) in self.drives.iter().enumerate() {
            let value = values.get(k).copied().unwrap_or(0.0);
            norm += value * value;
            if let Some(control) = controls.get_mut(drive.control) {
                *control = drive.middle + drive.half * f64::from(value);
            }
        }
        if !self.sim.run() {
            return UNSTABLE;
        }
        let data = &self.sim.data;
        let (mut reward, mut terms) = (0.0, Terms::default());
        for term in &self.rewards {
            let value = term.value(data, self.period, norm);
            reward += value;
            term.attribute(value, &mut terms);
        }
        // An infinite reward would make every mean meaningless.
        if !reward.is_finite() {
            return UNSTABLE;
        }
        Step {
            reward,
            terms,
            terminated: self.terminations.iter().any(|t| t.reached(data)),
            unstable: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::description::{self, RewardKind};
    use super::*;

    /// A mass of 1 kg on a slide without gravity or friction.
    const MODEL: &str = r#"<mujoco>
        <option timestep="0.01" gravity="0 0 0" integrator="Euler"/>
        <worldbody>
            <body>
                <joint name="slide" type="slide" axis="1 0 0"/>
                <geom type="sphere" size="0.1" mass="1"/>
                <site name="mark" pos="0 0 0.5"/>
            </body>
        </worldbody>
        <actuator><motor name="push" joint="slide" ctrlrange="-2 6"/></actuator>
    </mujoco>"#;
    const TASK: &str = r#"
        name = "mass-v1"
        model = "mass.xml"
        frame-skip = 2
        max-steps = 10
        observation = [
            { source = "qpos:slide", name = "x", unit = "m" },
            { source = "qvel:slide", name = "v", unit = "m/s", clip = 0.01 },
            { source = "cos:slide", name = "cosine", unit = "1" },
            { source = "site:mark.z", name = "height", unit = "m" },
        ]
        actuator = [{ name = "push" }]
        reward = [
            { kind = "constant", weight = 3.0 },
            { kind = "linear", weight = 10.0, source = "qpos:slide", target = 1.0 },
            { kind = "square", weight = 100.0, source = "qpos:slide", target = -1.0 },
            { kind = "velocity", weight = 1000.0, source = "qpos:slide" },
            { kind = "control-cost", weight = 0.5 },
        ]
        termination = [{ source = "qpos:slide", above = 0.0015 }]
        reset = { position-noise = 0.001, velocity-noise = 0.002 }
    "#;

    fn task() -> Custom {
        let model = compile(|| MjModel::from_xml_string(MODEL)).unwrap();
        Custom::new(&Description::read(TASK).unwrap(), model).unwrap()
    }

    #[test]
    fn the_description_gives_the_specification() {
        let task = task();
        let spec = task.spec();
        assert_eq!((spec.period_us, spec.max_steps), (20_000, 10));
        let velocities: Vec<bool> = spec.inputs.iter().map(|c| c.velocity).collect();
        assert_eq!(velocities, [false, true, false, false]);
        assert_eq!(spec.outputs[0].unit, "-2..6");
    }

    /// The middle of the range is 2 N, half of it 4 N: an output of 0.5 is 4 N, so 4 m/s². Semi-implicit Euler then gives
    /// velocities of 0.04 and 0.08 m/s, positions of 0.0004 and 0.0012 m.
    #[test]
    fn a_step_gives_the_numbers_of_paper_and_pencil() {
        let mut task = task();
        let step = task.step(Action::Continuous(&[0.5]));
        let mut observation = [9.0; 4];
        task.observe(&mut observation);
        let expected = [0.0012, 0.01, 1.0, 0.5];
        for (found, expected) in observation.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-6, "{observation:?}");
        }
        let x = 0.0012;
        let reward =
            3.0 + 10.0 * (x - 1.0) + 100.0 * (x + 1.0) * (x + 1.0) + 1000.0 * x / 0.02 - 0.5 * 0.25;
        assert!((step.reward - reward).abs() < 1e-9, "{step:?}, {reward}");
        assert!(!step.terminated);
        assert!(task.step(Action::Continuous(&[0.5])).terminated);
    }

    #[test]
    fn a_reused_task_and_a_fresh_one_give_the_same_bits() {
        let run = |task: &mut Custom| {
            task.reset(&mut Rng::new(3));
            let reward = task.step(Action::Continuous(&[-0.3])).reward;
            (reward.to_bits(), task.sim.data.qpos()[0].to_bits())
        };
        let mut used = task();
        let first = run(&mut used);
        used.reset(&mut Rng::new(4));
        used.step(Action::Continuous(&[1.0]));
        assert_eq!((run(&mut used), run(&mut task())), (first, first));
    }

    #[test]
    fn initial_states_are_within_the_noise() {
        let (mut task, mut rng) = (task(), Rng::new(5));
        for _ in 0..100 {
            task.reset(&mut rng);
            let data = &task.sim.data;
            assert!(data.qpos()[0].abs() <= 0.001 && data.qvel()[0].abs() <= 0.002);
        }
    }

    #[test]
    fn an_action_of_the_wrong_kind_is_the_middle() {
        let (mut a, mut b) = (task(), task());
        assert_eq!(
            a.step(Action::Discrete(1)),
            b.step(Action::Continuous(&[0.0]))
        );
    }

    #[test]
    fn a_lost_state_and_an_infinite_reward_fail_the_episode() {
        let mut task = task();
        task.sim.data.qvel_mut()[0] = 1e12;
        assert_eq!(task.step(Action::Continuous(&[0.0])), UNSTABLE);
        task.reset(&mut Rng::new(1));
        task.rewards.push(
            Reward::new(
                &description::Reward {
                    kind: RewardKind::Linear,
                    weight: f64::MAX,
                    source: Some("qpos:slide".into()),
                    target: Some(f64::MAX),
                },
                task.sim.data.model(),
            )
            .unwrap(),
        );
        assert_eq!(task.step(Action::Continuous(&[0.0])), UNSTABLE);
    }
}
