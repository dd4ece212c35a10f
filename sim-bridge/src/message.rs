//! What goes through shared memory: one fixed layout each way, the same in both processes.
//!
//! iceoryx2 compares size and type name of a payload, not the order of its fields: [`LAYOUT_HASH`] covers the rest.

use std::fmt::Debug;
use std::mem::{offset_of, size_of};

use iceoryx2::prelude::ZeroCopySend;

use crate::hash;

/// Most elements of an observation that a message holds.
pub const MAX_OBSERVATION: usize = 512;
/// Most outputs of a continuous action that a message holds.
pub const MAX_ACTION: usize = 256;

// The trainer, which does not know this crate, warns of the same limits.
#[cfg(feature = "plant")]
const _: () = assert!(
    MAX_OBSERVATION == tpg_tasks::score::LOOP_INPUTS
        && MAX_ACTION == tpg_tasks::score::LOOP_OUTPUTS
);

/// Version of the conversation, raised when the meaning of a field or a kind changes.
const PROTOCOL: usize = 2;

/// One of the two processes of a loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Owns the simulator.
    Plant,
    /// Owns the policy.
    Controller,
}

impl Role {
    /// The other one.
    #[must_use]
    pub const fn peer(self) -> Self {
        match self {
            Role::Plant => Role::Controller,
            Role::Controller => Role::Plant,
        }
    }

    /// The name used in messages and services.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Role::Plant => "plant",
            Role::Controller => "controller",
        }
    }
}

impl std::fmt::Display for Role {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// A payload and who sends it.
pub trait Message: ZeroCopySend + Debug + Copy + 'static {
    /// Who sends it.
    const SENDER: Role;
    /// Last part of the name of the service that carries it.
    const TOPIC: &'static str;
}

macro_rules! message {
    ($(#[$doc:meta])* $type_name:literal $name:ident { $($(#[$field_doc:meta])* $field:ident: $ty:ty,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, ZeroCopySend)]
        #[type_name($type_name)]
        #[repr(C)]
        pub struct $name { $($(#[$field_doc])* pub $field: $ty,)* }

        impl $name {
            /// Continues a hash with names, types and places of the fields.
            const fn hash(hash: u64) -> u64 {
                let hash = hash::text(hash, $type_name);
                $(
                    let hash = hash::text(hash, stringify!($field));
                    let hash = hash::text(hash, stringify!($ty));
                    let hash = hash::number(hash, offset_of!(Self, $field));
                )*
                hash::number(hash, size_of::<Self>())
            }
        }

        // Every byte of a message belongs to a field, so that none leaves a process uninitialised.
        const _: () = assert!(size_of::<$name>() == 0 $(+ size_of::<$ty>())*);
    };
}

message! {
    /// What the plant asks of the controller.
    "tpg/observation" ObservationMessage {
        /// Number of the request: 1, 2, 3 and so on.
        seq: u64,
        /// Seed of the agent's random streams; of [`Request::ResetAgent`] and [`Request::ResetEpisode`].
        agent_seed: u64,
        /// Simulated time since the episode began, in microseconds.
        time_us: u64,
        /// Code of a [`Request`].
        kind: u32,
        /// Number of elements of `values` that count.
        len: u32,
        /// The observation.
        values: [f32; MAX_OBSERVATION],
    }
}

message! {
    /// What the controller answers.
    "tpg/action" ActionMessage {
        /// Number of the request that this answers.
        seq: u64,
        /// Code of a [`Response`].
        kind: u32,
        /// Code of a [`Refusal`], 0 if the request was not refused.
        refusal: u32,
        /// What the refusal is about.
        detail: u32,
        /// Instructions executed for this decision.
        instructions: u32,
        /// Index of a discrete action.
        index: u32,
        /// Number of elements of `values` that count.
        len: u32,
        /// A continuous action.
        values: [f32; MAX_ACTION],
    }
}

impl Message for ObservationMessage {
    const SENDER: Role = Role::Plant;
    const TOPIC: &'static str = "observation";
}

impl Message for ActionMessage {
    const SENDER: Role = Role::Controller;
    const TOPIC: &'static str = "action";
}

impl ObservationMessage {
    /// A message with every field zero.
    #[must_use]
    pub const fn empty() -> Self {
        ObservationMessage {
            seq: 0,
            agent_seed: 0,
            time_us: 0,
            kind: 0,
            len: 0,
            values: [0.0; MAX_OBSERVATION],
        }
    }
}

impl ActionMessage {
    /// A message with every field zero.
    #[must_use]
    pub const fn empty() -> Self {
        ActionMessage {
            seq: 0,
            kind: 0,
            refusal: 0,
            detail: 0,
            instructions: 0,
            index: 0,
            len: 0,
            values: [0.0; MAX_ACTION],
        }
    }
}

/// Hash of both messages' layout and of the protocol's version.
pub const LAYOUT_HASH: u64 = ActionMessage::hash(ObservationMessage::hash(hash::number(
    hash::START,
    PROTOCOL,
)));

macro_rules! code_enum {
    ($(#[$doc:meta])* $name:ident { $($(#[$variant_doc:meta])* $variant:ident = $code:literal,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[repr(u32)]
        pub enum $name { $($(#[$variant_doc])* $variant = $code,)* }

        impl $name {
            /// The value with this code, if there is one; no value has the code 0.
            #[must_use]
            pub const fn from_code(code: u32) -> Option<Self> {
                match code { $($code => Some(Self::$variant),)* _ => None }
            }

            /// The code that stands in a message.
            #[must_use]
            pub const fn code(self) -> u32 {
                self as u32
            }
        }
    };
}

code_enum! {
    /// What the plant can ask.
    Request {
        /// Begin an agent's evaluation.
        ResetAgent = 1,
        /// Begin a further episode of the same agent.
        ResetEpisode = 2,
        /// Choose the action for an observation.
        Observe = 3,
        /// Answer and end.
        Shutdown = 4,
        /// As [`Request::Observe`], unless a newer request has come: that one is answered instead. From the first of
        /// this kind on, the controller may find gaps in the numbers.
        ObserveLatest = 5,
    }
}

code_enum! {
    /// What the controller can answer.
    Response {
        /// A reset or a shutdown is done.
        Ready = 1,
        /// The index of an action.
        Discrete = 2,
        /// One value for each output.
        Continuous = 3,
        /// The request is invalid; the controller ends.
        Refused = 4,
    }
}

code_enum! {
    /// Why the controller refuses a request.
    Refusal {
        /// There is no such kind of request; the detail is the kind.
        Kind = 1,
        /// The observation has another length; the detail is the length.
        Length = 2,
        /// The number of the request is not the next one; the detail is its lower half.
        Sequence = 3,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_survive_and_garbage_is_no_code() {
        for code in 0..10 {
            assert!(Request::from_code(code).is_none_or(|k| k.code() == code));
            assert!(Response::from_code(code).is_none_or(|k| k.code() == code));
            assert!(Refusal::from_code(code).is_none_or(|k| k.code() == code));
        }
        for garbage in [0, 6, u32::MAX] {
            assert_eq!(Request::from_code(garbage), None);
            assert_eq!(Response::from_code(garbage), None);
            assert_eq!(Refusal::from_code(garbage), None);
        }
    }

    #[test]
    fn layout_hash_sees_the_order_of_fields() {
        message! {
            /// One order.
            "tpg/test" Forth { /// A.
                a: u32, /// B.
                b: u32, }
        }
        message! {
            /// The other order.
            "tpg/test" Back { /// B.
                b: u32, /// A.
                a: u32, }
        }
        assert_eq!(size_of::<Forth>(), size_of::<Back>());
        assert_ne!(Forth::hash(hash::START), Back::hash(hash::START));
    }
}
