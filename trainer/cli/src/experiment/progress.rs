//! How an experiment shows that it advances: which runs are under way, how far they are, and the time that is left.

use std::collections::BTreeMap;
use std::io::IsTerminal as _;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use crate::progress::duration;
use tpg_tasks::console::note;

/// Parts of the bar: fine enough for any width of terminal.
const PARTS: u64 = 1000;
/// How often the bar moves, and how soon the end is noticed.
const REDRAW: Duration = Duration::from_millis(200);
/// Where there is no terminal, a line says how far everything is, each time this long.
const LINE_EVERY: Duration = Duration::from_secs(30);
/// Runs that a line names.
const NAMED: usize = 3;

/// What is done, and what is under way.
#[derive(Debug)]
struct Known {
    /// Runs that are done, those from before this process included.
    done: usize,
    all: usize,
    /// Runs that this process has done, as a number of whole runs.
    here: f64,
    /// Names of runs under way here, each with the share of its budget when it began and now.
    running: BTreeMap<String, [f64; 2]>,
    began: Instant,
}

impl Known {
    /// Runs under way, as a number of whole runs: what is done of them, and what this process has done of that.
    fn under_way(&self) -> [f64; 2] {
        let runs = self.running.values();
        let sum = runs.fold([0.0, 0.0], |[all, here], [from, to]| {
            [all + to, here + (to - from)]
        });
        sum.map(|sum: f64| sum.max(0.0))
    }

    /// Share of all runs that is done, 0 to 1.
    fn share(&self) -> f64 {
        let [under_way, _] = self.under_way();
        ((self.done as f64 + under_way) / self.all.max(1) as f64).clamp(0.0, 1.0)
    }

    /// Seconds that are left at the pace of this process; NaN while nothing is known.
    fn left(&self, elapsed: Duration) -> f64 {
        let [under_way, here] = self.under_way();
        let left = self.all as f64 - self.done as f64 - under_way;
        let made = self.here + here;
        match made > 0.0 {
            true => (left * elapsed.as_secs_f64() / made).max(0.0),
            false => f64::NAN,
        }
    }

    fn line(&self, elapsed: Duration) -> String {
        let names: Vec<String> = (self.running.iter().take(NAMED))
            .map(|(name, [_, used])| format!("{name} {:.0} %", 100.0 * used.min(1.0)))
            .collect();
        let more = match self.running.len().saturating_sub(NAMED) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        format!(
            "{}/{} left {}: {}{more}",
            self.done,
            self.all,
            duration(self.left(elapsed)),
            names.join(", ")
        )
    }
}

/// Shows on standard error how an experiment advances. What cannot be written is dropped.
pub(super) struct Progress {
    known: Mutex<Known>,
    bar: Option<ProgressBar>,
    over: AtomicBool,
}

impl Progress {
    /// An experiment of so many runs, of which some are done already.
    pub(super) fn new(done: usize, all: usize) -> Self {
        let known = Known {
            done,
            all,
            here: 0.0,
            running: BTreeMap::new(),
            began: Instant::now(),
        };
        let bar = std::io::stderr().is_terminal().then(|| {
            let style = ProgressStyle::with_template("{bar:12} {percent:>3}% {wide_msg}");
            let bar = ProgressBar::new(PARTS);
            // The template is a constant; a faulty one would only lose the layout.
            bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
        });
        Progress {
            known: Mutex::new(known),
            bar,
            over: AtomicBool::new(false),
        }
    }

    fn known(&self) -> MutexGuard<'_, Known> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A run has used this share of its budget.
    pub(super) fn at(&self, name: &str, used: f64) {
        let mut known = self.known();
        let run = known.running.entry(name.to_owned()).or_insert([used; 2]);
        run[1] = used;
        drop(known);
        self.draw();
    }

    /// A run is no longer under way here; `true` if it is done. Returns how many are.
    pub(super) fn end(&self, name: &str, done: bool) -> usize {
        let mut known = self.known();
        let run = known.running.remove(name);
        if done {
            known.done += 1;
            known.here += run.map_or(1.0, |[from, _]| 1.0 - from.clamp(0.0, 1.0));
        }
        known.done
    }

    /// Prints a line, above the bar if there is one.
    pub(super) fn say(&self, line: impl std::fmt::Display) {
        match &self.bar {
            Some(bar) => bar.suspend(|| note(line)),
            None => note(line),
        }
    }

    /// Moves the bar, or says a line now and then, until [`finish`](Self::finish). Takes the thread that calls it.
    pub(super) fn tick(&self) {
        let mut last = Instant::now();
        while !self.over.load(Ordering::Relaxed) {
            thread::sleep(REDRAW);
            let line = self.draw();
            if self.bar.is_none() && last.elapsed() >= LINE_EVERY {
                last = Instant::now();
                line.into_iter().for_each(note);
            }
        }
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }

    /// Draws the bar, if there is one; what it says, if a run is under way.
    fn draw(&self) -> Option<String> {
        let known = self.known();
        let (share, elapsed) = (known.share(), known.began.elapsed());
        let line = (!known.running.is_empty()).then(|| known.line(elapsed));
        drop(known);
        if let (Some(bar), Some(line)) = (&self.bar, &line) {
            bar.set_position((share * PARTS as f64) as u64);
            bar.set_message(line.clone());
        }
        line
    }

    /// Ends [`tick`](Self::tick).
    pub(super) fn finish(&self) {
        self.over.store(true, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_that_is_left_is_that_of_the_runs_that_are_left() {
        let progress = Progress::new(2, 6);
        progress.at("a", 0.0);
        progress.at("a", 1.0);
        // A run that goes on from a checkpoint in its middle: only what is done here tells of the pace.
        progress.at("b", 0.5);
        assert_eq!(progress.end("a", true), 3);
        progress.at("b", 0.75);
        let known = progress.known();
        // 1.25 runs in 100 s; 2.25 are left.
        let elapsed = Duration::from_secs(100);
        assert!((known.left(elapsed) - 180.0).abs() < 1e-9, "{known:?}");
        assert!((known.share() - 3.75 / 6.0).abs() < 1e-9);
        assert_eq!(known.line(elapsed), "3/6 left 3m00s: b 75 %");
    }

    #[test]
    fn nothing_is_known_at_the_beginning_and_many_runs_are_counted() {
        let progress = Progress::new(0, 9);
        for name in ["a", "b", "c", "d", "e"] {
            progress.at(name, 0.0);
        }
        let line = progress.known().line(Duration::from_secs(5));
        assert_eq!(line, "0/9 left ?: a 0 %, b 0 %, c 0 % and 2 more");
    }
}
