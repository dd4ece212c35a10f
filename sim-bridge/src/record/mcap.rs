//! A recording as MCAP: one channel of JSON messages, with its schema.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;

use mcap::records::{MessageHeader, Metadata};
use mcap::{McapError, WriteOptions, Writer};
use serde_json::{Value, json};

use super::{Row, Source, Subject};

/// Name of the channel.
const TOPIC: &str = "/loop/step";
/// Name of the schema.
const SCHEMA: &str = "tpg.LoopStep";

pub(super) struct McapSink {
    writer: Writer<BufWriter<File>>,
    channel: u16,
    sequence: u32,
    finished: bool,
}

impl McapSink {
    /// Creates the file and writes schema, channel and what the recording is about.
    pub(super) fn create(path: &Path, subject: &Subject) -> io::Result<Self> {
        let file = BufWriter::new(File::create(path)?);
        let options = WriteOptions::new().library(concat!("tpg ", env!("CARGO_PKG_VERSION")));
        let mut writer = options.create(file).map_err(into_io)?;
        let schema = serde_json::to_vec(&schema(subject))?;
        let schema = writer.add_schema(SCHEMA, "jsonschema", &schema);
        let schema = schema.map_err(into_io)?;
        let notes: BTreeMap<String, String> = subject.notes.iter().cloned().collect();
        let channel = writer.add_channel(schema, TOPIC, "json", &notes);
        let channel = channel.map_err(into_io)?;
        let metadata = Metadata {
            name: "tpg".into(),
            metadata: notes,
        };
        writer.write_metadata(&metadata).map_err(into_io)?;
        Ok(McapSink {
            writer,
            channel,
            sequence: 0,
            finished: false,
        })
    }

    pub(super) fn write(
        &mut self,
        subject: &Subject,
        row: &Row,
        unix_ns: u64,
        observation: &[f32],
        action: &[f32],
    ) -> io::Result<()> {
        // A float that is not finite becomes null: JSON has no other word for it.
        let message = json!({
            "episode": row.episode,
            "step": row.step,
            "time_s": row.time_s(subject),
            "observation": observation,
            "mask": observation.iter().map(|value| value.is_finite()).collect::<Vec<_>>(),
            "action": action,
            "latency_us": row.latency_ns.map(|ns| ns as f64 / 1e3),
            "miss": row.source != Source::Answer,
            "link": row.source.name(),
            "instructions": row.instructions,
        });
        let header = MessageHeader {
            channel_id: self.channel,
            sequence: self.sequence,
            log_time: unix_ns,
            publish_time: unix_ns,
        };
        self.sequence = self.sequence.wrapping_add(1);
        let message = serde_json::to_vec(&message)?;
        let written = self.writer.write_to_known_channel(&header, &message);
        written.map_err(into_io)
    }

    pub(super) fn finish(&mut self) -> io::Result<()> {
        if !self.finished {
            self.finished = true;
            self.writer.finish().map_err(into_io)?;
        }
        Ok(())
    }
}

fn into_io(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        error => io::Error::other(error),
    }
}

/// The JSON schema of a message.
fn schema(subject: &Subject) -> Value {
    let channels = |channels: &[(String, String)]| {
        let text = |(name, unit): &(String, String)| format!("{name} [{unit}]");
        channels.iter().map(text).collect::<Vec<_>>().join(", ")
    };
    let (inputs, outputs) = (channels(&subject.inputs), channels(&subject.outputs));
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": SCHEMA,
        "description": "One control step of a policy in the loop.",
        "type": "object",
        "properties": {
            "episode": {"type": "integer", "description": "Number of the episode, from 0."},
            "step": {"type": "integer", "description": "Number of the step in its episode, from 0."},
            "time_s": {"type": "number", "description": "Simulated time since the episode began, in seconds."},
            "observation": {
                "type": "array",
                "items": {"type": ["number", "null"]},
                "description": format!("What the controller was sent; null is missing. In this order: {inputs}."),
            },
            "mask": {
                "type": "array",
                "items": {"type": "boolean"},
                "description": "Whether the element of the observation was there.",
            },
            "action": {
                "type": "array",
                "items": {"type": "number"},
                "description": format!("What the plant was told, before disturbances of actions: {outputs}."),
            },
            "latency_us": {
                "type": ["number", "null"],
                "description": "From the observation sent to the action received, in microseconds; null on a miss.",
            },
            "miss": {"type": "boolean", "description": "Whether no answer came in time."},
            "link": {"enum": ["answer", "held", "safe"], "description": "Where the action comes from."},
            "instructions": {"type": "integer", "description": "Instructions of the policy for this decision."},
        },
        "required": [
            "episode", "step", "time_s", "observation", "mask", "action", "latency_us", "miss", "link", "instructions",
        ],
    })
}
