//! What `tpg train` tells other programs: JSON lines, TensorBoard's event files, `run.toml`.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::Value;
use tpg_tests::process::{command_path, finish, stderr, text, tpg_ok};

/// A run of a few small generations.
fn training<'a>(preset: &'a str, out: &'a Path, generations: &'a str) -> Vec<&'a str> {
    let mut words = vec!["train", preset, "--seed", "3", "--threads", "2", "--out"];
    words.extend([text(out), "--generations", generations]);
    words.extend(["--set", "evolution.population=12"]);
    words.extend(["--set", "evolution.children=12"]);
    words
}

/// The rows of `log.csv`, by column.
fn log(folder: &Path) -> Vec<BTreeMap<String, String>> {
    let log = fs::read_to_string(folder.join("log.csv")).expect("a log");
    let mut lines = log.lines();
    let head: Vec<&str> = lines.next().expect("a head").split(',').collect();
    let row = |line: &str| -> BTreeMap<String, String> {
        let cells = line.split(',').map(str::to_owned);
        let names = head.iter().map(|name| (*name).to_owned());
        names.zip(cells).collect()
    };
    lines.map(row).collect()
}

fn json_lines(bytes: &[u8]) -> Vec<Value> {
    let lines = std::str::from_utf8(bytes).expect("text").lines();
    lines
        .map(|line| serde_json::from_str(line).expect("an object a line"))
        .collect()
}

#[test]
fn json_is_one_object_a_line_and_says_what_the_log_says() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("run");
    let mut words = training("cartpole-sr-sm", &out, "3");
    words.push("--json");
    let lines = json_lines(&tpg_ok(&words).stdout);
    assert_eq!(lines.len(), 5, "{lines:?}");
    let events: Vec<&Value> = lines.iter().map(|line| &line["event"]).collect();
    assert_eq!(
        events,
        ["begin", "generation", "generation", "generation", "end"]
    );
    let begin = &lines[0];
    assert_eq!(begin["folder"], text(&out));
    assert_eq!((&begin["seed"], &begin["threads"]), (&3.into(), &2.into()));
    assert_eq!(begin["generation"], 0);
    for (row, line) in log(&out).iter().zip(&lines[1..4]) {
        for (column, cell) in row {
            let value = &line[column];
            let same = match cell.as_str() {
                "" => value.is_null(),
                cell => value.as_f64() == cell.parse().ok(),
            };
            assert!(same, "{column}: {cell} in the log, {value} in {line}");
        }
    }
    let (last, end) = (&lines[3], &lines[4]);
    assert_eq!(end["interrupted"], false);
    for key in ["generation", "steps", "best", "seconds"] {
        assert_eq!(end[key], last[key], "{key}");
    }
    assert_eq!(end["champion"], text(&out.join("champion.tpg")));

    let resume = ["train", "--resume", text(&out), "--generations", "4"];
    let lines = json_lines(&tpg_ok(&[&resume[..], &["--json"]].concat()).stdout);
    assert_eq!(lines.len(), 3);
    assert_eq!(lines[0]["generation"], 3);
    assert_eq!(lines[1]["generation"], 4);
}

/// A script that takes the first line and leaves does not end the run.
#[test]
fn training_goes_on_without_the_reader_of_its_json() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("run");
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    let mut command = Command::new(command_path("tpg"));
    command.args(training("cartpole-sr", &out, "3"));
    command.arg("--json").stdin(Stdio::null()).stdout(writer);
    let child = command.stderr(Stdio::piped()).spawn().expect("tpg starts");
    drop(command);
    let output = finish(child);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert_eq!(log(&out).len(), 3);
}

#[test]
fn event_files_hold_the_scores_at_their_steps() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("run");
    let mut words = training("cartpole-champion", &out, "3");
    words.push("--tensorboard");
    assert!(
        tpg_ok(&words).stdout.is_empty(),
        "nothing on standard output"
    );
    let events = read_events(&only_event_file(&out));
    assert_eq!(events[0].version.as_deref(), Some("brain.Event:2"));
    // What files of the same run before this one hold from here on is made again.
    assert_eq!((events[1].step, events[1].restarts), (1, true));
    let rows = log(&out);
    assert_eq!(events.len(), 2 + rows.len());
    let mut races = 0;
    for (row, event) in rows.iter().zip(&events[2..]) {
        let cell = |name: &str| row[name].parse::<f64>().ok();
        assert_eq!(Some(event.step as f64), cell("steps"));
        let scalar = |tag: &str| event.scalars.get(tag).copied();
        let wanted = |name: &str| cell(name).map(|value| value as f32);
        for (tag, column) in [
            ("rollout/ep_rew_mean", "best"),
            ("eval/mean_reward", "select"),
            ("population/mean", "mean"),
            ("population/teams", "teams"),
            ("population/programs", "programs"),
            ("champion/instructions_mean", "instructions_mean"),
        ] {
            assert_eq!(scalar(tag), wanted(column), "{tag}");
        }
        races += usize::from(scalar("eval/mean_reward").is_some());
        assert!(event.wall_time > 1e9, "{}", event.wall_time);
    }
    assert!(races > 0, "this preset chooses its champion by races");
}

#[test]
fn run_toml_says_what_made_the_run_and_no_path_of_this_machine() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("run");
    tpg_ok(&training("cartpole-sr", &out, "1"));
    let run = fs::read_to_string(out.join("run.toml")).expect("a file");
    let run: toml::Table = run.parse().expect("TOML");
    assert_eq!(run["command"][0].as_str(), Some("tpg"));
    let begun = &run["begun"];
    assert_eq!(begun["threads"].as_integer(), Some(2));
    assert!(begun["host"].as_str().is_some_and(|host| !host.is_empty()));
    let date = begun["date"].as_str().expect("a date");
    date.parse::<toml::value::Datetime>().expect("RFC 3339");
    let version = run["made-with"]["tpg"].as_str().expect("a version");
    let printed = String::from_utf8(tpg_ok(&["--version"]).stdout).expect("text");
    let commit = begun.get("commit").and_then(toml::Value::as_str);
    let words = commit.map_or(version.to_owned(), |commit| format!("{version} ({commit})"));
    assert_eq!(printed.trim_end(), format!("tpg {words}"));
}

fn only_event_file(folder: &Path) -> PathBuf {
    let entries = fs::read_dir(folder).expect("a folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let mut files: Vec<PathBuf> = paths
        .filter(|path| text(path).contains("tfevents"))
        .collect();
    assert_eq!(files.len(), 1, "{files:?}");
    files.remove(0)
}

/// An event, decoded by the definition of protocol buffers rather than by the library that wrote it.
#[derive(Debug, Default)]
struct Event {
    wall_time: f64,
    step: u64,
    version: Option<String>,
    restarts: bool,
    scalars: BTreeMap<String, f32>,
}

/// Every record of a file, its checksums verified.
fn read_events(path: &Path) -> Vec<Event> {
    let bytes = fs::read(path).expect("an event file");
    let mut rest = bytes.as_slice();
    let mut events = Vec::new();
    while !rest.is_empty() {
        let (length, data) = rest.split_at(12);
        let size = u64::from_le_bytes(length[..8].try_into().expect("8")) as usize;
        assert_eq!(length[8..], masked(&length[..8]), "length of a record");
        assert_eq!(data[size..size + 4], masked(&data[..size]), "data of one");
        events.push(event(&data[..size]));
        rest = &data[size + 4..];
    }
    events
}

/// TFRecord's checksum: CRC-32C (RFC 3720), bit by bit, turned and shifted.
fn masked(bytes: &[u8]) -> [u8; 4] {
    let mut crc = u32::MAX;
    for byte in bytes {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ (0x82f6_3b78 * (crc & 1));
        }
    }
    let crc = !crc;
    crc.rotate_right(15).wrapping_add(0xa282_ead8).to_le_bytes()
}

/// A field of a message: its number, and the bits of a number or the bytes of what has a length.
struct Field<'a>(u64, u64, &'a [u8]);

fn varint(rest: &mut &[u8]) -> u64 {
    let (mut value, mut shift) = (0, 0);
    loop {
        let (byte, tail) = rest.split_first().expect("a byte");
        *rest = tail;
        value |= u64::from(byte & 0x7f) << shift;
        shift += 7;
        if byte & 0x80 == 0 {
            return value;
        }
    }
}

fn fields(mut rest: &[u8]) -> Vec<Field<'_>> {
    let mut fields = Vec::new();
    while !rest.is_empty() {
        let key = varint(&mut rest);
        let length = match key & 7 {
            0 => {
                fields.push(Field(key >> 3, varint(&mut rest), &[]));
                continue;
            }
            1 => 8,
            2 => varint(&mut rest) as usize,
            5 => 4,
            kind => panic!("wire type {kind}"),
        };
        let (data, tail) = rest.split_at(length);
        rest = tail;
        let mut bits = [0; 8];
        let fixed = length.min(8);
        bits[..fixed].copy_from_slice(&data[..fixed]);
        fields.push(Field(key >> 3, u64::from_le_bytes(bits), data));
    }
    fields
}

fn event(data: &[u8]) -> Event {
    let mut event = Event::default();
    let string = |data: &[u8]| String::from_utf8(data.to_vec()).expect("text");
    for Field(number, bits, data) in fields(data) {
        match number {
            1 => event.wall_time = f64::from_bits(bits),
            2 => event.step = bits,
            3 => event.version = Some(string(data)),
            5 => {
                for Field(_, _, value) in fields(data) {
                    let (mut tag, mut scalar) = (String::new(), f32::NAN);
                    for Field(number, bits, data) in fields(value) {
                        match number {
                            1 => tag = string(data),
                            2 => scalar = f32::from_bits(bits as u32),
                            _ => panic!("field {number} of a value"),
                        }
                    }
                    event.scalars.insert(tag, scalar);
                }
            }
            7 => {
                event.restarts = fields(data)
                    .iter()
                    .any(|field| (field.0, field.1) == (1, 1));
            }
            _ => panic!("field {number} of an event"),
        }
    }
    event
}
