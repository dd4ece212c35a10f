//! What a description can say, on small models.

use super::description::Description;
use super::plant::Robot;
use crate::task::mujoco::sim::compile;
use crate::task::{ActionSpace, Rng, Task as _};
use mujoco_rs::prelude::MjModel;
use tpg_runtime::Action;

/// A floating body with a leg; neither the geoms nor one of the actuators and joints have names. No gravity.
const BODY: &str = r#"<mujoco>
    <compiler angle="radian"/>
    <option timestep="0.01" gravity="0 0 0"/>
    <worldbody>
        <body name="base" pos="0 0 1">
            <freejoint name="root"/>
            <geom type="box" size=".1 .1 .05" mass="1"/>
            <site name="imu.main"/>
            <body name="leg">
                <joint name="hip" type="hinge" axis="0 1 0" range="-1 1"/>
                <geom type="capsule" fromto="0 0 0 0 0 -.2" size=".02" mass=".2"/>
                <body pos="0 0 -.2">
                    <joint type="slide" axis="0 0 1"/>
                    <geom size=".02" mass=".1"/>
                </body>
            </body>
        </body>
    </worldbody>
    <actuator>
        <motor joint="hip" ctrlrange="-1 1"/>
        <motor name="piston" joint="hip" ctrlrange="-2 2"/>
    </actuator>
    <sensor>
        <gyro name="gyro" site="imu.main"/>
        <accelerometer name="a[0]" site="imu.main"/>
    </sensor>
    <keyframe><key name="stand" qpos="0 0 .5 1 0 0 0 .8 0"/></keyframe>
</mujoco>"#;

const REST: &str = "name = \"t-v1\"\nmodel = \"m.xml\"\nframe-skip = 2\nmax-steps = 9\n";
const SEEN: &str = "observation = [{ source = \"qpos:hip\", name = \"hip\", unit = \"rad\" }]\n";
const MOVED: &str = "actuator = [{ actuator = \"#0\", name = \"torque\" }]\n";
const PAID: &str = "reward = [{ kind = \"constant\", weight = 1.0 }]\n";

fn robot(text: &str) -> Result<Robot, String> {
    let load = |name: &str| match name {
        "base.toml" => Ok(format!("{REST}{SEEN}{MOVED}{PAID}")),
        _ => Err(format!("no {name}")),
    };
    let model = compile(|| MjModel::from_xml_string(BODY))?;
    Robot::new(&Description::read(text, &load)?, model, "m.xml")
}

/// The names of the inputs of a task with these observations, and which of them are velocities.
fn inputs(observations: &str) -> Result<(Vec<String>, Vec<bool>), String> {
    let task = robot(&format!(
        "{REST}observation = [{observations}]\n{MOVED}{PAID}"
    ))?;
    let inputs = task.spec().inputs.iter();
    Ok(inputs.map(|c| (c.name.clone(), c.velocity)).unzip())
}

fn observed(task: &Robot) -> Vec<f32> {
    let mut seen = vec![0.0; task.spec().inputs.len()];
    task.observe(&mut seen);
    seen
}

#[test]
fn what_has_no_name_has_a_number() {
    let with = |actuator: &str| {
        robot(&format!(
            "{REST}{SEEN}actuator = [{{ actuator = \"{actuator}\", name = \"torque\" }}]\n{PAID}"
        ))
    };
    for actuator in ["#0", "#1", "piston"] {
        with(actuator).unwrap();
    }
    let message = with("torque").unwrap_err();
    assert!(message.contains("#0 (joint:hip), piston"), "{message}");
    let message = with("joint:hip").unwrap_err();
    assert!(message.contains("several actuators"), "{message}");
    let message = with("joint:#2").unwrap_err();
    assert!(
        message.contains("no actuator acts on the joint #2"),
        "{message}"
    );
    assert!(inputs(r##"{ source = "qpos:#2", name = "x", unit = "m" }"##).is_ok());
    let message = inputs(r#"{ source = "qpos:knee", name = "x", unit = "m" }"#).unwrap_err();
    assert!(message.contains("root, hip, #2"), "{message}");
}

#[test]
fn joints_with_several_coordinates_are_seen_by_index_or_block() {
    let (names, velocities) = inputs(
        r#"{ source = "qpos:root[2]", name = "height", unit = "m" },
           { source = "qpos:root[3..]", name = "turn", unit = "1" },
           { source = "qvel:*[6..]", name = "speed", unit = "1/s" },
           { source = "xpos:leg.z", name = "leg", unit = "m" },
           { source = "cfrc_ext:*[1..2]", name = "force", unit = "N" },
           { source = "xvel:base[..3]", name = "spin", unit = "rad/s" }"#,
    )
    .unwrap();
    assert_eq!(
        names[..5],
        ["height", "turn_0", "turn_1", "turn_2", "turn_3"]
    );
    assert_eq!(names[5..8], ["speed_0", "speed_1", "leg"]);
    assert_eq!(names.len(), 8 + 6 + 3);
    assert_eq!(velocities[4..9], [false, true, true, false, false]);
    for (source, words) in [
        ("qpos:root", "has 7 values"),
        ("qpos:root[7]", "has 7 values"),
        ("qvel:root[2..8]", "has 6 values"),
        ("qpos:*[9..]", "no part"),
        ("sin:root", "no hinge"),
        ("site:imu.main", "has 3 values"),
    ] {
        let text = format!("{{ source = \"{source}\", name = \"x\", unit = \"1\" }}");
        let message = inputs(&text).unwrap_err();
        assert!(message.contains(words), "{source}: {message}");
    }
}

#[test]
fn velocity_sensors_are_velocities() {
    let (_, velocities) = inputs(
        r#"{ source = "sensor:gyro[0]", name = "gyro", unit = "rad/s" },
           { source = "sensor:a[0][2]", name = "acceleration", unit = "m/s2" },
           { source = "sensor:gyro[1]", name = "shown", unit = "rad/s", velocity = false },
           { source = "site:imu.main.x", name = "x", unit = "m" }"#,
    )
    .unwrap();
    assert_eq!(velocities, [true, false, false, false]);
}

#[test]
fn the_alive_reward_is_not_paid_on_the_step_that_ends_the_episode() {
    let reward = |kind: &str| {
        let mut task = robot(&format!(
            "{REST}{SEEN}{MOVED}reward = [{{ {kind}, weight = 2.0 }}]\n\
             termination = [{{ source = \"qpos:hip\", above = 0.5 }}]\n"
        ))
        .unwrap();
        let going_on = task.step(Action::Continuous(&[0.0])).reward;
        task.set_state(&[0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.7], &[]);
        let step = task.step(Action::Continuous(&[0.0]));
        assert!(step.terminated);
        [going_on, step.reward].map(f64::to_bits)
    };
    let bits = |values: [f64; 2]| values.map(f64::to_bits);
    assert_eq!(reward("kind = \"constant\""), bits([2.0, 2.0]));
    assert_eq!(reward("kind = \"alive\""), bits([2.0, 0.0]));
    assert_eq!(reward("expression = \"{alive} + 1\""), bits([4.0, 2.0]));
}

#[test]
fn an_episode_starts_where_the_file_says() {
    let start = |reset: &str, seed: u64| {
        let mut task = robot(&format!("{REST}{SEEN}{MOVED}{PAID}reset = {{ {reset} }}\n")).unwrap();
        task.reset(&mut Rng::new(seed));
        task.positions().to_vec()
    };
    assert_eq!(
        start("keyframe = \"stand\"", 1),
        [0.0, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0, 0.8, 0.0]
    );
    let placed = start(
        "joint = [{ joint = \"root[2]\", position = 2.0 }, { joint = \"#2\", position = [0.3, 0.4] }]",
        1,
    );
    assert_eq!((placed[2], placed[7]), (2.0, 0.0));
    assert!((0.3..0.4).contains(&placed[8]));
    // Orientations get noise only where the file says so; a joint's own noise holds for it alone.
    let noisy = start(
        "position-noise = 0.1, joint = [{ joint = \"hip\", position-noise = 1e-9 }]",
        1,
    );
    let still = |value: f64, at: f64| value.to_bits() == at.to_bits();
    assert!(!still(noisy[0], 0.0) && still(noisy[3], 1.0) && !still(noisy[8], 0.0));
    assert!(noisy[7].abs() <= 1e-9);
    assert!(!still(start("orientation-noise = 0.1", 1)[4], 0.0));
    for seed in 0..50 {
        let drawn = start(
            "joint = [{ joint = \"hip\", position = [-1, 1] }], redraw-until = \"{qpos:hip} > 0.9\"",
            seed,
        );
        assert!(drawn[7] > 0.9);
    }
    let refused = |reset: &str| {
        robot(&format!("{REST}{SEEN}{MOVED}{PAID}reset = {{ {reset} }}\n")).unwrap_err()
    };
    assert!(refused("keyframe = \"stnd\"").contains("did you mean \"stand\""));
    assert!(refused("joint = [{ joint = \"root\", position = 1.0 }]").contains("root[0]"));
    assert!(
        refused("joint = [{ joint = \"hip\", position = [1, -1] }]").contains("lower one first")
    );
    assert!(refused("redraw-until = \"1 < 0\"").contains("none of 1000 draws"));
    assert!(refused("redraw-until = \"{com:x} > 0\"").contains("before the first step"));
}

#[test]
fn goals_are_drawn_for_each_episode_and_seen() {
    let mut task = robot(&format!(
        "{REST}observation = [{{ source = \"goal:x\", name = \"goal\", unit = \"m\" }}]\n{MOVED}\
         reward = [{{ expression = \"-abs({{goal:x}} - 1)\" }}]\ngoal = [{{ name = \"x\", low = 2, high = 3 }}]\n"
    ))
    .unwrap();
    let mut seen = Vec::new();
    for seed in 0..20 {
        task.reset(&mut Rng::new(seed));
        let goal = observed(&task)[0];
        assert!((2.0..3.0).contains(&goal));
        let reward = task.step(Action::Continuous(&[0.0])).reward;
        assert!((reward + f64::from(goal) - 1.0).abs() < 1e-6);
        seen.push(goal.to_bits());
    }
    seen.dedup();
    assert_eq!(seen.len(), 20);
}

#[test]
fn a_table_of_actions_makes_the_task_discrete() {
    let table = |controls: &str| {
        robot(&format!(
            "{REST}{SEEN}{MOVED}reward = [{{ expression = \"{{ctrl:#0}} + 10 * {{outputs}}\" }}]\n\
             action = [{{ name = \"off\", controls = [0.0] }}, {{ name = \"on\", controls = {controls} }}]\n"
        ))
    };
    let mut task = table("[-0.5]").unwrap();
    assert_eq!(task.spec().actions, ActionSpace::Discrete(2));
    let mut reward = |action| task.step(action).reward;
    assert!((reward(Action::Discrete(1)) - 2.0).abs() < 1e-9);
    assert!(reward(Action::Discrete(7)).abs() < 1e-9);
    assert!(reward(Action::Continuous(&[1.0])).abs() < 1e-9);
    assert!(
        table("[0.0, 1.0]")
            .unwrap_err()
            .contains("there are 1 actuators")
    );
    assert!(
        table("[1.5]")
            .unwrap_err()
            .contains("not within its range of -1 to 1")
    );
}

#[test]
fn rates_are_limited_and_decisions_repeated() {
    let mut task = robot(&format!(
        "{REST}{SEEN}action-repeat = 3\nreward = [{{ expression = \"{{ctrl:#0}}\" }}]\n\
         actuator = [{{ actuator = \"#0\", name = \"torque\", rate-limit = 5.0 }}]\n"
    ))
    .unwrap();
    assert_eq!(task.spec().period_us, 60_000);
    // 0.1 more in each control step of 0.02 s: 0.1 + 0.2 + 0.3.
    assert!((task.step(Action::Continuous(&[1.0])).reward - 0.6).abs() < 1e-9);
    assert!((task.step(Action::Continuous(&[0.375])).reward - 1.125).abs() < 1e-9);
}

#[test]
fn a_description_can_be_like_another() {
    let task = robot("like = \"base.toml\"\nname = \"other-v2\"\nmax-steps = 3\n").unwrap();
    let spec = task.spec();
    assert_eq!((spec.name.as_str(), spec.max_steps), ("other-v2", 3));
    assert_eq!(spec.inputs[0].name, "hip");
    let message = robot("like = \"no.toml\"\nname = \"other-v2\"\n").unwrap_err();
    assert!(
        message.contains("like = \"no.toml\": no no.toml"),
        "{message}"
    );
}

#[test]
fn an_expression_measures_before_and_after_the_step() {
    let reward = |expression: &str| {
        let mut task = robot(&format!(
            "{REST}{SEEN}{MOVED}reward = [{{ expression = \"{expression}\" }}]\n"
        ))
        .unwrap();
        task.set_state(&[0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0], &[2.0]);
        // A torque would move the base.
        let output = if expression == "{outputs}" { 0.5 } else { 0.0 };
        task.step(Action::Continuous(&[output])).reward
    };
    assert!((reward("{rate:qpos:root[0]}") - 2.0).abs() < 1e-9);
    assert!((reward("{qpos:root[0]} - {before:qpos:root[0]}") - 0.04).abs() < 1e-9);
    assert!((reward("{squares:qvel:root[..3]}") - 4.0).abs() < 1e-9);
    assert!((reward("{squares:qvel:root[..3] within 1}") - 1.0).abs() < 1e-9);
    assert!((reward("{distance:xpos:base, xpos:world}") - (1.0f64 + 4e-4).sqrt()).abs() < 1e-3);
    assert!((reward("{outputs}") - 0.25).abs() < 1e-9);
    for (expression, words) in [
        ("{before:outputs}", "before the step"),
        ("{distance:xpos:base}", "two sources"),
        (
            "{distance:xpos:base, xquat:base}",
            "3 values and the second 4",
        ),
        ("{squares:time}", "no block"),
        ("{squares:qvel:* within 0}", "above 0"),
    ] {
        let text = format!("{REST}{SEEN}{MOVED}reward = [{{ expression = \"{expression}\" }}]\n");
        let message = robot(&text).unwrap_err();
        assert!(message.contains(words), "{expression}: {message}");
    }
}

#[test]
fn the_model_differs_from_episode_to_episode() {
    const MORE: &str = "randomize = { mass = [0.5, 2.0], actuator-gain = [1.0, 3.0] }\n";
    let make = |more: &str| robot(&format!("{REST}{SEEN}{MOVED}{PAID}{more}")).unwrap();
    let mass = |task: &Robot| task.model().body_mass().iter().sum::<f64>();
    let original = mass(&make(""));
    let (mut task, mut plain) = (make(MORE), make(""));
    let mut factors = Vec::new();
    for seed in 0..50 {
        task.reset(&mut Rng::new(seed));
        let factor = mass(&task) / original;
        assert!((0.5..=2.0).contains(&factor), "{factor}");
        // Neither the initial state nor the model that others share is another.
        plain.reset(&mut Rng::new(seed));
        assert_eq!(task.positions(), plain.positions());
        assert!((mass(&plain) - original).abs() < 1e-12);
        // A reused task and a fresh one give the same.
        let mut fresh = make(MORE);
        fresh.reset(&mut Rng::new(seed));
        assert_eq!(mass(&fresh).to_bits(), mass(&task).to_bits());
        let step = |task: &mut Robot| {
            task.step(Action::Continuous(&[1.0]));
            task.positions().to_vec()
        };
        assert_eq!(step(&mut fresh), step(&mut task));
        factors.push(factor);
    }
    factors.sort_by(f64::total_cmp);
    assert!(factors[0] < 0.7 && factors[49] > 1.8, "{factors:?}");
    for (more, words) in [
        ("randomize = { mass = [0.0, 1.0] }", "above 0"),
        ("randomize = { gravity = [2.0, 1.0] }", "lower one first"),
        ("randomize = { weight = [1.0, 1.0] }", "weight"),
    ] {
        let message = robot(&format!("{REST}{SEEN}{MOVED}{PAID}{more}\n")).unwrap_err();
        assert!(message.contains(words), "{more}: {message}");
    }
}

#[test]
fn an_observation_is_off_by_the_same_in_all_of_an_episode() {
    let mut task = robot(&format!(
        "{REST}observation = [{{ source = \"qpos:hip\", name = \"hip\", unit = \"rad\", offset = 0.1 }}]\n{MOVED}{PAID}"
    ))
    .unwrap();
    let mut seen = Vec::new();
    for seed in 0..20 {
        task.reset(&mut Rng::new(seed));
        let offset = observed(&task)[0];
        assert!(offset.abs() <= 0.1);
        task.step(Action::Continuous(&[0.0]));
        assert_eq!(observed(&task)[0].to_bits(), offset.to_bits());
        seen.push(offset.to_bits());
    }
    seen.dedup();
    assert_eq!(seen.len(), 20);
}
