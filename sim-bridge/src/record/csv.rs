//! A recording as CSV.

use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;

use csv::{Writer, WriterBuilder};

use super::{Row, Source, Subject};

/// Columns before those of the channels.
const COLUMNS: [&str; 9] = [
    "episode",
    "step",
    "time_s",
    "sent_unix_ns",
    "latency_us",
    "miss",
    "link",
    "instructions",
    "mask",
];

pub(super) struct CsvSink {
    writer: Writer<BufWriter<File>>,
}

impl CsvSink {
    /// Creates the file and writes the line with the names.
    pub(super) fn create(path: &Path, subject: &Subject) -> io::Result<Self> {
        let file = BufWriter::new(File::create(path)?);
        let mut writer = WriterBuilder::new().from_writer(file);
        let channels = |prefix: &'static str, channels: &[(String, String)]| -> Vec<String> {
            let names = channels.iter().map(|(name, _)| name);
            names.map(|name| format!("{prefix}.{name}")).collect()
        };
        let inputs = channels("observation", &subject.inputs);
        let outputs = channels("action", &subject.outputs);
        let columns = COLUMNS.iter().map(|name| (*name).to_owned());
        writer.write_record(columns.chain(inputs).chain(outputs))?;
        writer.flush()?;
        Ok(CsvSink { writer })
    }

    pub(super) fn write(
        &mut self,
        subject: &Subject,
        row: &Row,
        unix_ns: u64,
        observation: &[f32],
        action: &[f32],
    ) -> io::Result<()> {
        let miss = row.source != Source::Answer;
        let latency = row.latency_ns.map(|ns| ns as f64 / 1e3);
        let mask: String = (observation.iter())
            .map(|value| if value.is_finite() { '1' } else { '0' })
            .collect();
        let cells = [
            row.episode.to_string(),
            row.step.to_string(),
            row.time_s(subject).to_string(),
            unix_ns.to_string(),
            latency.map_or_else(String::new, |us| us.to_string()),
            u8::from(miss).to_string(),
            row.source.name().to_owned(),
            row.instructions.to_string(),
            mask,
        ];
        // A missing element is an empty cell.
        let values = observation.iter().chain(action).map(|value| {
            if value.is_finite() {
                value.to_string()
            } else {
                String::new()
            }
        });
        self.writer.write_record(cells.into_iter().chain(values))?;
        Ok(())
    }

    pub(super) fn finish(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}
