//! The task that a description makes.

use super::description::{Description, Part};
use super::drive::Drives;
use super::input::{Input, NOTHING, inputs};
use super::measure::{Effort, Measure, Now};
use super::randomize::Randomize;
use super::source::Moment;
use super::start::Start;
use super::terms::{Reward, Scope, Termination};
use crate::task::mujoco::scene;
use crate::task::mujoco::sim::{Sim, UNSTABLE};
use crate::task::{Pose, Rng, Scene, Spec, Step, Task, Terms};
use mujoco_rs::prelude::MjModel;
use std::sync::Arc;
use tpg_runtime::Action;

/// A robot that a file describes.
#[derive(Debug)]
pub struct Robot {
    spec: Spec,
    sim: Sim,
    /// Seconds of one control step.
    period: f64,
    /// Control steps for each decision.
    repeat: u32,
    inputs: Vec<Input>,
    drives: Drives,
    rewards: Vec<Reward>,
    terminations: Vec<Termination>,
    start: Start,
    randomize: Option<Randomize>,
    goals: Vec<f64>,
    /// Whether anything reads the contact forces, which MuJoCo computes only when it is asked to.
    contact_forces: bool,
}

impl Robot {
    pub(super) fn new(
        description: &Description,
        model: Arc<MjModel>,
        name: &str,
    ) -> Result<Self, String> {
        let goals: Vec<String> = description.goal.iter().map(|g| g.name.clone()).collect();
        let scope = Scope {
            model: &model,
            goals: &goals,
        };
        let (inputs, channels) = inputs(description, scope)?;
        let period = model.opt().timestep * f64::from(description.frame_skip);
        let (drives, outputs, actions) = Drives::new(description, &model, period)?;
        let rewards = description.reward.iter().map(|r| Reward::new(r, scope));
        let rewards: Vec<Reward> = rewards.collect::<Result<_, _>>()?;
        let terminations = description.termination.iter();
        let terminations = terminations.map(|t| Termination::new(t, scope));
        let terminations: Vec<Termination> = terminations.collect::<Result<_, _>>()?;
        let start = Start::new(description, scope)?;
        let reads = |test: &dyn Fn(&Measure) -> bool| {
            inputs.iter().any(|input| input.any(test))
                || rewards.iter().any(|reward| reward.any(test))
                || terminations.iter().any(|end| end.any(test))
        };
        let contact_forces = reads(&Measure::is_contact_force);
        if description.leave_out.contains(&Part::Sensors) && reads(&Measure::is_sensor) {
            return Err("leave-out names the sensors, but the file reads one".into());
        }
        let randomize = Randomize::new(description.randomize, &model)?;
        // What is to be changed cannot be shared.
        let own = match randomize {
            Some(_) => Arc::new((*model).clone()),
            None => Arc::clone(&model),
        };
        let mut robot = Self {
            spec: Spec {
                name: description.name.clone(),
                inputs: channels,
                outputs,
                actions,
                max_steps: description.max_steps,
                period_us: period_us(period, description)?,
            },
            sim: Sim::with_model(own, name, description.frame_skip),
            period,
            repeat: description.action_repeat,
            inputs,
            drives,
            rewards,
            terminations,
            start,
            randomize,
            goals: vec![0.0; goals.len()],
            contact_forces,
        };
        if !(robot.start).reset(&mut robot.sim, &mut robot.goals, &mut Rng::new(0)) {
            return Err(
                "reset.redraw-until holds in none of 1000 draws: widen the ranges or the condition"
                    .into(),
            );
        }
        robot.sim.reset(|_| {});
        Ok(robot)
    }

    /// Starts an episode from these positions and velocities, in the order of the model's `qpos` and `qvel`.
    ///
    /// Of slices that are too short or too long only the common part is set. Goals stay as they are.
    pub fn set_state(&mut self, positions: &[f64], velocities: &[f64]) {
        self.sim.reset(|data| {
            let set = |slots: &mut [f64], values: &[f64]| {
                for (slot, value) in slots.iter_mut().zip(values) {
                    *slot = *value;
                }
            };
            set(data.qpos_mut(), positions);
            set(data.qvel_mut(), velocities);
        });
    }

    /// The compiled model.
    #[cfg(test)]
    pub(super) fn model(&self) -> Arc<MjModel> {
        self.sim.data.model_clone()
    }

    /// The positions now, in the order of the model.
    #[cfg(test)]
    pub(super) fn positions(&self) -> &[f64] {
        self.sim.data.qpos()
    }

    /// What is measured between two steps.
    fn now(&self) -> Now<'_> {
        Now {
            period: self.period,
            ..Now::at(Moment {
                data: &self.sim.data,
                goals: &self.goals,
            })
        }
    }

    /// One control step.
    fn advance(&mut self, action: Action<'_>) -> Step {
        let Self {
            sim,
            goals,
            period,
            rewards,
            terminations,
            drives,
            ..
        } = self;
        let moment = Moment {
            data: &sim.data,
            goals,
        };
        let before = Now::at(moment);
        for reward in rewards.iter_mut() {
            reward.begin(before);
        }
        for termination in terminations.iter_mut() {
            termination.begin(before);
        }
        let effort: Effort = drives.set(action, sim.data.ctrl_mut());
        if !sim.run() {
            return UNSTABLE;
        }
        if self.contact_forces {
            sim.data.rne_post_constraint();
        }
        let moment = Moment {
            data: &sim.data,
            goals,
        };
        let mut now = Now {
            moment,
            effort,
            period: *period,
            alive: true,
        };
        let terminated = terminations.iter().any(|end| end.reached(now));
        now.alive = !terminated;
        let (mut reward, mut terms) = (NOTHING, Terms::default());
        for term in rewards.iter() {
            let value = term.value(now);
            reward += value;
            term.attribute(value, &mut terms);
        }
        // An infinite reward would make every mean meaningless.
        if !reward.is_finite() {
            sim.fail_reward();
            return UNSTABLE;
        }
        Step {
            reward,
            terms,
            terminated,
            unstable: false,
        }
    }
}

/// The time between two decisions in whole microseconds, which the file may state too.
fn period_us(period: f64, description: &Description) -> Result<u32, String> {
    /// Microseconds by which a product of decimal fractions may miss a whole number.
    const SLACK: f64 = 1e-3;
    let repeat = description.action_repeat;
    let exact = period * f64::from(repeat) * 1e6;
    let whole = exact.round();
    let product = if repeat == 1 {
        "the model's timestep times frame-skip"
    } else {
        "the model's timestep times frame-skip times action-repeat"
    };
    if !((exact - whole).abs() <= SLACK && (1.0..=f64::from(u32::MAX)).contains(&whole)) {
        return Err(format!(
            "the control period, {product}, is {exact} microseconds: it must be a whole number of them"
        ));
    }
    match description.period_us {
        Some(stated) if f64::from(stated).to_bits() != whole.to_bits() => Err(format!(
            "period-us = {stated}: {product} is {whole} microseconds"
        )),
        _ => Ok(whole as u32),
    }
}

impl Task for Robot {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn reset(&mut self, rng: &mut Rng) {
        if let Some(randomize) = &mut self.randomize {
            randomize.draw(&mut self.sim, rng);
        }
        // A stream of its own, so that offsets change no initial state.
        let mut own = Rng::new(!rng.clone().word());
        for input in &mut self.inputs {
            input.draw(&mut own);
        }
        self.start.reset(&mut self.sim, &mut self.goals, rng);
    }

    fn observe(&self, observation: &mut [f32]) {
        let now = self.now();
        for (out, input) in observation.iter_mut().zip(&self.inputs) {
            *out = input.read(now);
        }
    }

    fn step(&mut self, action: Action<'_>) -> Step {
        let mut step = self.advance(action);
        for _ in 1..self.repeat {
            if step.terminated {
                break;
            }
            let next = self.advance(action);
            if next.unstable {
                return next;
            }
            step.reward += next.reward;
            step.terms.alive += next.terms.alive;
            step.terms.control += next.terms.control;
            step.terminated = next.terminated;
        }
        step
    }

    fn instability(&self) -> Option<String> {
        self.sim.instability()
    }

    #[cfg(feature = "render")]
    fn simulation(&self) -> Option<&crate::task::Simulation> {
        Some(&self.sim.data)
    }

    fn scene(&self) -> Scene {
        scene::scene(self.sim.data.model())
    }

    fn poses(&self, poses: &mut Vec<Pose>) {
        scene::poses(&self.sim.data, poses);
    }
}

#[cfg(test)]
mod tests {
    use super::super::description::{self, RewardKind};
    use super::*;
    use crate::task::mujoco::sim::compile;

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

    fn no_file(name: &str) -> Result<String, String> {
        Err(format!("no {name}"))
    }

    fn task() -> Robot {
        let model = compile(|| MjModel::from_xml_string(MODEL)).unwrap();
        Robot::new(
            &Description::read(TASK, &no_file).unwrap(),
            model,
            "mass.xml",
        )
        .unwrap()
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
        let run = |task: &mut Robot| {
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
        assert_eq!(
            task.instability().as_deref(),
            Some("BADQVEL at DOF 0 (joint \"slide\"), step 1")
        );
        task.reset(&mut Rng::new(1));
        assert_eq!(task.instability(), None);
        task.rewards.push(
            Reward::new(
                &description::Reward {
                    kind: Some(RewardKind::Linear),
                    expression: None,
                    weight: Some(f64::MAX),
                    source: Some("qpos:slide".into()),
                    target: Some(f64::MAX),
                    precision: description::Precision::F64,
                    counts_as: None,
                },
                Scope {
                    model: task.sim.data.model(),
                    goals: &[],
                },
            )
            .unwrap(),
        );
        assert_eq!(task.step(Action::Continuous(&[0.0])), UNSTABLE);
        assert_eq!(
            task.instability().as_deref(),
            Some("the reward is not finite, step 1")
        );
    }
}
