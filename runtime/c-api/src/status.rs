//! The status that functions return.

use core::ffi::c_char;

use tpg_runtime::VerifyError;
use tpg_runtime::blob::DecodeError;

/// The result of a call: `TPG_STATUS_OK`, or the reason why it did nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub enum TpgStatus {
    /// Done.
    Ok = 0,
    /// A pointer is null.
    NullPointer = 1,
    /// The address of the memory or of an array of floats is not a multiple of its alignment.
    Misaligned = 2,
    /// The memory has fewer bytes than `tpg_memory_size` says.
    ShortMemory = 3,
    /// The memory holds no agent. Call `tpg_init` first.
    NoAgent = 4,
    /// The bytes are not a policy.
    NotAPolicy = 5,
    /// The policy was made for another version of the format.
    Version = 6,
    /// The policy was made for another instruction table.
    InstructionSet = 7,
    /// The policy's bytes are damaged, or there are too few or too many.
    Damaged = 8,
    /// The policy's tables contradict each other.
    Invalid = 9,
    /// The policy has a part that this build does not execute.
    Unsupported = 10,
    /// The library was built for policies of another vector width.
    Width = 11,
    /// The observation has the wrong length. `tpg_observation_length` says the right one.
    ObservationLength = 12,
    /// The array for the action has the wrong length. `tpg_outputs` says the right one.
    ActionLength = 13,
    /// The policy's actions are discrete. Call `tpg_decide_discrete`.
    DiscretePolicy = 14,
    /// The policy's actions are continuous. Call `tpg_decide`.
    ContinuousPolicy = 15,
    /// The argument `what` is neither `TPG_RESET_AGENT` nor `TPG_RESET_EPISODE`.
    ResetKind = 16,
}

/// The texts in the order of the codes. Each ends with a zero byte, as C needs it.
const MESSAGES: [&str; 17] = [
    "done\0",
    "a pointer is null\0",
    "a pointer is not aligned: memory needs TPG_ALIGNMENT, floats need 4\0",
    "the memory is shorter than tpg_memory_size says\0",
    "the memory holds no agent: call tpg_init first, and check what it returns\0",
    "the bytes are no policy: they do not begin with TPGB\0",
    "the policy has another format version: export it again, or use the library that matches it\0",
    "the policy was made for another instruction set: export it again\0",
    "the policy is damaged, truncated or followed by other bytes\0",
    "the policy is malformed: its tables contradict each other or its header\0",
    "the policy needs something that this library was built without\0",
    "the library was built for another vector width (TPG_WIDTH) than the policy's\0",
    "the observation has another length than the policy's: ask tpg_observation_length\0",
    "the action has another length than the policy's outputs: ask tpg_outputs\0",
    "the policy's actions are discrete: call tpg_decide_discrete\0",
    "the policy's actions are continuous: call tpg_decide\0",
    "what to reset is neither TPG_RESET_AGENT nor TPG_RESET_EPISODE\0",
];

/// The meaning of a status in English, as a C string. It is never null and stays valid.
// SAFETY: the prefix keeps the name apart from every other function of a program.
#[unsafe(no_mangle)]
pub extern "C" fn tpg_status_message(status: u32) -> *const c_char {
    let text = MESSAGES
        .get(status as usize)
        .unwrap_or(&"no status of this library\0");
    text.as_ptr().cast()
}

impl From<VerifyError> for TpgStatus {
    fn from(error: VerifyError) -> Self {
        match error {
            VerifyError::Decode(DecodeError::NotABlob) => TpgStatus::NotAPolicy,
            VerifyError::Decode(DecodeError::Version { .. }) => TpgStatus::Version,
            VerifyError::Decode(DecodeError::InstructionSet { .. }) => TpgStatus::InstructionSet,
            VerifyError::Decode(_) => TpgStatus::Damaged,
            VerifyError::Unsupported { .. } => TpgStatus::Unsupported,
            _ => TpgStatus::Invalid,
        }
    }
}
