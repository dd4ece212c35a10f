//! `tpg eval --animate`: `cargo test -p tpg --features render --test animate`. Needs EGL, as `.ci/run install` installs it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The champion of a preset.
fn champion(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/champions");
    folder.join(name).with_extension("tpg")
}

fn eval(policy: &str, words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tpg"));
    command.arg("eval").arg(champion(policy)).args(words);
    command
}

fn output(command: &mut Command) -> Output {
    command.output().expect("the program starts")
}

fn printed(command: &mut Command) -> String {
    let output = output(command);
    assert!(output.status.success(), "{}", said(&output));
    String::from_utf8(output.stdout).expect("text")
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A picture of an animation, as a viewer shows it.
struct Picture {
    /// Hundredths of a second.
    time: u16,
    pixels: Vec<[u8; 3]>,
}

/// The width of an animation, and its pictures.
fn read(file: &Path) -> (u16, u16, Vec<Picture>) {
    let file = std::fs::File::open(file).expect("an animation");
    let mut reader = gif::Decoder::new(file).expect("a GIF");
    let (width, height) = (reader.width(), reader.height());
    let palette = reader.global_palette().expect("one palette").to_vec();
    let mut screen = vec![[0; 3]; usize::from(width) * usize::from(height)];
    let mut pictures = Vec::new();
    while let Some(frame) = reader.read_next_frame().expect("a picture") {
        assert_eq!(frame.palette, None, "the palette is one for all");
        let rows = frame.buffer.chunks(frame.width.into());
        for (row, colours) in (usize::from(frame.top)..).zip(rows) {
            let first = row * usize::from(width) + usize::from(frame.left);
            for (place, colour) in (first..).zip(colours) {
                if Some(*colour) != frame.transparent {
                    screen[place] = palette.as_chunks::<3>().0[usize::from(*colour)];
                }
            }
        }
        pictures.push(Picture {
            time: frame.delay,
            pixels: screen.clone(),
        });
    }
    (width, height, pictures)
}

/// Pixels of the colour of Gymnasium's robots, a light brown.
fn brown(picture: &Picture) -> usize {
    let brown = |[red, green, blue]: &&[u8; 3]| {
        *red > 90 && red.abs_diff(*green) > 20 && *red > *green && *green > *blue
    };
    picture.pixels.iter().filter(brown).count()
}

#[test]
fn an_episode_is_drawn_and_scores_the_same() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("hopper.gif");
    let score = ["--episodes", "2", "--json"];
    let plain = printed(&mut eval("hopper-b23", &score));
    let draw = ["--animate-size", "160x120", "--animate"];
    let mut drawn = eval("hopper-b23", &score);
    let drawn = printed(drawn.args(draw).arg(&file));
    assert_eq!(drawn, plain, "in every digit");
    let (width, height, pictures) = read(&file);
    assert_eq!((width, height), (160, 120));
    let report: serde_json::Value = serde_json::from_str(&plain).expect("JSON");
    let steps = report["lengths"][0].as_u64().expect("a number of steps");
    // Hopper decides every 8 ms, and a picture is shown for 40; the last one stays.
    assert_eq!(pictures.len() as u64, steps / 5 + 1);
    let (last, others) = pictures.split_last().expect("pictures");
    assert!(others.iter().all(|picture| picture.time == 4));
    assert_eq!(last.time, 100);
    for (k, pair) in pictures.windows(2).enumerate() {
        assert!(pair[0].pixels != pair[1].pixels, "{k}: nothing moves");
    }
    for (k, picture) in pictures.iter().enumerate() {
        let share = brown(picture) as f64 / picture.pixels.len() as f64;
        assert!(
            (0.005..0.3).contains(&share),
            "{k}: the robot covers {share}"
        );
    }
    let again = folder.path().join("again.gif");
    printed(eval("hopper-b23", &score).args(draw).arg(&again));
    let bytes = |file: &Path| std::fs::read(file).expect("a file");
    assert!(bytes(&again) == bytes(&file), "the same bytes");
}

/// HalfCheetah decides every 50 ms: a picture for each decision, and no more than 30 s of them.
#[test]
fn a_long_episode_is_cut_and_long_steps_are_pictures_each() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("cheetah.gif");
    let draw = ["--episodes", "1", "--animate-size", "64x48", "--animate"];
    printed(eval("half-cheetah-b23", &draw).arg(&file));
    let (.., pictures) = read(&file);
    assert_eq!(pictures.len(), 30 * 20 + 1);
    assert!(pictures[..600].iter().all(|picture| picture.time == 5));
}

/// All mistakes are found before episodes run: so many would take hours.
#[test]
fn what_cannot_be_drawn_is_refused_before_episodes_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    for (policy, file, says) in [
        ("cartpole", "a.gif", "--view OUT.html draws every task"),
        ("hopper-b23", "a.webp", "has to end in .gif"),
        ("hopper-b23", "missing/a.gif", "cannot write"),
    ] {
        let mut command = eval(policy, &["--episodes", "4000000", "--animate"]);
        let output = output(command.arg(path(file)));
        assert_eq!(output.status.code(), Some(2), "{}", said(&output));
        assert!(said(&output).contains(says), "{}", said(&output));
        assert!(!path(file).exists());
    }
    let sizes = ["480", "480x", "8x360", "480x4000", "480x360x2"];
    for size in sizes {
        let mut command = eval("hopper-b23", &["--animate-size", size, "--animate"]);
        let output = output(command.arg(path("a.gif")));
        assert_eq!(output.status.code(), Some(2), "{size}");
        assert!(said(&output).contains("320x240"), "{}", said(&output));
    }
}

/// Where the driver is missing, the message names the packages.
#[cfg(target_os = "linux")]
#[test]
fn without_a_driver_the_message_names_the_packages() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut command = eval("hopper-b23", &["--animate"]);
    command.arg(folder.path().join("a.gif"));
    // libEGL looks for drivers in this list alone.
    command.env("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent");
    let output = output(&mut command);
    assert_eq!(output.status.code(), Some(4), "{}", said(&output));
    let packages = "apt-get install libegl1 libgl1-mesa-dri";
    assert!(said(&output).contains(packages), "{}", said(&output));
}
