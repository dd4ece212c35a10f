//! What a requirement can be about: the table of names.

use super::Facts;

/// How a quantity is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimension {
    /// A return, a number of steps, a count.
    Number,
    /// A time, in nanoseconds.
    Time,
    /// A part of a whole, 0 to 1.
    Share,
}

/// Units of time, and how many nanoseconds each has. `s` comes last, since the others end in it.
const TIMES: [(&str, f64); 4] = [("ns", 1.0), ("us", 1e3), ("ms", 1e6), ("s", 1e9)];

impl Dimension {
    const fn name(self) -> &'static str {
        match self {
            Dimension::Number => "number",
            Dimension::Time => "time",
            Dimension::Share => "share",
        }
    }

    /// What a bound has to look like.
    pub(super) const fn advice(self) -> &'static str {
        match self {
            Dimension::Number => " without a unit",
            Dimension::Time => " with ns, us, ms or s behind it",
            Dimension::Share => " from 0 to 1 as a share, or with % behind it",
        }
    }

    /// Reads a bound.
    pub(super) fn parse(self, text: &str) -> Option<f64> {
        let (number, factor) = match self {
            Dimension::Number => (text, 1.0),
            Dimension::Time => TIMES
                .iter()
                .find_map(|(unit, factor)| text.strip_suffix(unit).map(|rest| (rest, *factor)))?,
            Dimension::Share => match text.strip_suffix('%') {
                Some(rest) => (rest, 0.01),
                None => (text, 1.0),
            },
        };
        let number: f64 = number.trim_end().parse().ok()?;
        number.is_finite().then_some(number * factor)
    }

    /// A value with its unit.
    pub(super) fn show(self, value: f64) -> String {
        match self {
            _ if value.is_nan() => "not known".into(),
            Dimension::Number => value.to_string(),
            Dimension::Time => {
                let fits = |(_, factor): &&(&str, f64)| value >= *factor;
                let (unit, factor) = TIMES.iter().rev().find(fits).unwrap_or(&TIMES[0]);
                format!("{:.3} {unit}", value / factor)
            }
            Dimension::Share => format!("{:.4}%", value * 100.0),
        }
    }
}

/// What a loop must be for a quantity to exist.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Needs {
    /// Any loop has it.
    Nothing,
    /// A loop in real time.
    RealTime,
    /// A loop with a board.
    Line,
}

/// A quantity that requirements name.
#[derive(Debug)]
pub struct Quantity {
    pub(super) name: &'static str,
    pub(super) dimension: Dimension,
    pub(super) needs: Needs,
    pub(super) of: fn(&Facts<'_>) -> Option<f64>,
}

/// The names with how they are measured, for messages.
pub(super) fn list() -> String {
    let name = |quantity: &Quantity| format!("{} ({})", quantity.name, quantity.dimension.name());
    QUANTITIES.iter().map(name).collect::<Vec<_>>().join(", ")
}

macro_rules! quantities {
    ($($name:literal $dimension:ident $needs:ident $of:expr;)*) => {
        /// Every quantity. docs/bench.md says what they mean; a test compares.
        pub(super) const QUANTITIES: &[Quantity] = &[$(Quantity {
            name: $name,
            dimension: Dimension::$dimension,
            needs: Needs::$needs,
            of: $of,
        },)*];
    };
}

quantities! {
    "mean"        Number Nothing  |f| Some(f.report.mean);
    "ci-low"      Number Nothing  |f| Some(f.report.mean_ci95[0]);
    "ci-high"     Number Nothing  |f| Some(f.report.mean_ci95[1]);
    "sd"          Number Nothing  |f| Some(f.report.sd);
    "min"         Number Nothing  |f| f.report.returns.iter().copied().reduce(f64::min);
    "max"         Number Nothing  |f| f.report.returns.iter().copied().reduce(f64::max);
    "episodes"    Number Nothing  |f| Some(f.report.returns.len() as f64);
    "steps-min"   Number Nothing  |f| f.report.lengths.iter().min().map(|n| f64::from(*n));
    "unstable"    Number Nothing  |f| Some(f.report.unstable as f64);
    "p50"         Time   Nothing  |f| Some(f.latency.median_ns as f64);
    "p99"         Time   Nothing  |f| Some(f.latency.p99_ns as f64);
    "p99.9"       Time   Nothing  |f| Some(f.latency.p999_ns as f64);
    "latency-max" Time   Nothing  |f| Some(f.latency.max_ns as f64);
    "misses"      Number RealTime |f| Some(f.timing?.counts.misses as f64);
    "miss-rate"   Share  RealTime |f| f.timing.map(|t| t.counts.misses as f64 / t.counts.periods as f64);
    "misses-in-row" Number RealTime |f| Some(f.timing?.counts.longest_run as f64);
    "safe-steps"  Number RealTime |f| Some(f.timing?.counts.safe as f64);
    "overruns"    Number RealTime |f| Some(f.timing?.counts.overruns as f64);
    "late"        Number RealTime |f| Some(f.timing?.late_answers as f64);
    "jitter-p50"  Time   RealTime |f| Some(f.timing?.jitter_median_us * 1e3);
    "jitter-p99"  Time   RealTime |f| Some(f.timing?.jitter_p99_us * 1e3);
    "jitter-max"  Time   RealTime |f| Some(f.timing?.jitter_max_us * 1e3);
    "resent"      Number Line     |f| Some(f.losses?.resent as f64);
    "damaged"     Number Line     |f| Some(f.losses?.damaged_here as f64);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_document_lists_every_quantity() {
        let document = include_str!("../../../docs/bench.md");
        for quantity in QUANTITIES {
            let row = format!("| `{}` | {} |", quantity.name, quantity.dimension.name());
            assert!(document.contains(&row), "docs/bench.md has no row {row}");
        }
        let rows = document.lines().filter(|line| {
            ["| number |", "| time |", "| share |"]
                .iter()
                .any(|kind| line.contains(kind))
        });
        assert_eq!(rows.count(), QUANTITIES.len());
    }

    #[test]
    fn values_are_shown_with_a_fitting_unit() {
        assert_eq!(Dimension::Time.show(999.0), "999.000 ns");
        assert_eq!(Dimension::Time.show(2_500_000.0), "2.500 ms");
        assert_eq!(Dimension::Share.show(0.001), "0.1000%");
        assert_eq!(Dimension::Number.show(f64::NAN), "not known");
    }
}
