//! How long things took: round trips, and in real time the periods.

use std::fmt::{self, Write as _};
use std::time::Duration;

use hdrhistogram::Histogram;

use crate::error::BridgeError;

/// Longest time that the histograms tell from longer ones, in nanoseconds.
const LONGEST_NS: u64 = 3_600_000_000_000;

/// A histogram of times; its bounds are fixed, so that recording never allocates.
pub(crate) fn histogram_ns() -> Result<Histogram<u64>, BridgeError> {
    Histogram::new_with_bounds(1, LONGEST_NS, 3)
        .map_err(BridgeError::transport("prepare a histogram"))
}

pub(crate) fn nanoseconds(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
}

/// The distribution as text, times in microseconds: the columns that `HistogramLogProcessor` and the plotters for
/// HdrHistogram's percentile files take.
pub(crate) fn percentiles_us(histogram_ns: &Histogram<u64>) -> String {
    const US: f64 = 1e3;
    let mut text = String::from("       Value     Percentile TotalCount 1/(1-Percentile)\n\n");
    let mut count = 0;
    for value in histogram_ns.iter_quantiles(5) {
        let quantile = value.quantile_iterated_to();
        let us = value.value_iterated_to() as f64 / US;
        count += value.count_since_last_iteration();
        let _ = write!(text, "{us:12.3} {quantile:14.12} {count:10}");
        // The last line has no such column: it would be infinite.
        let _ = match quantile < 1.0 {
            true => writeln!(text, " {:14.2}", 1.0 / (1.0 - quantile)),
            false => writeln!(text),
        };
    }
    let (mean, sd) = (histogram_ns.mean() / US, histogram_ns.stdev() / US);
    let (max, count) = (histogram_ns.max() as f64 / US, histogram_ns.len());
    let _ = writeln!(text, "#[Mean    = {mean:12.3}, StdDeviation   = {sd:12.3}]");
    let _ = writeln!(text, "#[Max     = {max:12.3}, Total count    = {count:12}]");
    text
}

/// How long round trips took: observation sent to action received, in nanoseconds, to three digits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Latency {
    /// Number of decisions.
    pub count: u64,
    /// Median, in nanoseconds.
    pub median_ns: u64,
    /// 99th percentile, in nanoseconds.
    pub p99_ns: u64,
    /// 99.9th percentile, in nanoseconds.
    pub p999_ns: u64,
    /// The longest, in nanoseconds.
    pub max_ns: u64,
}

impl Latency {
    pub(crate) fn new(round_trips_ns: &Histogram<u64>) -> Self {
        Latency {
            count: round_trips_ns.len(),
            median_ns: round_trips_ns.value_at_quantile(0.5),
            p99_ns: round_trips_ns.value_at_quantile(0.99),
            p999_ns: round_trips_ns.value_at_quantile(0.999),
            max_ns: round_trips_ns.max(),
        }
    }

    /// The form that stands in `--json`.
    #[must_use]
    pub fn to_json(self) -> serde_json::Value {
        serde_json::json!({
            "unit": "ns",
            "count": self.count,
            "median": self.median_ns,
            "p99": self.p99_ns,
            "p999": self.p999_ns,
            "max": self.max_ns,
        })
    }
}

impl fmt::Display for Latency {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [median, p99, max] =
            [self.median_ns, self.p99_ns, self.max_ns].map(|ns| ns as f64 / 1e3);
        write!(
            f,
            "round trip     median {median:.1} us, p99 {p99:.1} us, max {max:.1} us"
        )
    }
}

/// How a loop kept to real time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timing {
    /// The control period, in microseconds.
    pub period_us: u32,
    /// Median of the jitter: how far the time from one action to the next was from the period, in microseconds.
    pub jitter_median_us: f64,
    /// 99th percentile of the jitter, in microseconds.
    pub jitter_p99_us: f64,
    /// The greatest jitter, in microseconds.
    pub jitter_max_us: f64,
    /// What was counted.
    pub counts: Counts,
    /// Answers that came too late and were dropped.
    pub late_answers: u64,
}

/// What is counted in real time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Control periods, one for each step.
    pub periods: u64,
    /// Periods without an answer in time.
    pub misses: u64,
    /// Most misses in a row.
    pub longest_run: u64,
    /// Steps that repeated the last action.
    pub held: u64,
    /// Steps that took the safe action.
    pub safe: u64,
    /// Rows of misses that had led to the safe action and that an answer ended.
    pub recoveries: u64,
    /// Periods that were over before the plant had an observation to send.
    pub overruns: u64,
}

impl Timing {
    pub(crate) fn new(
        period_us: u32,
        jitter_ns: &Histogram<u64>,
        counts: Counts,
        late_answers: u64,
    ) -> Self {
        let us = |ns: u64| ns as f64 / 1e3;
        Timing {
            period_us,
            jitter_median_us: us(jitter_ns.value_at_quantile(0.5)),
            jitter_p99_us: us(jitter_ns.value_at_quantile(0.99)),
            jitter_max_us: us(jitter_ns.max()),
            counts,
            late_answers,
        }
    }

    /// The form that stands in `--json`.
    #[must_use]
    pub fn to_json(self) -> serde_json::Value {
        let counts = self.counts;
        serde_json::json!({
            "period_us": self.period_us,
            "periods": counts.periods,
            "jitter_us": {
                "median": self.jitter_median_us,
                "p99": self.jitter_p99_us,
                "max": self.jitter_max_us,
            },
            "misses": counts.misses,
            "longest_run_of_misses": counts.longest_run,
            "held_steps": counts.held,
            "safe_steps": counts.safe,
            "recoveries": counts.recoveries,
            "late_answers": self.late_answers,
            "overruns": counts.overruns,
        })
    }
}

impl fmt::Display for Timing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Counts {
            periods,
            misses,
            longest_run,
            held,
            safe,
            recoveries,
            overruns,
        } = self.counts;
        writeln!(
            f,
            "real time      {periods} periods of {} us, {overruns} begun too late by the plant",
            self.period_us
        )?;
        writeln!(
            f,
            "jitter         median {:.1} us, p99 {:.1} us, max {:.1} us",
            self.jitter_median_us, self.jitter_p99_us, self.jitter_max_us
        )?;
        write!(
            f,
            "misses         {misses}, at most {longest_run} in a row; {held} steps on the held action, {safe} on the \
             safe one; {recoveries} recoveries; {} late answers dropped",
            self.late_answers
        )
    }
}
