//! Other people's robots, as a user meets them: models without names, floating bases, sensors of velocities, robots that
//! differ from episode to episode; and what is asked of a champion afterwards.
#![cfg(feature = "mujoco")]

use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;
use tpg_runtime::Policy;
use tpg_tests::process::{stderr, text, tpg, tpg_json, tpg_ok};

/// A pendulum whose actuator has no name, as in Gymnasium's own hopper, ant and walker.
const PENDULUM: &str = r#"<mujoco><worldbody><body><joint name="j" type="hinge" axis="0 1 0"/>
    <geom size=".1" mass="1"/></body></worldbody>
    <actuator><motor joint="j" ctrllimited="true" ctrlrange="-1 1"/></actuator></mujoco>"#;

/// A floating base with a leg and a keyframe.
const FLOATING: &str = r#"<mujoco><option timestep="0.005"/><worldbody><geom type="plane" size="5 5 .1"/>
    <body name="base" pos="0 0 0.3"><freejoint name="root"/><geom type="box" size=".1 .1 .05" mass="1"/>
    <body name="leg"><joint name="hip" type="hinge" axis="0 1 0" range="-1 1" limited="true"/>
    <geom name="foot" type="capsule" fromto="0 0 0 0 0 -.2" size=".02" mass=".2"/></body></body></worldbody>
    <actuator><position name="hip" joint="hip" kp="20" ctrlrange="0.5 1.5"/></actuator>
    <keyframe><key name="stand" qpos="0 0 .5 1 0 0 0 .8" ctrl="0.9"/></keyframe></mujoco>"#;

const HEAD: &str = "name = \"t-v1\"\nmodel = \"m.xml\"\nframe-skip = 5\nmax-steps = 50\n";

/// A folder with a model and the description of a task on it.
fn task(model: &str, description: &str) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("m.xml"), model).expect("written");
    let path = folder.path().join("t.toml");
    fs::write(&path, format!("{HEAD}{description}")).expect("written");
    (folder, path)
}

/// A small training of a variant, with more arguments.
fn train(variant: &str, task: &Path, out: &Path, more: &[&str]) -> (Option<i32>, String) {
    let small = [
        "train",
        variant,
        "--task",
        text(task),
        "--out",
        text(out),
        "--seed",
        "1",
        "--generations",
        "1",
        "--set",
        "evaluation.episodes=1",
    ];
    let output = tpg([&small[..], more].concat());
    (output.status.code(), stderr(&output))
}

const FEW: [&str; 4] = [
    "--set",
    "evolution.population=10",
    "--set",
    "evolution.children=10",
];

fn trained(variant: &str, task: &Path, out: &Path, more: &[&str]) -> PathBuf {
    let (status, message) = train(variant, task, out, more);
    assert_eq!(status, Some(0), "{message}");
    out.join("champion.tpg")
}

#[test]
fn an_actuator_without_a_name_is_listed_and_can_be_addressed() {
    let description = "observation = [{ source = \"qpos:j\", name = \"j\", unit = \"rad\" }]\n\
        actuator = [{ name = \"j\" }]\nreward = [{ kind = \"alive\", weight = 1.0 }]\n";
    let (folder, path) = task(PENDULUM, description);
    let (status, message) = train("sr-sm", &path, &folder.path().join("run"), &FEW);
    assert_eq!(status, Some(2), "{message}");
    assert!(message.contains("#0"), "{message}");
    for address in ["joint:j", "#0"] {
        let named = format!("actuator = [{{ name = \"j\", actuator = {address:?} }}]");
        let named = description.replace("actuator = [{ name = \"j\" }]", &named);
        fs::write(&path, format!("{HEAD}{named}")).expect("written");
        trained("sr-sm", &path, &folder.path().join(address), &FEW);
    }
}

#[test]
fn what_is_paid_while_the_episode_goes_on_is_not_paid_on_its_last_step() {
    let description = "observation = [{ source = \"qpos:j\", name = \"j\", unit = \"rad\" }]\n\
        actuator = [{ name = \"j\", actuator = \"joint:j\" }]\nreward = [{ kind = \"constant\", weight = 1.0 }]\n\
        termination = [{ source = \"qpos:j\", above = -5.0 }]\n";
    let (folder, path) = task(PENDULUM, description);
    let mean = |kind: &str| {
        let text_of_kind = description.replace("constant", kind);
        fs::write(&path, format!("{HEAD}{text_of_kind}")).expect("written");
        let champion = trained("sr-sm", &path, &folder.path().join(kind), &FEW);
        let arguments = ["--task", text(&path), "--episodes", "2", "--json"];
        tpg_json(&[&["eval", text(&champion)], &arguments[..]].concat())["mean"].as_f64()
    };
    assert_eq!(mean("constant"), Some(1.0));
    assert_eq!(mean("alive"), Some(0.0));
}

#[test]
fn a_sensor_of_a_velocity_is_hidden_with_the_velocities() {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/examples/crane");
    let folder = tempfile::tempdir().expect("a folder");
    fs::copy(example.join("crane.xml"), folder.path().join("crane.xml")).expect("copied");
    let description = fs::read_to_string(example.join("crane.toml")).expect("read");
    let silent = description.replace("velocity = true\n", "");
    assert_ne!(silent, description);
    let path = folder.path().join("crane.toml");
    fs::write(&path, silent).expect("written");
    let hidden = ["--set", "observability=[\"velocities-removed\"]"];
    let more = [&FEW[..], &hidden].concat();
    let champion = trained("sr-sm", &path, &folder.path().join("run"), &more);
    let everything = ["--task", text(&path), "--observability", "none"];
    let output = tpg([&["eval", text(&champion)], &everything[..]].concat());
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("the policy has 2 inputs"), "{message}");
}

#[test]
fn a_floating_base_is_seen_by_its_joint_and_starts_at_a_keyframe() {
    let description = "observation = [{ source = \"qpos:root[..]\", name = \"base\", unit = \"1\" },\n\
        { source = \"qvel:root[3..]\", name = \"turn\", unit = \"rad/s\" }]\nactuator = [{ name = \"hip\" }]\n\
        reward = [{ kind = \"linear\", source = \"qpos:root[2]\", weight = 1.0 }]\nreset = { keyframe = \"stand\" }\n";
    let (folder, path) = task(FLOATING, description);
    let champion = trained("sr-sm", &path, &folder.path().join("run"), &FEW);
    let trace = folder.path().join("trace");
    let arguments = ["--task", text(&path), "--episodes", "1"];
    tpg_ok(
        &[
            &["eval", text(&champion), "--trace", text(&trace)],
            &arguments[..],
        ]
        .concat(),
    );
    let lines = fs::read_to_string(&trace).expect("a trace");
    let decisions = lines.lines().map(|line| {
        let line: serde_json::Value = serde_json::from_str(line).expect("JSON");
        line["decision"]["observation"].clone()
    });
    let first = decisions.into_iter().find(serde_json::Value::is_array);
    let first = first.expect("a decision");
    assert_eq!(first.as_array().map(Vec::len), Some(7 + 3));
    // The height of the keyframe, as the bits of 0.5, not the 0.3 of the model.
    let height = format!("{:08x}", 0.5f32.to_bits());
    assert_eq!(first[2], height, "{first}");
    let missing = description.replace("stand", "stnd");
    fs::write(&path, format!("{HEAD}{missing}")).expect("written");
    let (status, message) = train("sr-sm", &path, &folder.path().join("other"), &FEW);
    assert_eq!(status, Some(2), "{message}");
    assert!(message.contains("\"stand\""), "{message}");
}

/// As a robot with height scans has them, and with so many motors.
fn wide(inputs: usize, outputs: usize) -> (TempDir, PathBuf) {
    let bodies: String = (0..inputs)
        .map(|i| {
            format!(
                "<body pos=\"{i} 0 0\"><joint name=\"j{i}\" type=\"hinge\" axis=\"0 1 0\"/><geom size=\".1\" mass=\"1\"/></body>"
            )
        })
        .collect();
    let motors: String = (0..outputs)
        .map(|i| (i, i % inputs))
        .map(|(i, j)| format!("<motor name=\"a{i}\" joint=\"j{j}\" ctrlrange=\"-1 1\"/>"))
        .collect();
    let model =
        format!("<mujoco><worldbody>{bodies}</worldbody><actuator>{motors}</actuator></mujoco>");
    let actuators: Vec<_> = (0..outputs)
        .map(|i| format!("{{ name = \"a{i}\" }}"))
        .collect();
    let description = format!(
        "observation = [{{ source = \"qpos:*\", name = \"j\", unit = \"rad\" }}]\nactuator = [{}]\n\
         reward = [{{ kind = \"square\", source = \"qpos:j0\", weight = -1.0 }}]\n",
        actuators.join(", ")
    );
    task(&model, &description)
}

#[test]
fn more_inputs_than_a_vector_has_elements_train_without_a_word() {
    let (folder, path) = wide(33, 2);
    for (name, more) in [("default", &[][..]), ("32", &["--set", "policy.width=32"])] {
        let out = folder.path().join(name);
        let champion = trained("sr-sm", &path, &out, &[&FEW[..], more].concat());
        let inspect = tpg_json(&["inspect", text(&champion), "--json"]);
        assert_eq!(inspect["vector_width"], 32, "{name}");
        let eval = [
            "eval",
            text(&champion),
            "--task",
            text(&path),
            "--episodes",
            "1",
            "--json",
        ];
        assert_eq!(tpg_json(&eval)["returns"].as_array().map(Vec::len), Some(1));
    }
}

#[test]
fn more_outputs_than_a_vector_has_elements_train_loop_and_export() {
    let (folder, path) = wide(40, 78);
    let lines = [
        "tuning.lines=1",
        "tuning.directions=2",
        "tuning.top=1",
        "selection.candidates=0",
    ];
    let lines: Vec<&str> = lines.iter().flat_map(|line| ["--set", line]).collect();
    let each = ["--set", "policy.action-programs=each", "--set"];
    let sizes = [
        "evolution.team.size.initial-max=80",
        "--set",
        "evolution.team.size.max=90",
    ];
    let each = [&FEW[..], &each, &sizes].concat();
    for (name, variant, more) in [
        ("evolved", "sr-sm", &FEW[..]),
        ("linear", "champion", &lines),
        ("each", "sl", &each),
    ] {
        let champion = trained(variant, &path, &folder.path().join(name), more);
        let bytes = fs::read(&champion).expect("a champion");
        let policy = Policy::load(&bytes).expect("a policy");
        assert_eq!(policy.header().outputs(), 78, "{name}");
        let run = |verb: &str| {
            let arguments = [
                "--task",
                text(&path),
                "--episodes",
                "2",
                "--seed",
                "5",
                "--json",
            ];
            tpg_json(&[&[verb, text(&champion)], &arguments[..]].concat())["returns"].clone()
        };
        let returns = run("eval");
        assert_eq!(returns.as_array().map(Vec::len), Some(2));
        assert_eq!(returns, run("hil"), "{name}");
        let c = folder.path().join(name).join("policy.c");
        tpg_ok(&["export", text(&champion), "--c", text(&c)]);
    }
}

#[test]
fn more_outputs_than_a_policy_can_have_are_refused_with_both_numbers() {
    let (folder, path) = wide(2, 15);
    let narrow = [&FEW[..], &["--set", "policy.width=2"]].concat();
    let (status, message) = train("sr-sm", &path, &folder.path().join("run"), &narrow);
    assert_eq!(status, Some(2), "{message}");
    for word in ["policy.width = 2", "at most 14 outputs", "has 15"] {
        assert!(message.contains(word), "no {word:?} in: {message}");
    }
}

#[test]
fn more_inputs_than_the_loop_carries_are_told_before_training() {
    let (folder, path) = wide(513, 1);
    let small = ["--set", "policy.width=2", "--set", "evaluation.max-steps=2"];
    let more = [&FEW[..], &small].concat();
    let (status, message) = train("sr-sm", &path, &folder.path().join("run"), &more);
    assert_eq!(status, Some(0), "{message}");
    for word in ["513 inputs", "512", "tpg hil"] {
        assert!(message.contains(word), "no {word:?} in: {message}");
    }
}

#[test]
fn champion_trains_any_robot_and_hides_nothing_unless_asked() {
    let description = "observation = [{ source = \"qpos:j\", name = \"j\", unit = \"rad\" }]\n\
        actuator = [{ name = \"j\", actuator = \"joint:j\" }]\n\
        reward = [{ kind = \"square\", source = \"qpos:j\", target = 1.0, weight = -1.0 }]\n";
    let (folder, path) = task(PENDULUM, description);
    for (variant, observability) in [("champion", "none"), ("champion-b23", "blackout:2/3")] {
        let champion = trained(variant, &path, &folder.path().join(variant), &[]);
        let arguments = ["--task", text(&path), "--episodes", "2", "--json"];
        let run = |verb| tpg_json(&[&[verb, text(&champion)], &arguments[..]].concat());
        let (eval, hil) = (run("eval"), run("hil"));
        assert_eq!(eval["observability"], observability);
        assert_eq!(eval["returns"], hil["returns"], "{variant}");
    }
}

#[test]
fn randomization_can_be_switched_off_in_one_process_and_in_two() {
    let description = "observation = [{ source = \"qpos:j\", name = \"j\", unit = \"rad\" }]\n\
        actuator = [{ name = \"j\", actuator = \"joint:j\" }]\n\
        reward = [{ kind = \"square\", source = \"qpos:j\", target = 1.0, weight = -1.0 }]\n\
        reset = { position-noise = 0.1, velocity-noise = 0.5 }\n";
    let (folder, path) = task(
        &PENDULUM.replace("size=\".1\"", "pos=\"0 0 -.5\" size=\".1\""),
        description,
    );
    let champion = trained("sr-sm", &path, &folder.path().join("run"), &FEW);
    let plain_episodes = ["--task", text(&path), "--episodes", "3", "--json"];
    let run = |verb: &str, more: &[&str]| {
        tpg_json(&[&[verb, text(&champion)], &plain_episodes[..], more].concat())
    };
    let plain = run("eval", &[]);
    let random =
        format!("{HEAD}{description}randomize = {{ mass = [2.0, 3.0], gravity = [0.2, 0.5] }}\n");
    fs::write(&path, random).expect("written");
    let on = run("eval", &[]);
    assert_ne!(on["returns"], plain["returns"]);
    assert_eq!(on["randomize"], true);
    for verb in ["eval", "hil"] {
        let off = run(verb, &["--randomize", "off"]);
        assert_eq!(off["returns"], plain["returns"], "{verb}");
        assert_eq!(off["randomize"], false, "{verb}");
        assert_eq!(run(verb, &["--randomize", "on"])["returns"], on["returns"]);
    }
}

/// Training makes one episode of the thesis's physics, with the presets' names as documented.
#[test]
fn the_physics_of_the_thesis_has_presets_and_tasks() {
    let folder = tempfile::tempdir().expect("a folder");
    for (preset, task, period_us) in [
        (
            "inverted-double-pendulum-skip1-sl-nc-b13",
            "inverted-double-pendulum-skip1-v1",
            10_000,
        ),
        ("hopper-skip1-sr-sm-b23", "hopper-skip1-v1", 2_000),
        ("half-cheetah-skip1-sr", "half-cheetah-skip1-v1", 10_000),
    ] {
        let out = folder.path().join(preset);
        let mut command = vec!["train", preset, "--generations", "1", "--out", text(&out)];
        command.extend(FEW);
        command.extend(["--set", "evaluation.episodes=1"]);
        tpg_ok(&command);
        let champion = out.join("champion.tpg");
        let shown = tpg_json(&["inspect", text(&champion), "--json"]);
        assert_eq!(shown["task"], task);
        assert_eq!(shown["control_period_us"], period_us, "{shown}");
    }
}

#[test]
fn a_policy_without_memory_loses_nothing_by_forgetting() {
    let folder = tempfile::tempdir().expect("a folder");
    let preset = |name: &str, more: &[&str]| {
        let out = folder.path().join(name);
        let command = ["train", name, "--out", text(&out)];
        tpg_ok(&[&command[..], more].concat());
        out.join("champion.tpg")
    };
    let stateless = preset("cartpole-sl", &[&FEW[..], &["--generations", "3"]].concat());
    let report = tpg_json(&[
        "eval",
        text(&stateless),
        "--episodes",
        "5",
        "--ablate",
        "all",
        "--json",
    ]);
    assert_eq!(report["ablation"]["returns"], report["returns"]);
    assert_eq!(report["ablation"]["drop"], 0.0);
    assert_eq!(report["ablation"]["what"], "all");
    // Hidden velocities can only be had from what registers remember.
    let history = preset("cartpole-champion", &["--steps", "100000"]);
    let report = tpg_json(&[
        "eval",
        text(&history),
        "--episodes",
        "20",
        "--ablate",
        "registers",
        "--json",
    ]);
    let number = |value: &serde_json::Value| value.as_f64().expect("a number");
    let drop = number(&report["ablation"]["drop"]);
    let difference = number(&report["mean"]) - number(&report["ablation"]["mean"]);
    assert!((drop - difference).abs() < 1e-9, "{report}");
    assert!(
        number(&report["ablation"]["drop_ci95"][0]) > 0.0,
        "{report}"
    );
}

#[test]
fn a_champion_cut_to_its_most_used_program_is_a_policy_of_its_own() {
    let folder = tempfile::tempdir().expect("a folder");
    for champion in [
        "docs/champions/half-cheetah-b23.tpg",
        "docs/champions/pendulum.tpg",
        "tests/golden/champions/hopper-sr-sm-b23.tpg",
        "tests/golden/champions/cartpole-sr-sm-b23.tpg",
    ] {
        let whole = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("..")
            .join(champion);
        let cut = folder.path().join("cut.tpg");
        let report = tpg_json(&[
            "eval",
            text(&whole),
            "--episodes",
            "2",
            "--json",
            "--most-used-program",
            text(&cut),
        ]);
        let comparison = &report["most_used_program"];
        let share = comparison["share"].as_f64().expect("a share");
        assert!((0.0..=1.0).contains(&share) && share > 0.0, "{comparison}");
        let shown = tpg_json(&["inspect", text(&cut), "--json"]);
        assert_eq!(shown["programs"], 1, "{champion}: {shown}");
        assert_eq!(shown["teams"], 1, "{champion}: {shown}");
        let alone = tpg_json(&["eval", text(&cut), "--episodes", "2", "--json"]);
        assert_eq!(alone["returns"], comparison["returns"], "{champion}");
        if share >= 1.0 {
            // What always acts loses nothing by being alone.
            assert_eq!(alone["returns"], report["returns"], "{champion}");
        }
    }
}

#[test]
fn ranges_of_a_description_reach_whoever_uses_the_policy() {
    let description = "observation = [{ source = \"qpos:j\", name = \"j\", unit = \"rad\", range = [-0.5, inf] },\n\
        { source = \"qvel:j\", name = \"v\", unit = \"rad/s\" }]\n\
        actuator = [{ name = \"j\", actuator = \"#0\" }]\nreward = [{ kind = \"alive\", weight = 1.0 }]\n";
    let (folder, path) = task(PENDULUM, description);
    let champion = trained("sr-sm", &path, &folder.path().join("run"), &FEW);
    let bytes = fs::read(&champion).expect("a champion");
    let policy = Policy::load(&bytes).expect("a policy");
    let ranges: Vec<_> = policy.input_ranges().map(|r| (r.low, r.high)).collect();
    assert_eq!(
        ranges,
        [(-0.5, f32::INFINITY), (f32::NEG_INFINITY, f32::INFINITY)]
    );
    let c = folder.path().join("policy.c");
    tpg_ok(&["export", text(&champion), "--c", text(&c)]);
    let header = fs::read_to_string(c.with_extension("h")).expect("a header");
    assert!(header.contains("0: j [rad], -0.5 or more\n"), "{header}");
    assert!(header.contains("1: v [rad/s]\n"), "{header}");
    for (range, says) in [("[1.0, -1.0]", "lower one"), ("[nan, 1.0]", "lower one")] {
        let wrong = description.replace("[-0.5, inf]", range);
        fs::write(&path, format!("{HEAD}{wrong}")).expect("written");
        let (status, message) = train("sr-sm", &path, &folder.path().join("no"), &FEW);
        assert_eq!(status, Some(2), "{message}");
        assert!(
            message.contains("observation.range") && message.contains(says),
            "{message}"
        );
    }
}
