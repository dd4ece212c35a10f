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
        // Two reads in a row measure the cost of reading the counter. It is subtracted below.
        let idle = now();
        let begin = now();
        seen.instructions_sum += u64::from(decide(agent, observation));
        let end = now();
        let machine = end
            .wrapping_sub(begin)
            .saturating_sub(begin.wrapping_sub(idle));
        seen.machine_sum += u64::from(machine);
        seen.machine_worst = seen.machine_worst.max(machine);
        if number % EPISODE == 0 {
            agent.reset(Reset::Episode, generator.bits());
        }
    }
    seen.stack_bytes = high_water(here);
    seen
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
