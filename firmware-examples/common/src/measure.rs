//! What decisions take on this machine: stack, and executed instructions as a counter tells them.

use tpg_runtime::{Agent, Reset, Width};

use crate::pack::SEED;
use crate::trial::{EPISODE, Generator, MAX_OBSERVATION};

/// Decisions that are measured.
pub const DECISIONS: u32 = 1000;
/// Bytes below the stack pointer that are painted; far more than a decision takes.
const PAINTED: usize = 32 * 1024;
const PAINT: u8 = 0xa5;

/// What was seen.
#[derive(Debug, Clone, Copy, Default)]
pub struct Seen {
    /// Most bytes of stack that a decision took, without its caller's.
    pub stack_bytes: usize,
    /// Instructions of the policy, in all decisions together.
    pub instructions_sum: u64,
    /// Instructions of the processor, in all decisions together.
    pub machine_sum: u64,
    /// Instructions of the processor, in the longest decision.
    pub machine_worst: u32,
}

/// Lets an agent decide and measures; `now` counts executed instructions, modulo 2^32.
#[inline(never)]
pub fn run<
    W: Width,
    const WORDS: usize,
    const PROGRAMS: usize,
    const TEAMS: usize,
    const STREAMS: usize,
>(
    agent: &mut Agent<'_, W, WORDS, PROGRAMS, TEAMS, STREAMS>,
    now: impl Fn() -> u32,
) -> Seen {
    let mut generator = Generator::new(SEED);
    let mut buffer = [0.0; MAX_OBSERVATION];
    let len = usize::from(agent.policy().header().observation_len);
    let observation = buffer.get_mut(..len).unwrap_or_default();
    let mut seen = Seen::default();
    agent.reset(Reset::Agent, SEED);
    let here = paint();
    for number in 1..=DECISIONS {
        generator.observe(observation);
        // What reading the counter takes itself, and the call, cancel out.
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

/// Instructions of a decision; a function of its own, so that all its stack lies below its caller's.
#[inline(never)]
fn decide<
    W: Width,
    const WORDS: usize,
    const PROGRAMS: usize,
    const TEAMS: usize,
    const STREAMS: usize,
>(
    agent: &mut Agent<'_, W, WORDS, PROGRAMS, TEAMS, STREAMS>,
    observation: &[f32],
) -> u32 {
    agent
        .decide(observation)
        .map_or(0, |decision| decision.instructions)
}

/// An address in the caller's frame, or just below it.
#[inline(always)]
fn stack_pointer() -> usize {
    let marker = 0u8;
    core::ptr::from_ref(core::hint::black_box(&marker)).addr()
}

/// Paints the memory below the stack pointer and returns the address below which it is painted.
#[inline(never)]
fn paint() -> usize {
    // A margin for this function's own frame.
    let top = stack_pointer() - 64;
    for address in top - PAINTED..top {
        // SAFETY: free stack, since the boards have far more than is painted and this function calls nobody meanwhile.
        unsafe { (address as *mut u8).write_volatile(PAINT) }
    }
    top
}

/// Bytes of stack that were used below `top` since it was painted, and the margin above.
#[inline(never)]
fn high_water(top: usize) -> usize {
    let untouched = (top - PAINTED..top)
        .take_while(|address| {
            // SAFETY: as in `paint`; only read.
            unsafe { (*address as *const u8).read_volatile() == PAINT }
        })
        .count();
    PAINTED - untouched + 64
}
