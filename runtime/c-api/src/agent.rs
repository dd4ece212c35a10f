//! Agents in the caller's memory.

use core::ffi::c_void;
use core::mem::{align_of, size_of};
use core::ptr;
use core::slice;

use tpg_runtime::rng::Pcg32;
use tpg_runtime::{Action, Capacities, Header, Policy, Reset, SliceAgent, Slices};

use crate::layout::MemoryLayout;
use crate::status::TpgStatus;
use crate::width::Built;

/// Number of bytes of a policy's header. `tpg_memory_size` needs no more of the file.
pub const TPG_HEADER_SIZE: usize = 96;
/// The address of an agent's memory must be a multiple of this number.
pub const TPG_ALIGNMENT: usize = 8;
/// Begin an evaluation of the agent with its first episode.
pub const TPG_RESET_AGENT: u32 = 0;
/// Begin another episode of the same evaluation.
pub const TPG_RESET_EPISODE: u32 = 1;

const _: () = assert!(TPG_HEADER_SIZE == Header::BYTES);
const _: () =
    assert!(align_of::<TpgAgent>() <= TPG_ALIGNMENT && align_of::<Pcg32>() <= TPG_ALIGNMENT);

/// The first bytes of memory that `tpg_init` has filled.
const MARK: u64 = 0x7470_6720_6167_656e;

/// A policy and its state, at the start of the caller's memory.
pub struct TpgAgent {
    mark: u64,
    agent: SliceAgent<'static, 'static, Built>,
}

/// Number of bytes of memory that an agent of a policy needs.
///
/// Returns 0 if the bytes are not the header of a policy, or of one that this library does not execute.
///
/// `header` is the first `TPG_HEADER_SIZE` bytes of the file or more. This function trusts the header. `tpg_init` checks it.
///
/// # Safety
/// `header` must be null or point to `header_length` readable bytes.
// SAFETY: the prefix keeps the name apart from every other function of a program.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tpg_memory_size(header: *const c_void, header_length: usize) -> usize {
    // SAFETY: the caller's promise.
    let bytes = unsafe { bytes(header, header_length) };
    bytes
        .and_then(Header::peek)
        .map_or(0, |header| layout(&Capacities::needed_by(&header)).bytes)
}

/// Makes an agent for a policy in the caller's memory and points `agent` to it. The agent is reset with seed 0.
///
/// It checks every table of the policy first and writes to the memory only if all are valid. The caller frees nothing: the
/// agent ends when the caller uses the memory for something else. Until then the policy's bytes must stay in their place,
/// unchanged.
///
/// # Safety
/// - `memory` must be null or point to `memory_length` writable bytes.
/// - `policy` must be null or point to `policy_length` readable bytes that do not overlap `memory`.
/// - `agent` must be null or point to a place for a pointer.
// SAFETY: the prefix keeps the name apart from every other function of a program.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tpg_init(
    memory: *mut c_void,
    memory_length: usize,
    policy: *const c_void,
    policy_length: usize,
    agent: *mut *mut TpgAgent,
) -> TpgStatus {
    if agent.is_null() {
        return TpgStatus::NullPointer;
    }
    // SAFETY: not null, and the caller promises a place for a pointer. `write_unaligned` needs no alignment.
    unsafe { agent.write_unaligned(ptr::null_mut()) };
    // SAFETY: the caller's promise.
    let Some(bytes) = (unsafe { bytes(policy, policy_length) }) else {
        return TpgStatus::NullPointer;
    };
    if memory.is_null() {
        return TpgStatus::NullPointer;
    }
    if !memory.addr().is_multiple_of(TPG_ALIGNMENT) {
        return TpgStatus::Misaligned;
    }
    let policy = match Policy::load(bytes) {
        Ok(policy) => policy,
        Err(error) => return error.into(),
    };
    let needed = Capacities::needed_by(policy.header());
    let layout = layout(&needed);
    if memory_length < layout.bytes {
        return TpgStatus::ShortMemory;
    }
    let memory = memory.cast::<u8>();
    let place = memory.cast::<TpgAgent>();
    // SAFETY: aligned, long enough for an agent, and writable by the caller's promise. Without the mark, an agent that lay
    // here before is none now.
    unsafe { (&raw mut (*place).mark).write(0) };
    // SAFETY: the memory is aligned for every type here and has `layout.bytes` bytes. The layout divides them into parts that
    // do not overlap, each aligned for its type. The caller promises that they are writable and that nobody else uses them.
    let slices = unsafe {
        Slices {
            words: fill(memory.add(layout.words), needed.words, 0.0f32),
            bids: fill(memory.add(layout.bids), needed.programs, 0.0f32),
            visited: fill(memory.add(layout.visited), needed.teams, false),
            streams: fill(memory.add(layout.streams), needed.streams, Pcg32::new(0, 0)),
        }
    };
    let Ok(made) = SliceAgent::new_in(policy, slices) else {
        return TpgStatus::Width;
    };
    // SAFETY: as above. The layout leaves the first bytes to the agent.
    unsafe {
        place.write(TpgAgent {
            mark: MARK,
            agent: made,
        });
        agent.write_unaligned(place);
    }
    TpgStatus::Ok
}

/// Begins an evaluation of an agent (`TPG_RESET_AGENT`) or another of its episodes (`TPG_RESET_EPISODE`).
///
/// `agent_seed` determines the agent's random streams. It has no effect if none of them is reset.
///
/// # Safety
/// `agent` must be null or come from `tpg_init`.
// SAFETY: the prefix keeps the name apart from every other function of a program.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tpg_reset(agent: *mut TpgAgent, what: u32, agent_seed: u64) -> TpgStatus {
    let what = match what {
        TPG_RESET_AGENT => Reset::Agent,
        TPG_RESET_EPISODE => Reset::Episode,
        _ => return TpgStatus::ResetKind,
    };
    // SAFETY: the caller's promise.
    match unsafe { borrow(agent) } {
        Ok(agent) => {
            agent.reset(what, agent_seed);
            TpgStatus::Ok
        }
        Err(status) => status,
    }
}

/// Decides and writes one value for each output. Values are finite and within the policy's limits.
///
/// An element of the observation that is not finite, such as NaN, is missing: the policy's front end fills it in. Without a
/// front end, and in policies of format versions 1 and 2, it counts as 0. On any status but `TPG_STATUS_OK` nothing has changed.
///
/// # Safety
/// - `agent` must be null or come from `tpg_init`.
/// - `observation` must be null or point to `observation_length` readable floats.
/// - `action` must be null or point to `action_length` writable floats.
// SAFETY: the prefix keeps the name apart from every other function of a program.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tpg_decide(
    agent: *mut TpgAgent,
    observation: *const f32,
    observation_length: usize,
    action: *mut f32,
    action_length: usize,
) -> TpgStatus {
    // SAFETY: the caller's promise.
    let agent = match unsafe { borrow(agent) } {
        Ok(agent) => agent,
        Err(status) => return status,
    };
    if agent.policy().header().outputs() == 0 {
        return TpgStatus::DiscretePolicy;
    }
    if action.is_null() {
        return TpgStatus::NullPointer;
    }
    if !action.is_aligned() {
        return TpgStatus::Misaligned;
    }
    if action_length != agent.policy().header().outputs() {
        return TpgStatus::ActionLength;
    }
    // SAFETY: the caller's promise. The observation is read before the action is written.
    match unsafe { decide(agent, observation, observation_length) } {
        Ok(Action::Continuous(values)) => {
            // SAFETY: not null, aligned, and the caller promises room for `action_length` floats, which is their number.
            unsafe { ptr::copy(values.as_ptr(), action, values.len()) };
            TpgStatus::Ok
        }
        Ok(Action::Discrete(_)) => TpgStatus::DiscretePolicy,
        Err(status) => status,
    }
}

/// Decides and writes the index of the chosen action.
///
/// It is the counterpart of `tpg_decide` for policies whose actions are discrete.
///
/// # Safety
/// - `agent` must be null or come from `tpg_init`.
/// - `observation` must be null or point to `observation_length` readable floats.
/// - `action` must be null or point to a place for the number of the action.
// SAFETY: the prefix keeps the name apart from every other function of a program.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tpg_decide_discrete(
    agent: *mut TpgAgent,
    observation: *const f32,
    observation_length: usize,
    action: *mut u16,
) -> TpgStatus {
    // SAFETY: the caller's promise.
    let agent = match unsafe { borrow(agent) } {
        Ok(agent) => agent,
        Err(status) => return status,
    };
    if agent.policy().header().outputs() != 0 {
        return TpgStatus::ContinuousPolicy;
    }
    if action.is_null() {
        return TpgStatus::NullPointer;
    }
    if !action.is_aligned() {
        return TpgStatus::Misaligned;
    }
    // SAFETY: the caller's promise.
    match unsafe { decide(agent, observation, observation_length) } {
        Ok(Action::Discrete(index)) => {
            // SAFETY: not null, aligned, and the caller promises a place.
            unsafe { action.write(index) };
            TpgStatus::Ok
        }
        Ok(Action::Continuous(_)) => TpgStatus::ContinuousPolicy,
        Err(status) => status,
    }
}

/// Number of elements of the policy's observation, 0 if there is no agent.
///
/// # Safety
/// `agent` must be null or come from `tpg_init`.
// SAFETY: the prefix keeps the name apart from every other function of a program.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tpg_observation_length(agent: *mut TpgAgent) -> usize {
    // SAFETY: the caller's promise.
    unsafe { borrow(agent) }.map_or(0, |agent| {
        usize::from(agent.policy().header().observation_len)
    })
}

/// Number of the policy's outputs, 0 if its actions are discrete or there is no agent.
///
/// # Safety
/// `agent` must be null or come from `tpg_init`.
// SAFETY: the prefix keeps the name apart from every other function of a program.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tpg_outputs(agent: *mut TpgAgent) -> usize {
    // SAFETY: the caller's promise.
    unsafe { borrow(agent) }.map_or(0, |agent| agent.policy().header().outputs())
}

/// Time between two decisions in microseconds, 0 if there is no agent.
///
/// # Safety
/// `agent` must be null or come from `tpg_init`.
// SAFETY: the prefix keeps the name apart from every other function of a program.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tpg_control_period_us(agent: *mut TpgAgent) -> u32 {
    // SAFETY: the caller's promise.
    unsafe { borrow(agent) }.map_or(0, |agent| agent.policy().header().control_period_us)
}

/// The bytes that a caller points to, `None` for a null pointer or an impossible length.
///
/// # Safety
/// `start` must be null or point to `length` bytes that stay readable and unchanged during `'a`.
unsafe fn bytes<'a>(start: *const c_void, length: usize) -> Option<&'a [u8]> {
    if start.is_null() || isize::try_from(length).is_err() {
        return None;
    }
    // SAFETY: not null, no longer than an object can be, and readable by the caller's promise.
    Some(unsafe { slice::from_raw_parts(start.cast(), length) })
}

/// Fills memory with copies of a value.
///
/// # Safety
/// `start` must be aligned for `T` and point to room for `length` values that nobody else uses during `'a`.
unsafe fn fill<'a, T: Clone>(start: *mut u8, length: usize, value: T) -> &'a mut [T] {
    let start = start.cast::<T>();
    for k in 0..length {
        // SAFETY: within the room that the caller promises.
        unsafe { start.add(k).write(value.clone()) };
    }
    // SAFETY: aligned by the caller's promise, and every element was just written.
    unsafe { slice::from_raw_parts_mut(start, length) }
}

/// The agent at an address.
///
/// # Safety
/// `agent` must be null or point to at least `size_of::<TpgAgent>()` readable and writable bytes that `tpg_init` filled.
unsafe fn borrow<'a>(
    agent: *mut TpgAgent,
) -> Result<&'a mut SliceAgent<'static, 'static, Built>, TpgStatus> {
    if agent.is_null() {
        return Err(TpgStatus::NullPointer);
    }
    if !agent.addr().is_multiple_of(TPG_ALIGNMENT) {
        return Err(TpgStatus::Misaligned);
    }
    // SAFETY: not null, aligned, and readable by the caller's promise. Any bytes are a valid number.
    if unsafe { (&raw const (*agent).mark).read() } != MARK {
        return Err(TpgStatus::NoAgent);
    }
    // SAFETY: `tpg_init` has written an agent here, and the caller uses it from one place at a time.
    Ok(unsafe { &mut (*agent).agent })
}

/// Decides on the observation at an address.
///
/// # Safety
/// `observation` must be null or point to `length` readable floats.
unsafe fn decide<'a>(
    agent: &'a mut SliceAgent<'static, 'static, Built>,
    observation: *const f32,
    length: usize,
) -> Result<Action<'a>, TpgStatus> {
    if observation.is_null() {
        return Err(TpgStatus::NullPointer);
    }
    if !observation.is_aligned() {
        return Err(TpgStatus::Misaligned);
    }
    if length != usize::from(agent.policy().header().observation_len) {
        return Err(TpgStatus::ObservationLength);
    }
    // SAFETY: not null, aligned, readable by the caller's promise, and no longer than 65 535 floats.
    let observation = unsafe { slice::from_raw_parts(observation, length) };
    let decision = agent.decide(observation);
    decision
        .map(|decision| decision.action)
        .map_err(|_| TpgStatus::ObservationLength)
}

/// The memory layout of an agent with room for `needed`.
const fn layout(needed: &Capacities) -> MemoryLayout {
    MemoryLayout::new(size_of::<TpgAgent>(), needed)
}
