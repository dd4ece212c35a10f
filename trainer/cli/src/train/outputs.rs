//! What training says to other programs: lines of JSON, and event files for TensorBoard.

use std::path::PathBuf;

use serde::Serialize;

use tpg_tasks::console::{note, print_json};
use tpg_tasks::exit_status::{Failure, Fault as _, Status};
use tpg_trainer::run_folder::RunFolder;
use tpg_trainer::session::{GenerationReport, Session};
use tpg_trainer::tensorboard::EventFile;

use crate::version::VERSION;

/// A line of `--json`; the fields are its keys.
#[derive(Debug, Serialize)]
#[serde(tag = "event", rename_all = "lowercase")]
enum Line<'a> {
    Begin {
        version: &'a str,
        folder: PathBuf,
        task: &'a str,
        seed: u64,
        threads: usize,
        /// Complete already, of a run that goes on.
        generation: u64,
        steps: u64,
    },
    Generation(&'a GenerationReport),
    End {
        interrupted: bool,
        generation: u64,
        steps: u64,
        seconds: f64,
        /// None before the first generation is complete.
        champion: Option<PathBuf>,
        best: Option<f64>,
    },
}

/// Who else is told of a run.
pub(super) struct Outputs {
    json: bool,
    events: Option<EventFile>,
}

impl Outputs {
    /// Begins what is asked for.
    pub(super) fn begin(
        json: bool,
        tensorboard: bool,
        session: &Session,
        folder: &RunFolder,
        threads: usize,
    ) -> Result<Self, Failure> {
        let events = tensorboard.then(|| EventFile::create(folder.path(), session.steps()));
        let events = events.transpose().or_unwritable(folder.path())?;
        let mut outputs = Outputs { json, events };
        outputs.line(&Line::Begin {
            version: VERSION,
            folder: folder.path().to_owned(),
            task: &session.config().task,
            seed: session.seed(),
            threads,
            generation: session.generation(),
            steps: session.steps(),
        })?;
        Ok(outputs)
    }

    /// Tells of a generation.
    pub(super) fn generation(&mut self, report: &GenerationReport) -> Result<(), Failure> {
        if let Some(events) = &mut self.events {
            let added = events.add(report);
            added.or_unwritable(events.path())?;
        }
        self.line(&Line::Generation(report))
    }

    /// Tells how the run ended.
    pub(super) fn end(
        &mut self,
        session: &Session,
        folder: &RunFolder,
        interrupted: bool,
    ) -> Result<(), Failure> {
        let champion = session.champion();
        self.line(&Line::End {
            interrupted,
            generation: session.generation(),
            steps: session.steps(),
            seconds: session.seconds(),
            champion: champion.map(|_| folder.champion()),
            best: champion.map(|(_, record)| record.score),
        })
    }

    /// Prints a line. A reader that goes away ends the lines, not the run.
    fn line(&mut self, line: &Line<'_>) -> Result<(), Failure> {
        if !self.json {
            return Ok(());
        }
        match print_json(line) {
            Err(failure) if failure.status == Status::Fine => {
                note("nobody reads standard output any more; the run goes on without it");
                self.json = false;
                Ok(())
            }
            printed => printed,
        }
    }
}
