//! Measures the stack and the executed instructions of decisions on this machine.

use tpg_runtime::{Agent, Reset, Storage, Width};

use crate::pack::SEED;
use crate::trial::{EPISODE, Generator, MAX_OBSERVATION};

/// The number of decisions measured.
pub const DECISIONS: u32 = 1000;
/// How many bytes below the stack pointer are filled with `PAINT`. A decision needs far less.
const PAINTED: usize = 32 * 1024;
const PAINT: u8 = 0xa5;

/// The measured values.
#[derive(Debug, Clone, Copy, Default)]
pub struct Seen {
    /// The most stack that a decision used, in bytes. The caller's stack is not included.
    pub stack_bytes: usize,
    /// Policy instructions, summed over all decisions.
    pub instructions_sum: u64,
    /// Processor instructions, summed over all decisions.
    pub machine_sum: u64,
    /// Processor instructions of the longest decision.
    pub machine_worst: u32,
    /// Policy instructions of that decision.
    pub instructions_worst: u32,
}

/// Runs [`DECISIONS`] decisions and measures them. `now` returns the number of executed instructions, modulo 2^32.
#[inline(never)]
pub fn run<W: Width, S: Storage>(agent: &mut Agent<'_, W, S>, now: impl Fn() -> u32) -> Seen {
    let mut generator = Generator::new(SEED);
    let mut buffer = [0.0; MAX_OBSERVATION];
    let len = usize::from(agent.policy().header().observation_len);
    let observation = buffer.get_mut(..len).unwrap_or_default();
    let mut seen = Seen::default();
    agent.reset(Reset::Agent, SEED);
    let here = paint();
    for number in 1..=DECISIONS {
        generator.observe(observation);
        let (instructions, machine) = timed(agent, observation, &now);
        seen.instructions_sum += u64::from(instructions);
        seen.machine_sum += u64::from(machine);
        if machine > seen.machine_worst {
            (seen.machine_worst, seen.instructions_worst) = (machine, instructions);
        }
        if number % EPISODE == 0 {
            agent.reset(Reset::Episode, generator.bits());
        }
    }
    seen.stack_bytes = high_water(here);
    seen
}

/// Numbers that operations may treat differently: zeros, subnormals, the ends of ranges in [`tpg_runtime`]'s mathematics,
/// long mantissas, and what is no number.
const EXTREMES: [f32; 24] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.333_333_34,
    -2.718_281_8,
    3.141_592_7,
    1.0e-45,
    1.175_494_2e-38,
    -1.175_494_4e-38,
    1.0e-20,
    6.1e-5,
    0.999_999_94,
    1.000_000_1,
    19.999_999,
    -87.999_99,
    88.7,
    8_191.999,
    -123_456.79,
    8.388_607e6,
    1.0e20,
    f32::MAX,
    f32::INFINITY,
    f32::NAN,
];

/// The longest observation for [`extremes`], in values.
pub const MAX_EXTREMES: usize = 2048;

/// Decides for each pair of [`EXTREMES`], one in the first half of the observation and one in the second, and returns the
/// processor instructions of the longest decision. The observation lies in `buffer`; `now` is as for [`run`].
#[inline(never)]
pub fn extremes<W: Width, S: Storage>(
    agent: &mut Agent<'_, W, S>,
    buffer: &mut [f32; MAX_EXTREMES],
    now: impl Fn() -> u32,
) -> u32 {
    let len = usize::from(agent.policy().header().observation_len);
    let observation = buffer.get_mut(..len).unwrap_or_default();
    let mut worst = 0;
    agent.reset(Reset::Agent, SEED);
    for first in EXTREMES {
        for second in EXTREMES {
            for (at, value) in observation.iter_mut().enumerate() {
                *value = if 2 * at < len { first } else { second };
            }
            worst = worst.max(timed(agent, observation, &now).1);
        }
    }
    worst
}

/// Decides once and returns the policy instructions and the processor instructions. Two reads of the counter in a row
/// measure the cost of reading it, which is subtracted.
#[inline(always)]
fn timed<W: Width, S: Storage>(
    agent: &mut Agent<'_, W, S>,
    observation: &[f32],
    now: impl Fn() -> u32,
) -> (u32, u32) {
    let idle = now();
    let begin = now();
    let instructions = decide(agent, observation);
    let end = now();
    let machine = end
        .wrapping_sub(begin)
        .saturating_sub(begin.wrapping_sub(idle));
    (instructions, machine)
}

/// Decides once and returns the policy instructions, 0 if the decision fails. It is a separate function so that all
/// its stack lies below the caller's.
#[inline(never)]
fn decide<W: Width, S: Storage>(agent: &mut Agent<'_, W, S>, observation: &[f32]) -> u32 {
    agent
        .decide(observation)
        .map_or(0, |decision| decision.instructions)
}

/// An address in the caller's stack frame or just below it.
#[inline(always)]
fn stack_pointer() -> usize {
    let marker = 0u8;
    core::ptr::from_ref(core::hint::black_box(&marker)).addr()
}

/// Fills the memory below the stack pointer with `PAINT`. Returns the end address of the filled range.
#[inline(never)]
fn paint() -> usize {
    // The margin protects this function's own frame.
    let top = stack_pointer() - 64;
    for address in top - PAINTED..top {
        // SAFETY: This stack is free. The boards have far more than `PAINTED` bytes, and this loop calls no function.
        unsafe { (address as *mut u8).write_volatile(PAINT) }
    }
    top
}

/// The bytes of stack used below `top` since `paint`, plus the margin of 64 bytes above `top`.
#[inline(never)]
fn high_water(top: usize) -> usize {
    let untouched = (top - PAINTED..top)
        .take_while(|address| {
            // SAFETY: This is the range that `paint` filled. It is only read.
            unsafe { (*address as *const u8).read_volatile() == PAINT }
        })
        .count();
    PAINTED - untouched + 64
}
