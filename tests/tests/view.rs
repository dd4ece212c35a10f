//! `tpg eval --view`: what the page shows is what happened, and a browser draws it.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde_json::Value;
use tpg_runtime::Action;
use tpg_tasks::eval::{Domain, EpisodeSeeds, episode_seed};
use tpg_tasks::task::{self, Task};
use tpg_tests::browser::{Browser, Loaded};
use tpg_tests::process::{stderr, text, tpg, tpg_ok};

fn champion(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/champions");
    folder.join(format!("{name}.tpg"))
}

/// The state that a page tells scripts, after checks that hold for every page.
fn state(loaded: &Loaded) -> Value {
    assert_eq!(loaded.console, [""; 0], "the console is silent");
    let state: Value = serde_json::from_str(&loaded.text_of("state")).expect("a state");
    assert_eq!(state["gl_error"], 0, "{state}");
    assert!(state["triangles"].as_u64() > Some(100), "{state}");
    let covered = state["covered"].as_f64().expect("a share");
    assert!(covered > 0.05, "the picture is empty: {covered}");
    state
}

fn floats(value: &Value) -> Vec<f64> {
    let list = value.as_array().expect("a list").iter();
    list.map(|value| value.as_f64().expect("a number"))
        .collect()
}

fn assert_close(found: &[f64], expected: &[f64], tolerance: f64, what: &str) {
    assert_eq!(found.len(), expected.len(), "{what}");
    for (a, b) in found.iter().zip(expected) {
        assert!((a - b).abs() <= tolerance, "{what}: {found:?} {expected:?}");
    }
}

/// The decisions of an episode as a trace has them.
fn decisions(trace: &Path, episode: u64) -> Vec<Value> {
    let lines = std::fs::read_to_string(trace).expect("a trace");
    let events = lines
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"));
    let decisions = events.filter_map(|mut event: Value| Some(event.get_mut("decision")?.take()));
    decisions
        .filter(|decision| decision["episode"] == episode)
        .collect()
}

fn float(bits: &Value) -> f32 {
    let digits = bits.as_str().expect("digits");
    f32::from_bits(u32::from_str_radix(digits, 16).expect("bits"))
}

/// The task's poses, observation and return after the first actions of a traced episode.
fn relive(
    task: &mut dyn Task,
    episode: u64,
    decisions: &[Value],
) -> (Vec<[f32; 7]>, Vec<f32>, f64) {
    let mut seeds = EpisodeSeeds::new(episode_seed(Domain::Test, 0, 0, episode));
    task.reset(&mut seeds.initial_state);
    let mut total = 0.0;
    for decision in decisions {
        let action = decision["action"].as_array().expect("an action");
        let values: Vec<f32>;
        let action = match task.spec().actions {
            task::ActionSpace::Discrete(_) => Action::Discrete(
                action[0]
                    .as_str()
                    .expect("a number")
                    .parse()
                    .expect("a number"),
            ),
            task::ActionSpace::Continuous { .. } => {
                values = action.iter().map(float).collect();
                Action::Continuous(&values)
            }
        };
        total += task.step(action).reward;
    }
    let (mut poses, mut observation) = (Vec::new(), vec![0.0; task.spec().inputs.len()]);
    task.poses(&mut poses);
    task.observe(&mut observation);
    let poses = poses.iter().map(|pose| {
        let ([x, y, z], [w, i, j, k]) = (pose.position, pose.rotation);
        [x, y, z, w, i, j, k]
    });
    (poses.collect(), observation, total)
}

/// Compares what the page shows of some steps with the trace of the same command, and with the task lived through once more.
fn assert_shows_what_happened(name: &str, episode: u64, steps: &[usize]) {
    let Some(browser) = Browser::find() else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let (page, trace) = (folder.path().join("view.html"), folder.path().join("trace"));
    let file = champion(name);
    let episodes = (episode + 1).to_string();
    let arguments = ["eval", text(&file), "--episodes", &episodes];
    let outputs = ["--view", text(&page), "--trace", text(&trace)];
    tpg_ok(&[&arguments[..], &outputs].concat());
    let decisions = decisions(&trace, episode);
    let mut task = task::create(name.trim_end_matches("-b23")).expect("a task");
    for &step in steps {
        let moment = format!("episode={episode}&step={step}&pause");
        let state = state(&browser.load(&page, &moment));
        assert_eq!(state["episode"], episode);
        assert_eq!(state["step"], step);
        assert_eq!(state["steps"], decisions.len());
        assert_shows(&state, &mut *task, episode, &decisions[..=step]);
    }
}

/// Compares a state with the last of these decisions, the first ones of an episode.
fn assert_shows(state: &Value, task: &mut dyn Task, episode: u64, decisions: &[Value]) {
    let (decision, before) = decisions.split_last().expect("a decision");
    let (poses, full, _) = relive(task, episode, before);
    let solids = state["solids"].as_array().expect("a list");
    assert_eq!(solids.len(), poses.len());
    // Two bytes for each number: about 1/65 000 of its range in the episode.
    for (solid, expected) in solids.iter().zip(&poses) {
        let found = floats(&solid["pose"]);
        let expected = expected.map(f64::from);
        assert_close(&found[..3], &expected[..3], 2e-3, "a position");
        // Both signs of a quaternion are the same rotation.
        let dot: f64 = found[3..]
            .iter()
            .zip(&expected[3..])
            .map(|(a, b)| a * b)
            .sum();
        assert!(dot.abs() > 0.999_99, "a rotation: {found:?} {expected:?}");
    }
    let wide = |values: &[f32]| -> Vec<f64> { values.iter().map(|x| f64::from(*x)).collect() };
    let list = |value: &Value| value.as_array().expect("a list").clone();
    let seen: Vec<f32> = list(&decision["observation"]).iter().map(float).collect();
    let blank = seen.iter().all(|value| value.is_nan());
    assert_eq!(state["blank"], blank);
    let shown = floats(&state["observation"]);
    if seen.len() == full.len() {
        assert_close(&shown, &wide(&full), 2e-3, "the state");
    }
    if !blank {
        assert_close(&shown, &wide(&seen), 2e-3, "the observation");
    }
    let visits = list(&decision["path"]);
    let last = visits.last().expect("a team");
    let outputs = last["outputs"].as_array().cloned();
    let acted = outputs.unwrap_or_else(|| vec![last["winner"].clone()]);
    assert_eq!(state["acted"], Value::Array(acted));
    for bid in visits.iter().flat_map(|visit| list(&visit["programs"])) {
        let found = state["bids"][bid["program"].to_string()].as_f64();
        let (found, expected) = (found.expect("a bid"), f64::from(float(&bid["bid"])));
        let tolerance = 2e-3 * expected.abs().max(1.0);
        assert!((found - expected).abs() <= tolerance, "{found} {expected}");
    }
    let (_, _, total) = relive(task, episode, decisions);
    let found = state["return_so_far"].as_f64().expect("a return");
    assert!(
        (found - total).abs() <= 1e-3 * total.abs().max(1.0),
        "{found} {total}"
    );
}

#[test]
fn the_page_of_a_discrete_task_shows_what_happened() {
    assert_shows_what_happened("acrobot", 1, &[0, 33]);
}

#[test]
fn the_page_of_a_continuous_task_shows_what_happened() {
    assert_shows_what_happened("pendulum", 0, &[199]);
}

#[cfg(feature = "mujoco")]
#[test]
fn the_page_of_a_blind_robot_shows_what_happened() {
    assert_shows_what_happened("hopper-b23", 1, &[137, 138, 139]);
}

#[test]
fn the_picture_has_a_robot_in_it() {
    let Some(browser) = Browser::find() else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let page = folder.path().join("view.html");
    tpg_ok(&[
        "eval",
        text(&champion("cartpole")),
        "--episodes",
        "1",
        "--view",
        text(&page),
    ]);
    let picture = browser.picture(&page, "step=100&pause", [900, 600]);
    let mut reader = png::Decoder::new(std::io::Cursor::new(&picture.0))
        .read_info()
        .expect("a PNG");
    let mut bytes = vec![0; reader.output_buffer_size().expect("a size")];
    let info = reader.next_frame(&mut bytes).expect("pixels");
    assert_eq!((info.width, info.height), (900, 600));
    let pixels = bytes.chunks_exact(info.color_type.samples());
    let colours: BTreeSet<&[u8]> = pixels.clone().collect();
    assert!(colours.len() > 300, "{} colours", colours.len());
    // The pole is orange and the cart is blue; both are in the left half, where plots are not.
    let left = pixels
        .enumerate()
        .filter(|(k, _)| k % 900 < 440)
        .map(|(_, pixel)| pixel);
    let strong = |more: usize, less: usize| {
        let pixels = left
            .clone()
            .filter(|p| i32::from(p[more]) - i32::from(p[less]) > 60);
        pixels.count()
    };
    assert!(strong(0, 2) > 500, "no pole: {}", strong(0, 2));
    assert!(strong(2, 0) > 500, "no cart: {}", strong(2, 0));
}

/// Every form, and names that would end a script.
#[cfg(feature = "mujoco")]
#[test]
fn every_form_of_solid_is_drawn() {
    const MODEL: &str = r#"<mujoco>
        <asset>
            <hfield name="hill" nrow="3" ncol="3" size="2 1.5 0.3 0.1" elevation="0 0 0 0 1 0 0 0 0"/>
            <mesh name="wedge" vertex="0 0 0 .4 0 0 0 .4 0 0 0 .4"/>
        </asset>
        <worldbody>
            <geom type="hfield" hfield="hill"/>
            <geom type="plane" size="0 0 1"/>
            <body pos="0 0 1">
                <joint name="slide" type="slide" axis="1 0 0" damping="1"/>
                <geom name="&lt;/script&gt;&lt;script&gt;throw 1&lt;/script&gt;" type="box" size=".15 .1 .05"/>
                <geom type="ellipsoid" size=".1 .2 .1" pos=".4 0 0"/>
                <geom type="cylinder" size=".08 .2" pos="-.4 0 0"/>
                <geom type="capsule" size=".05 .2" pos="-.8 0 0"/>
                <geom type="sphere" size=".1" pos="0 .4 0" rgba=".6 .3 .8 .5"/>
                <geom type="mesh" mesh="wedge" pos="0 -.4 0"/>
            </body>
        </worldbody>
        <actuator><motor name="push" joint="slide" ctrlrange="-1 1" gear="5"/></actuator>
    </mujoco>"#;
    const TASK: &str = r#"
        name = "forms-v1"
        model = "forms.xml"
        frame-skip = 5
        max-steps = 50
        observation = [{ source = "qpos:slide", name = "x", unit = "m" }]
        actuator = [{ name = "push" }]
        reward = [{ kind = "linear", weight = 1.0, source = "qpos:slide" }]
        reset = { position-noise = 0.1 }
    "#;
    let Some(browser) = Browser::find() else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("forms.xml"), MODEL).expect("written");
    std::fs::write(path("forms.toml"), TASK).expect("written");
    let (task, run, page) = (path("forms.toml"), path("run"), path("view.html"));
    let small = ["--generations", "1", "--set", "evolution.population=10"];
    let train = ["train", "sr-sm", "--task", text(&task), "--out", text(&run)];
    tpg_ok(&[&train[..], &small].concat());
    let policy = run.join("champion.tpg");
    let eval = [
        "eval",
        text(&policy),
        "--task",
        text(&task),
        "--episodes",
        "1",
    ];
    tpg_ok(&[&eval[..], &["--view", text(&page)]].concat());
    let state = state(&browser.load(&page, "step=10&pause"));
    let solids = state["solids"].as_array().expect("a list");
    let forms: Vec<&str> = solids
        .iter()
        .map(|s| s["form"].as_str().expect("a form"))
        .collect();
    assert_eq!(
        forms,
        [
            "mesh",
            "plane",
            "box",
            "ellipsoid",
            "cylinder",
            "capsule",
            "sphere",
            "mesh"
        ]
    );
    assert_eq!(solids[2]["name"], "</script><script>throw 1</script>");
}

#[test]
fn a_page_that_cannot_be_written_is_refused_before_episodes_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let page = folder.path().join("missing").join("view.html");
    // So many episodes would take hours.
    let output = tpg([
        "eval",
        text(&champion("cartpole")),
        "--episodes",
        "4000000",
        "--view",
        text(&page),
    ]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("cannot write"),
        "{}",
        stderr(&output)
    );
}

/// The tests' own commands are built without MuJoCo's renderer, which few people need.
#[test]
fn a_build_that_cannot_draw_animations_says_how_to_get_one_that_can() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("animation.gif");
    let policy = champion("cartpole");
    let output = tpg(["eval", text(&policy), "--animate", text(&file)]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    let said = stderr(&output);
    let build = "cargo build --release -p tpg --features render";
    assert!(said.contains(build), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(!file.exists());
}

/// A page grows with its poses; the rest is small.
#[test]
fn a_page_of_a_short_episode_is_small() {
    let folder = tempfile::tempdir().expect("a folder");
    let page = folder.path().join("view.html");
    tpg_ok(&[
        "eval",
        text(&champion("acrobot")),
        "--episodes",
        "1",
        "--view",
        text(&page),
    ]);
    let bytes = std::fs::metadata(&page).expect("a page").len();
    assert!(bytes < 60_000, "{bytes} bytes");
}
