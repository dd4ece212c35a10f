//! How training shows that it advances: a bar on a terminal, a line for each generation elsewhere.

use std::io::IsTerminal as _;

use indicatif::{ProgressBar, ProgressStyle};

use tpg_tasks::console::note;
use tpg_trainer::session::{Budget, GenerationReport, Session};

/// Parts of the bar: fine enough for any width of terminal.
const PARTS: u64 = 1000;

/// Shows generations as they complete, on standard error.
pub(crate) struct Progress {
    budget: Budget,
    bar: Option<ProgressBar>,
    steps: u64,
    seconds: f64,
}

impl Progress {
    pub(crate) fn new(budget: Budget, session: &Session) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let style = ProgressStyle::with_template("{bar:30} {percent:>3} %  {msg}");
            let bar = ProgressBar::new(PARTS);
            // The template is a constant; a faulty one would only lose the layout.
            bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
        });
        Progress {
            budget,
            bar,
            steps: session.steps(),
            seconds: session.seconds(),
        }
    }

    pub(crate) fn show(&mut self, session: &Session, report: &GenerationReport) {
        let used = self.budget.used(session).min(1.0);
        let elapsed = report.seconds - self.seconds;
        let rate = (report.steps - self.steps) as f64 / elapsed.max(1e-9);
        (self.steps, self.seconds) = (report.steps, report.seconds);
        let left = if used > 0.0 {
            report.seconds * (1.0 - used) / used
        } else {
            f64::NAN
        };
        let text = format!(
            "generation {:>4}  best {:>9.2}  mean {:>9.2}  {:>6.0} steps/s  {:>4.0} s left",
            report.generation, report.best, report.mean, rate, left
        );
        match &self.bar {
            Some(bar) => {
                bar.set_position((used * PARTS as f64) as u64);
                bar.set_message(text);
            }
            None => note(text),
        }
    }

    pub(crate) fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.abandon();
        }
    }
}
