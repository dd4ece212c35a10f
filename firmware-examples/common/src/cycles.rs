//! How long decisions take over recorded observations, and whether that is in time: for the program `cycles`.

use core::fmt;

use tpg_runtime::{Agent, Policy, Reset, Storage, Width};

use crate::pack::SEED;
use crate::trial::MAX_OBSERVATION;

/// Least, mean and most of what decisions took, in the counter's unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Spread {
    /// The number of decisions.
    pub decisions: u32,
    /// Of the shortest decision.
    pub least: u32,
    /// Of the longest decision.
    pub most: u32,
    sum: u64,
}

impl Spread {
    /// The mean over all decisions, rounded down.
    #[must_use]
    pub const fn mean(&self) -> u64 {
        match self.sum.checked_div(self.decisions as u64) {
            Some(mean) => mean,
            None => 0,
        }
    }
}

/// This line of the recorded observations holds something else, or another number of values than the policy has inputs.
/// Lines count from 1; 0 if there is no observation at all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecordedError(pub usize);

impl fmt::Display for RecordedError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "line {} of the recorded observations does not fit the policy: record them again, see README.md",
            self.0
        )
    }
}

impl core::error::Error for RecordedError {}

/// Reads a line of recorded observations. `None` if it holds something else, or another number of values.
#[must_use]
pub fn observation_of(line: &str, observation: &mut [f32]) -> Option<()> {
    let mut words = line.split(' ');
    for value in observation {
        let bits = u32::from_str_radix(words.next()?, 16).ok()?;
        *value = f32::from_bits(bits);
    }
    words.next().is_none().then_some(())
}

/// Decides for each recorded observation. `now` reads a counter that wraps at 2^32. What reading it takes is subtracted.
///
/// A line has the eight hexadecimal digits of each value. An empty line ends an episode: the agent is reset. This is what
/// `tpg replay FILE.trace FILE.tpg --observations OUT` writes.
///
/// # Errors
/// [`RecordedError`] of the first line that does not fit.
pub fn replay<W: Width, S: Storage>(
    agent: &mut Agent<'_, W, S>,
    recorded: &str,
    now: impl Fn() -> u32,
) -> Result<Spread, RecordedError> {
    let mut buffer = [0.0; MAX_OBSERVATION];
    let len = usize::from(agent.policy().header().observation_len);
    let observation = buffer.get_mut(..len).ok_or(RecordedError(0))?;
    let mut spread = Spread {
        decisions: 0,
        least: u32::MAX,
        most: 0,
        sum: 0,
    };
    agent.reset(Reset::Agent, SEED);
    for (at, line) in recorded.lines().enumerate() {
        if line.is_empty() {
            agent.reset(Reset::Episode, SEED);
            continue;
        }
        observation_of(line, observation).ok_or(RecordedError(at + 1))?;
        let idle = now();
        let begin = now();
        let decided = core::hint::black_box(agent.decide(observation)).is_ok();
        let end = now();
        if !decided {
            return Err(RecordedError(at + 1));
        }
        let took = end
            .wrapping_sub(begin)
            .saturating_sub(begin.wrapping_sub(idle));
        spread.decisions += 1;
        spread.least = spread.least.min(took);
        spread.most = spread.most.max(took);
        spread.sum += u64::from(took);
    }
    if spread.decisions == 0 {
        return Err(RecordedError(0));
    }
    Ok(spread)
}

/// What was measured, against what is allowed.
#[derive(Debug, Clone, Copy)]
pub struct Report {
    /// What the numbers count, such as `cycles`.
    pub unit: &'static str,
    /// The policy's decisions.
    pub policy: Spread,
    /// Decisions of the same policy made to run all its programs.
    pub worst_path: Spread,
    /// What a control period allows.
    pub allowed: u64,
}

impl Report {
    /// Whether every decision, and every one that runs all programs, is within what is allowed.
    #[must_use]
    pub fn passed(&self) -> bool {
        u64::from(self.policy.most.max(self.worst_path.most)) <= self.allowed
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = self.unit;
        for (name, spread) in [("policy", &self.policy), ("worst path", &self.worst_path)] {
            let Spread {
                decisions,
                least,
                most,
                ..
            } = spread;
            let mean = spread.mean();
            writeln!(
                f,
                "{name}: {decisions} decisions, {unit} least {least}, mean {mean}, most {most}"
            )?;
        }
        let verdict = if self.passed() { "PASS" } else { "FAIL" };
        write!(
            f,
            "{verdict}: a control period allows {} {unit}",
            self.allowed
        )
    }
}

/// What the program `cycles` says in the end. Its text is the report, or why there is none.
#[derive(Debug, Clone, Copy)]
pub enum Verdict {
    /// Both policies were measured.
    Measured(Report),
    /// A policy does not load.
    Damaged,
    /// The recorded observations are not those of the policies.
    Recorded(RecordedError),
}

impl Verdict {
    /// The exit status: 0 for PASS, 5 for FAIL, 1 if nothing was measured.
    #[must_use]
    pub fn status(&self) -> i32 {
        match self {
            Verdict::Measured(report) if report.passed() => 0,
            Verdict::Measured(_) => 5,
            Verdict::Damaged | Verdict::Recorded(_) => 1,
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Verdict::Measured(report) => report.fmt(f),
            Verdict::Damaged => f.write_str("cycles: a policy is damaged"),
            Verdict::Recorded(error) => write!(f, "cycles: {error}"),
        }
    }
}

/// The agent of the policy in these bytes. `None` if the policy is damaged or does not fit.
#[must_use]
pub fn load<W: Width, S: Storage>(bytes: &[u8], storage: S) -> Option<Agent<'_, W, S>> {
    Agent::new_in(Policy::load(bytes).ok()?, storage).ok()
}

/// Measures a policy, and the same one made to run all its programs, as [`replay`] does. `unit` is what `now` counts;
/// `allowed` is how many of them a control period allows.
pub fn judge<V: Width, S: Storage, W: Width, T: Storage>(
    policy: Option<Agent<'_, V, S>>,
    worst_path: Option<Agent<'_, W, T>>,
    recorded: &str,
    now: impl Fn() -> u32,
    (allowed, unit): (u64, &'static str),
) -> Verdict {
    let Some((mut policy, mut worst_path)) = policy.zip(worst_path) else {
        return Verdict::Damaged;
    };
    let measured = replay(&mut policy, recorded, &now)
        .and_then(|policy| Ok((policy, replay(&mut worst_path, recorded, &now)?)));
    match measured {
        Ok((policy, worst_path)) => Verdict::Measured(Report {
            unit,
            policy,
            worst_path,
            allowed,
        }),
        Err(error) => Verdict::Recorded(error),
    }
}
