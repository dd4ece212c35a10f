//! Whether the longest decision fits the control period, by estimate.

use serde::Serialize;

/// Cycles of one machine instruction, unless the user knows better.
///
/// On a Cortex-M3 or M4 most instructions take one cycle, loads and stores two, taken branches two to four (Arm, Cortex-M4
/// Technical Reference Manual, table "Cortex-M4 instruction set summary"). In the runtime's loop about every third is a load
/// or a branch. Wait states of flash memory come on top.
pub const CYCLES_PER_INSTRUCTION: f64 = 2.0;

/// What turns instructions into time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Clock {
    /// The processor's clock, in megahertz. Positive.
    pub mhz: f64,
    /// Cycles of one machine instruction on average. Positive.
    pub cycles_per_instruction: f64,
    /// The time that a decision may take, in microseconds. Positive.
    pub period_us: u32,
}

/// An estimate of the longest decision's time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Deadline {
    /// What it was computed with.
    #[serde(flatten)]
    pub clock: Clock,
    /// Most machine instructions of a decision.
    pub machine_instructions: u64,
    /// The time that they take, in microseconds.
    pub estimate_us: f64,
    /// Whether the time is no longer than the control period.
    pub met: bool,
    /// The lowest clock at which it would be met, in megahertz.
    pub mhz_needed: f64,
}

impl Deadline {
    /// Estimates the time of so many machine instructions.
    #[must_use]
    pub fn estimate(machine_instructions: u64, clock: Clock) -> Self {
        let cycles = machine_instructions as f64 * clock.cycles_per_instruction;
        let estimate_us = cycles / clock.mhz;
        Deadline {
            clock,
            machine_instructions,
            estimate_us,
            met: estimate_us <= f64::from(clock.period_us),
            mhz_needed: cycles / f64::from(clock.period_us),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_deadline_is_met_from_the_clock_that_it_names() {
        let clock = Clock {
            mhz: 100.0,
            cycles_per_instruction: 2.0,
            period_us: 8000,
        };
        let slow = Deadline::estimate(1_000_000, clock);
        assert_eq!((slow.estimate_us, slow.met), (20_000.0, false));
        assert!((slow.mhz_needed - 250.0).abs() < 1e-9);
        let mhz = slow.mhz_needed;
        let fast = Deadline::estimate(1_000_000, Clock { mhz, ..clock });
        assert!(fast.met, "{fast:?}");
    }
}
