//! Event files for TensorBoard: records of protocol buffers, each with checksums.
//!
//! The messages are those of TensorFlow's `event.proto` and `summary.proto`, with the fields that scalars need.

use std::fs::File;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process;
use std::time::{SystemTime, UNIX_EPOCH};

use crc::{CRC_32_ISCSI, Crc, Table};
use prost::Message;

use crate::session::GenerationReport;

/// The version of the format, as the first record of a file names it.
const VERSION: &str = "brain.Event:2";
/// A session log that says: what older files hold from this step on is made again.
const START: i32 = 1;

#[derive(Clone, PartialEq, Message)]
struct Event {
    #[prost(double, tag = "1")]
    wall_time: f64,
    #[prost(int64, tag = "2")]
    step: i64,
    #[prost(string, optional, tag = "3")]
    file_version: Option<String>,
    #[prost(message, optional, tag = "5")]
    summary: Option<Summary>,
    #[prost(message, optional, tag = "7")]
    session_log: Option<SessionLog>,
}

#[derive(Clone, PartialEq, Message)]
struct Summary {
    #[prost(message, repeated, tag = "1")]
    values: Vec<Value>,
}

#[derive(Clone, PartialEq, Message)]
struct Value {
    #[prost(string, tag = "1")]
    tag: String,
    #[prost(float, optional, tag = "2")]
    simple_value: Option<f32>,
}

#[derive(Clone, PartialEq, Message)]
struct SessionLog {
    #[prost(int32, tag = "1")]
    status: i32,
}

/// An event file that grows with a run.
#[derive(Debug)]
pub struct EventFile {
    path: PathBuf,
    file: File,
}

impl EventFile {
    /// A new file in a run's folder, for a run that goes on after so many environment steps. Files of the same run before it
    /// stay, and TensorBoard drops what they hold beyond these steps.
    ///
    /// # Errors
    /// What the system says if the file cannot be made or written.
    pub fn create(folder: &Path, steps: u64) -> io::Result<Self> {
        let host = gethostname::gethostname();
        let seconds = now() as u64;
        let name = format!(
            "events.out.tfevents.{seconds}.{}.{}",
            host.to_string_lossy(),
            process::id()
        );
        let path = folder.join(name);
        let mut file = EventFile {
            file: File::create(&path)?,
            path,
        };
        file.write(Event {
            file_version: Some(VERSION.into()),
            ..Event::default()
        })?;
        file.write(Event {
            step: steps as i64 + 1,
            session_log: Some(SessionLog { status: START }),
            ..Event::default()
        })?;
        Ok(file)
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Adds a generation's scalars, at its number of environment steps. What is not finite is left out.
    ///
    /// # Errors
    /// What the system says if they cannot be written.
    pub fn add(&mut self, report: &GenerationReport) -> io::Result<()> {
        let scalars = [
            ("rollout/ep_rew_mean", report.best),
            ("eval/mean_reward", report.select.unwrap_or(f64::NAN)),
            ("population/mean", report.mean),
            ("population/teams", report.teams as f64),
            ("population/programs", report.programs as f64),
            ("champion/instructions_mean", report.instructions_mean),
            ("time/fps", report.steps as f64 / report.seconds),
        ];
        let scalars = scalars.into_iter().filter(|(_, value)| value.is_finite());
        let values = scalars.map(|(tag, value)| Value {
            tag: tag.into(),
            simple_value: Some(value as f32),
        });
        self.write(Event {
            step: report.steps as i64,
            summary: Some(Summary {
                values: values.collect(),
            }),
            ..Event::default()
        })
    }

    /// Writes a record at once, so that a page that is open sees it.
    fn write(&mut self, event: Event) -> io::Result<()> {
        let event = Event {
            wall_time: now(),
            ..event
        };
        self.file.write_all(&record(&event.encode_to_vec()))
    }
}

/// Seconds since 1970.
fn now() -> f64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.unwrap_or_default().as_secs_f64()
}

/// Data as TFRecord frames them: length, checksum of the length, data, checksum of the data.
fn record(data: &[u8]) -> Vec<u8> {
    let length = (data.len() as u64).to_le_bytes();
    let check = |bytes| masked_crc(bytes).to_le_bytes();
    [&length[..], &check(&length), data, &check(data)].concat()
}

/// The CRC-32C of bytes, turned and shifted, since a checksum of data that hold checksums would be weak.
fn masked_crc(bytes: &[u8]) -> u32 {
    const CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISCSI);
    let crc = CRC.checksum(bytes);
    crc.rotate_right(15).wrapping_add(0xa282_ead8)
}
