//! How training shows that it advances: a bar on a terminal, lines elsewhere. Both move within a generation too.

use std::io::IsTerminal as _;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use tpg_tasks::console::note;
use tpg_trainer::monitor::{Monitor, Progress as Scored};
use tpg_trainer::session::{Budget, GenerationReport, Session};

/// Parts of the bar: fine enough for any width of terminal.
const PARTS: u64 = 1000;
/// How often the bar moves.
const REDRAW: Duration = Duration::from_millis(200);
/// A generation that lasts longer says so in a line of its own, each time this long, where there is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// What is known between two generations.
#[derive(Debug, Clone, Copy)]
struct Known {
    generation: u64,
    best: f64,
    steps: u64,
    seconds: f64,
    /// When the generation that is under way began, and what had been scored by then.
    since: Instant,
    scored: u64,
    /// Seconds of the last generation.
    last: Option<f64>,
}

/// Shows how training advances, on standard error, from a thread of its own. What cannot be written is dropped.
pub(crate) struct Progress {
    known: Arc<Mutex<Known>>,
    monitor: Arc<Monitor>,
    bar: Option<ProgressBar>,
    ticker: Option<(Sender<()>, JoinHandle<()>)>,
}

impl Progress {
    pub(crate) fn new(budget: Budget, session: &Session, monitor: Arc<Monitor>) -> Self {
        let known = Arc::new(Mutex::new(Known {
            generation: session.generation(),
            best: session.champion().map_or(f64::NAN, |(_, r)| r.score),
            steps: session.steps(),
            seconds: session.seconds(),
            since: Instant::now(),
            scored: 0,
            last: None,
        }));
        let bar = std::io::stderr().is_terminal().then(|| {
            // The message is cut to what is left of the line.
            let style = ProgressStyle::with_template("{bar:12} {percent:>3}% {wide_msg}");
            let bar = ProgressBar::new(PARTS);
            // The template is a constant; a faulty one would only lose the layout.
            bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
        });
        let (ended, over) = channel();
        let shown = (known.clone(), monitor.clone(), bar.clone());
        let ticker = std::thread::spawn(move || {
            let (known, monitor, bar) = shown;
            let mut line = Instant::now();
            while over.recv_timeout(REDRAW) == Err(RecvTimeoutError::Timeout) {
                let known = *known.lock().unwrap_or_else(PoisonError::into_inner);
                let view = View::new(budget, known, monitor.progress());
                if let Some(bar) = &bar {
                    bar.set_position((view.used * PARTS as f64) as u64);
                    bar.set_message(view.short());
                } else if known.since.elapsed() >= LINE_EVERY && line.elapsed() >= LINE_EVERY {
                    line = Instant::now();
                    note(view.long());
                }
            }
        });
        Progress {
            known,
            monitor,
            bar,
            ticker: Some((ended, ticker)),
        }
    }

    /// Tells of a generation that is complete.
    pub(crate) fn show(&self, report: &GenerationReport) {
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let elapsed = report.seconds - known.seconds;
        let rate = (report.steps - known.steps) as f64 / elapsed.max(1e-9);
        *known = Known {
            generation: report.generation,
            best: report.best,
            steps: report.steps,
            seconds: report.seconds,
            since: Instant::now(),
            scored: self.monitor.progress().steps,
            last: Some(elapsed),
        };
        drop(known);
        if self.bar.is_none() {
            note(format_args!(
                "generation {:>4}  best {:>9.2}  mean {:>9.2}  {:>7.0} steps/s  {:>6.1} s",
                report.generation, report.best, report.mean, rate, elapsed
            ));
        }
    }

    pub(crate) fn finish(&mut self) {
        if let Some((ended, ticker)) = self.ticker.take() {
            drop(ended);
            // A thread that shows progress has nothing to return.
            let _ = ticker.join();
        }
        if let Some(bar) = &self.bar {
            bar.abandon();
        }
    }
}

/// What there is to show at one moment.
struct View {
    known: Known,
    scored: Scored,
    /// Share of the run's budget that is used, 0 to 1.
    used: f64,
    /// Control steps a second, in this generation.
    rate: f64,
    /// Seconds that are left of the generation, and of the run; NaN while nothing is known.
    left: [f64; 2],
}

impl View {
    fn new(budget: Budget, known: Known, scored: Scored) -> Self {
        let elapsed = known.since.elapsed().as_secs_f64();
        let steps = scored.steps.saturating_sub(known.scored) as f64;
        let rate = steps / elapsed.max(1e-9);
        let done = scored.episodes as f64 / scored.planned.max(1) as f64;
        let whole = if done > 0.0 {
            elapsed / done
        } else {
            known.last.unwrap_or(f64::NAN)
        };
        let whole_step = rate.max(1e-9).recip();
        let (used, run) = match budget {
            Budget::Generations(n) => {
                let made = known.generation as f64 + done.min(1.0);
                (made / n as f64, (n as f64 - made) * whole)
            }
            Budget::Steps(n) => {
                let made = known.steps as f64 + steps;
                (made / n as f64, (n as f64 - made) * whole_step)
            }
            Budget::Minutes(minutes) => {
                let spent = known.seconds + elapsed;
                (spent / (60.0 * minutes), 60.0 * minutes - spent)
            }
        };
        View {
            known,
            scored,
            used: used.clamp(0.0, 1.0),
            rate,
            left: [(whole - elapsed).max(0.0), run.max(0.0)],
        }
    }

    /// For a line of 80 columns.
    fn short(&self) -> String {
        let [generation, run] = self.left.map(duration);
        format!(
            "gen {} {}/{} {} st/s left {generation}/{run} best {:.1}",
            self.known.generation + 1,
            self.scored.episodes,
            self.scored.planned,
            rate(self.rate),
            self.known.best
        )
    }

    fn long(&self) -> String {
        let [generation, run] = self.left.map(duration);
        format!(
            "generation {:>4}: {} of {} episodes, {:.0} steps/s, {generation} left, {run} of the run",
            self.known.generation + 1,
            self.scored.episodes,
            self.scored.planned,
            self.rate
        )
    }
}

/// `950`, `12.3k`, `1.2M`.
fn rate(rate: f64) -> String {
    match rate {
        r if r >= 1e6 => format!("{:.1}M", r / 1e6),
        r if r >= 1e3 => format!("{:.1}k", r / 1e3),
        r => format!("{r:.0}"),
    }
}

/// `41s`, `3m20s`, `2h05m`; `?` for what is not known.
pub(crate) fn duration(seconds: f64) -> String {
    if !seconds.is_finite() {
        return "?".to_owned();
    }
    let seconds = seconds.round() as u64;
    match (seconds / 3600, seconds / 60 % 60, seconds % 60) {
        (0, 0, s) => format!("{s}s"),
        (0, m, s) => format!("{m}m{s:02}s"),
        (h, m, _) => format!("{h}h{m:02}m"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(budget: Budget, episodes: u64) -> View {
        let known = Known {
            generation: 12_345,
            best: -12_345.67,
            steps: 1_000,
            seconds: 60.0,
            since: Instant::now() - Duration::from_secs(100),
            scored: 0,
            last: None,
        };
        let scored = Scored {
            planned: 100_000,
            episodes,
            steps: 900_000,
        };
        View::new(budget, known, scored)
    }

    #[test]
    fn a_quarter_of_a_generation_leaves_three_times_its_time() {
        let view = view(Budget::Generations(12_346), 25_000);
        assert!((view.left[0] - 300.0).abs() < 2.0 && (view.left[1] - 300.0).abs() < 2.0);
        assert!(view.used < 1.0);
    }

    #[test]
    fn the_bar_fits_eighty_columns() {
        let view = view(Budget::Minutes(6_000.0), 99_999);
        // The bar itself, the share and two blanks.
        assert!(
            12 + 1 + 4 + 1 + view.short().len() <= 80,
            "{}",
            view.short()
        );
        assert!(view.long().contains("99999 of 100000 episodes"));
    }

    #[test]
    fn durations_name_two_units_at_most() {
        let texts = [0.4, 59.0, 200.0, 7_500.0, f64::NAN].map(duration);
        assert_eq!(texts, ["0s", "59s", "3m20s", "2h05m", "?"]);
    }
}
