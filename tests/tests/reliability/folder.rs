//! Folders that are not what a run left, and what is refused.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use crate::run::{
    PLAIN, TUNED, assert_refused, begin, folder, left_by, resume, send, start_until_checkpoint,
    train,
};
use tpg_tests::process::{command_path, finish, text, tpg, tpg_ok};

#[cfg(feature = "mujoco")]
const TASK: &str = r#"
name = "cr-v1"
model = "m.xml"
frame-skip = 10
max-steps = 50
[[observation]]
source = "qpos:j"
name = "j"
unit = "rad"
[[actuator]]
name = "j"
[[reward]]
kind = "square"
source = "qpos:j"
weight = -1.0
[reset]
position-noise = 0.5
"#;

#[cfg(feature = "mujoco")]
const MODEL: &str = r#"<mujoco><option timestep="0.002"/><worldbody><include file="body.xml"/></worldbody>
    <actuator><motor name="j" joint="j" ctrllimited="true" ctrlrange="-1 1"/></actuator></mujoco>"#;

#[cfg(feature = "mujoco")]
const BODY: &str = r#"<mujocoinclude><body><joint name="j" type="hinge" axis="0 1 0"/>
    <geom size=".1" mass="1"/></body></mujocoinclude>"#;

/// Replaces text that must be there.
fn edit(path: &Path, from: &str, to: &str) {
    let before = fs::read_to_string(path).expect("a file");
    assert!(before.contains(from), "no {from:?} in {before}");
    fs::write(path, before.replacen(from, to, 1)).expect("written");
}

#[test]
fn a_run_that_is_killed_at_once_goes_on() {
    let (_folder, out) = folder();
    let command = begin(PLAIN, &out, &["--generations", "20"]);
    let mut child = start_until_checkpoint(&command, &out);
    child.kill().expect("killed");
    child.wait().expect("ended");
    assert_eq!(resume(&out, &[]).status.code(), Some(0));
    let wanted = out.with_file_name("undisturbed");
    train(PLAIN, &wanted, &["--generations", "20"]);
    assert_eq!(left_by(&out), left_by(&wanted));
}

#[test]
fn a_folder_without_a_checkpoint_can_be_begun_again() {
    let (_folder, out) = folder();
    let command = begin(PLAIN, &out, &["--generations", "3"]);
    tpg_ok(&command);
    let wanted = left_by(&out);
    fs::remove_file(out.join("checkpoint")).expect("removed");
    assert_refused(
        &resume(&out, &[]),
        3,
        &["no checkpoint", "begin it again", "cartpole"],
    );
    tpg_ok(&command);
    assert_eq!(left_by(&out), wanted);
}

#[test]
fn one_process_at_a_time_trains_in_a_folder() {
    let (_folder, out) = folder();
    let command = begin(PLAIN, &out, &["--generations", "1000000"]);
    let first = start_until_checkpoint(&command, &out);
    let pid = first.id().to_string();
    assert_refused(
        &resume(&out, &[]),
        2,
        &["another process", &pid, text(&out)],
    );
    assert_refused(&tpg(&command), 2, &["another process"]);
    send("-TERM", &first);
    assert_eq!(finish(first).status.code(), Some(130));
}

#[test]
fn what_does_not_belong_to_the_checkpoint_is_refused() {
    let (_folder, out) = folder();
    train(PLAIN, &out, &["--generations", "4"]);
    let refused = |file: &str, words: &[&str], change: &dyn Fn(&Path)| {
        let path = out.join(file);
        let before = fs::read(&path).expect("a file");
        change(&path);
        let words: Vec<&str> = words.iter().copied().chain([text(&path)]).collect();
        assert_refused(&resume(&out, &["--generations", "5"]), 3, &words);
        fs::write(&path, before).expect("written");
    };
    refused("config.toml", &["evolution.population"], &|path| {
        edit(path, "population = 12", "population = 13");
    });
    refused("log.csv", &["rows"], &|path| edit(path, "\n3,", "\n7,"));
    refused("log.csv", &["rows"], &|path| {
        fs::write(path, "").expect("written");
    });
    refused("run.toml", &["seed", "4", "3"], &|path| {
        edit(path, "seed = 3", "seed = 4");
    });
    refused("checkpoint", &["checksum"], &|path| {
        let mut bytes = fs::read(path).expect("a checkpoint");
        *bytes.last_mut().expect("bytes") ^= 1;
        fs::write(path, bytes).expect("written");
    });
    // Nothing of this has changed the run.
    assert_eq!(resume(&out, &["--generations", "5"]).status.code(), Some(0));
}

#[test]
fn a_checkpoint_of_another_run_is_refused() {
    let (_folder, out) = folder();
    let [other, longer] = ["other", "longer"].map(|name| out.with_file_name(name));
    train(PLAIN, &out, &["--generations", "4"]);
    train(TUNED, &other, &["--generations", "2"]);
    train(PLAIN, &longer, &["--generations", "6"]);
    let place = out.join("checkpoint");
    fs::copy(other.join("checkpoint"), &place).expect("copied");
    assert_refused(&resume(&out, &[]), 3, &["config.toml", "observability"]);
    // Of the same run, but of rows that are not there.
    fs::copy(longer.join("checkpoint"), &place).expect("copied");
    assert_refused(&resume(&out, &[]), 3, &["log.csv", "rows"]);
}

#[cfg(feature = "mujoco")]
#[test]
fn a_task_that_changed_is_refused_unless_accepted() {
    for (file, from, to) in [
        ("t.toml", "weight = -1.0", "weight = -2.0"),
        (
            "m.xml",
            "timestep=\"0.002\"",
            "timestep=\"0.002\" gravity=\"0 0 -5\"",
        ),
        ("body.xml", "mass=\"1\"", "mass=\"2\""),
    ] {
        let (place, out) = folder();
        let path = |name: &str| place.path().join(name);
        fs::write(path("t.toml"), TASK).expect("written");
        fs::write(path("m.xml"), MODEL).expect("written");
        fs::write(path("body.xml"), BODY).expect("written");
        let task = path("t.toml");
        train(
            &["sr-sm"],
            &out,
            &["--generations", "2", "--task", text(&task)],
        );
        edit(&path(file), from, to);
        let more = ["--generations", "3"];
        let refused = resume(&out, &more);
        assert_refused(
            &refused,
            3,
            &["changed since generation 2", "--accept-changed-task"],
        );
        let accepted = resume(&out, &[&more[..], &["--accept-changed-task"]].concat());
        assert_refused(&accepted, 0, &[]);
        assert_refused(&resume(&out, &["--generations", "4"]), 0, &[]);
    }
}

#[test]
fn files_of_strangers_stay() {
    for name in [
        "champion.tpg",
        "log.csv",
        "config.toml",
        "checkpoint",
        "run.toml",
        "lock",
    ] {
        let (_folder, out) = folder();
        fs::create_dir(&out).expect("made");
        let file = out.join(name);
        fs::write(&file, "precious = true").expect("written");
        let refused = tpg(begin(PLAIN, &out, &["--generations", "1"]));
        assert_refused(&refused, 2, &[text(&out)]);
        assert_eq!(
            fs::read_to_string(&file).expect("it"),
            "precious = true",
            "{name}"
        );
        assert_eq!(fs::read_dir(&out).expect("it").count(), 1);
    }
}

#[test]
fn a_folder_that_cannot_be_written_is_named() {
    let (place, _) = folder();
    let file = place.path().join("file");
    fs::write(&file, "").expect("written");
    for out in [file.join("run"), "/proc/run".into()] {
        let refused = tpg(begin(PLAIN, &out, &["--generations", "1"]));
        assert_refused(&refused, 2, &[text(&out)]);
    }
}

#[test]
fn a_folder_that_is_deleted_while_training_is_noticed() {
    let (_folder, out) = folder();
    let command = begin(PLAIN, &out, &["--generations", "1000000"]);
    let child = start_until_checkpoint(&command, &out);
    fs::rename(&out, out.with_file_name("elsewhere")).expect("moved");
    let output = finish(child);
    assert_refused(&output, 2, &[text(&out)]);
    // It can go on from where it lies now.
    let moved = out.with_file_name("elsewhere");
    assert_eq!(
        resume(&moved, &["--generations", "2"]).status.code(),
        Some(0)
    );
}

#[test]
fn a_long_run_can_leave_less() {
    let (_folder, out) = folder();
    let all = out.with_file_name("all");
    train(PLAIN, &all, &["--generations", "30"]);
    let all = left_by(&all);
    let keep = ["--log-every", "10", "--keep-champions", "2"];
    train(PLAIN, &out, &[&keep[..], &["--generations", "15"]].concat());
    assert_eq!(
        resume(&out, &["--generations", "30"]).status.code(),
        Some(0)
    );
    let few = left_by(&out);
    let wanted: Vec<String> = [0, 10, 20, 30].map(|row| all.log[row].clone()).into();
    assert_eq!(few.log, wanted);
    let latest = all.champions.into_iter().rev().take(2);
    assert_eq!(few.champions, latest.collect());
}

/// A killed run leaves champions of generations that its checkpoint does not know.
#[test]
fn champions_behind_the_checkpoint_are_dropped() {
    let (_folder, out) = folder();
    train(PLAIN, &out, &["--generations", "3"]);
    let wanted = left_by(&out);
    fs::write(out.join("champions/000004.tpg"), "half").expect("written");
    assert_eq!(resume(&out, &[]).status.code(), Some(0));
    assert_eq!(left_by(&out), wanted);
}

#[test]
fn the_end_of_a_terminal_does_not_end_a_run_under_nohup() {
    let (_folder, out) = folder();
    let command = begin(PLAIN, &out, &["--generations", "40"]);
    let mut nohup = Command::new("nohup");
    let child = nohup
        .arg(command_path("tpg"))
        .args(&command)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("nohup runs");
    while !out.join("checkpoint").exists() {
        std::thread::sleep(Duration::from_millis(2));
    }
    send("-HUP", &child);
    assert_eq!(finish(child).status.code(), Some(0));
}
