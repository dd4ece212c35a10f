//! The robots that the program brings along: Gymnasium's, each a description beside its model.

use super::description::Description;
use super::plant::Robot;

/// Texts by the name of their file.
type Texts = &'static [(&'static str, &'static str)];

/// Includes files of one folder under their names.
macro_rules! texts {
    ($folder:expr, $($name:literal),+ $(,)?) => {
        &[$(($name, include_str!(concat!($folder, "/", $name)))),+]
    };
}

const DESCRIPTIONS: Texts = texts!(
    "../robots",
    "ant-v4.toml",
    "ant-v5.toml",
    "half-cheetah-skip1-v1.toml",
    "half-cheetah-v4.toml",
    "half-cheetah-v5.toml",
    "hopper-skip1-free-v1.toml",
    "hopper-skip1-v1.toml",
    "hopper-v4.toml",
    "hopper-v5.toml",
    "humanoid-standup-v4.toml",
    "humanoid-standup-v5.toml",
    "humanoid-v4.toml",
    "humanoid-v5.toml",
    "inverted-double-pendulum-skip1-v1.toml",
    "inverted-double-pendulum-v4.toml",
    "inverted-double-pendulum-v5.toml",
    "inverted-pendulum-v4.toml",
    "inverted-pendulum-v5.toml",
    "pusher-v5.toml",
    "reacher-v4.toml",
    "reacher-v5.toml",
    "swimmer-v4.toml",
    "swimmer-v5.toml",
    "walker2d-v4.toml",
    "walker2d-v5.toml",
);

const MODELS: Texts = texts!(
    env!("TPG_MODELS_DIR"),
    "ant.xml",
    "half_cheetah.xml",
    "hopper.xml",
    "humanoid.xml",
    "humanoidstandup.xml",
    "inverted_double_pendulum.xml",
    "inverted_pendulum.xml",
    "pusher_v5.xml",
    "reacher.xml",
    "swimmer.xml",
    "walker2d.xml",
    "walker2d_v5.xml",
);

fn text(texts: Texts, name: &str) -> Result<&'static str, String> {
    let found = texts.iter().find(|(known, _)| *known == name);
    found
        .map(|(_, text)| *text)
        .ok_or_else(|| format!("the program brings no file {name:?} along"))
}

/// The description of a robot of this full name, such as `hopper-v4`, and the text of its model.
fn parts(name: &str) -> Result<(Description, &'static str), String> {
    let load = |name: &str| text(DESCRIPTIONS, name).map(str::to_owned);
    let description = Description::read(&load(&format!("{name}.toml"))?, &load)?;
    let model = text(MODELS, &description.model)?;
    Ok((description, model))
}

impl Robot {
    /// Makes a robot that the program brings along, by its full name, such as `hopper-v4`.
    ///
    /// # Panics
    /// Where the program brings none of this name along, or MuJoCo refuses Gymnasium's model, which the build has
    /// checked against its hash.
    #[must_use]
    pub fn builtin(name: &str) -> Self {
        parts(name)
            .and_then(|(description, model)| Self::with_text(&description, model))
            .unwrap_or_else(|why| panic!("{name}: {why}"))
    }
}

#[cfg(test)]
mod tests {
    use super::super::description::Part;
    use super::*;
    use crate::task::mujoco::sim::compile;
    use crate::task::{ActionSpace, Rng, Task as _};
    use mujoco_rs::prelude::{MjData, MjModel};
    use std::sync::Arc;
    use tpg_runtime::Action;

    /// Everything that the tasks read, as bits.
    fn bits(data: &MjData<Arc<MjModel>>) -> Vec<u64> {
        let parts = [
            data.qpos(),
            data.qvel(),
            data.qacc(),
            data.qacc_warmstart(),
            data.qfrc_constraint(),
            data.site_xpos().as_flattened(),
            data.cfrc_ext().as_flattened(),
        ];
        parts.concat().iter().map(|x| x.to_bits()).collect()
    }

    /// Two robots, one whose model computes everything, take the same steps, restarts included.
    #[test]
    fn what_is_left_out_changes_no_bit() {
        const STEPS: u32 = 3_000;
        const EPISODE: u32 = 400;
        let mut seen = std::collections::BTreeSet::new();
        for (file, _) in DESCRIPTIONS {
            let name = file.trim_end_matches(".toml");
            let (description, text) = parts(name).unwrap();
            if !seen.insert(format!("{}{:?}", description.model, description.leave_out)) {
                continue;
            }
            let complete = compile(|| MjModel::from_xml_string(text)).unwrap();
            assert_eq!(complete.opt().disableflags, 0, "{name} as it is described");
            let lean = Robot::builtin(name).model();
            assert_eq!(
                lean.opt().disableflags != 0,
                !description.leave_out.is_empty()
            );
            let mut robots = [MjData::new(complete), MjData::new(lean)];
            let mut rng = Rng::new(3);
            let mut touched = 0;
            for step in 0..STEPS {
                if step % EPISODE == 0 {
                    let speed = rng.uniform(-3.0, 3.0);
                    for data in &mut robots {
                        data.reset();
                        data.qvel_mut().fill(speed);
                        data.forward();
                    }
                }
                let control = rng.uniform(-1.0, 1.0);
                let [a, b] = robots.each_mut().map(|data| {
                    for (k, out) in data.ctrl_mut().iter_mut().enumerate() {
                        *out = if k % 2 == 0 { control } else { -control };
                    }
                    data.step();
                    bits(data)
                });
                assert_eq!(a, b, "{name} at step {step}");
                touched += robots[0].ncon();
            }
            if description.leave_out.contains(&Part::Contacts) {
                assert_eq!(touched, 0, "{name} touches, so contacts cannot be left out");
            }
        }
    }

    #[test]
    fn a_lost_state_fails_the_episode_until_the_next_reset() {
        for (file, _) in DESCRIPTIONS {
            let name = file.trim_end_matches(".toml");
            let mut task = Robot::builtin(name);
            let ActionSpace::Continuous { len, .. } = task.spec().actions else {
                panic!("{name} has continuous actions");
            };
            let action = vec![0.5; usize::from(len)];
            task.set_state(&[], &[1e12; 3]);
            let step = task.step(Action::Continuous(&action));
            assert!(step.unstable && step.terminated, "{name}: {step:?}");
            assert!(task.instability().unwrap().ends_with("step 1"), "{name}");
            assert!(task.step(Action::Continuous(&action)).unstable, "{name}");
            let next = |task: &mut Robot| {
                task.reset(&mut Rng::new(1));
                task.step(Action::Continuous(&action)).reward.to_bits()
            };
            assert_eq!(next(&mut task), next(&mut Robot::builtin(name)), "{name}");
        }
        assert!(!std::path::Path::new("MUJOCO_LOG.TXT").exists());
    }

    fn step(
        name: &str,
        positions: &[f64],
        velocities: &[f64],
        action: &[f32],
    ) -> crate::task::Step {
        let mut task = Robot::builtin(name);
        task.set_state(positions, velocities);
        task.step(Action::Continuous(action))
    }

    #[test]
    fn upright_and_at_rest_the_pendulums_reward_is_nearly_ten() {
        let step = step("inverted-double-pendulum-v4", &[0.0; 3], &[0.0; 3], &[0.0]);
        // The tip stands at 1.2 m, 0.8 below the 2 m of the formula.
        assert!((step.reward - (10.0 - 0.64)).abs() < 1e-3, "{step:?}");
        assert!(!step.terminated);
    }

    #[test]
    fn version_5_withholds_what_is_paid_for_not_failing() {
        let pendulum = |version: &str| {
            let name = format!("inverted-double-pendulum-{version}");
            step(&name, &[0.0, 1.0, 1.0], &[0.0; 3], &[0.0])
        };
        let (v4, v5) = (pendulum("v4"), pendulum("v5"));
        assert!(v4.terminated && v5.terminated);
        assert!((v4.reward - v5.reward - 10.0).abs() < 1e-9);
        let hopper = |version: &str, height, angle| {
            let positions = [0.0, height, angle, 0.0, 0.0, 0.0];
            step(
                &format!("hopper-{version}"),
                &positions,
                &[0.0; 6],
                &[0.0; 3],
            )
        };
        assert!(!hopper("v4", 1.25, 0.15).terminated);
        assert!(hopper("v4", 1.25, -0.25).terminated);
        assert!(hopper("v4", 0.6, 0.0).terminated);
        let difference = hopper("v4", 1.25, 0.25).reward - hopper("v5", 1.25, 0.25).reward;
        assert!((difference - 1.0).abs() < 1e-9);
    }

    #[test]
    fn the_runners_reward_is_the_velocity_less_the_cost_of_control() {
        let mut task = Robot::builtin("half-cheetah-v4");
        let before = task.positions()[0];
        let step = task.step(Action::Continuous(&[1.0, -1.0, 1.0, -1.0, 1.0, -1.0]));
        let forward = (task.positions()[0] - before) / 0.05;
        assert!((step.reward - (forward - 0.6)).abs() < 1e-7, "{step:?}");
        assert!((step.terms.control - 0.6).abs() < 1e-7);
        assert!(!step.terminated);
    }
}
