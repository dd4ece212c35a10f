//! The parts of a policy and of the runtime that errors name.

use core::fmt;

macro_rules! named {
    ($(#[$doc:meta])* $name:ident { $($(#[$variant_doc:meta])* $variant:ident $text:literal,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[non_exhaustive]
        pub enum $name { $($(#[$variant_doc])* $variant,)* }

        impl $name {
            /// The name that messages use.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $text,)* }
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(self.name())
            }
        }
    };
}

named! {
    /// A table of a blob.
    Table {
        /// The teams.
        Teams "teams",
        /// The programs that the teams list.
        Members "members",
        /// The programs.
        Programs "programs",
        /// The instructions of all programs.
        Code "code",
        /// The evolved constants.
        Constants "constants",
        /// The cells of indexed memory that are kept.
        Cells "cells",
        /// The memory image.
        Memory "memory",
        /// The ranges of inputs and outputs.
        Ranges "ranges",
    }
}

named! {
    /// A field of the header, or a number that a field announces.
    Field {
        /// Length of the header in bytes.
        HeaderLength "header length",
        /// Length of the body in bytes.
        BodyBytes "body bytes",
        /// Number of state words.
        Words "words",
        /// Number of programs.
        Programs "programs",
        /// Number of teams.
        Teams "teams",
        /// Number of random streams.
        Streams "streams",
        /// Vector width.
        Width "width",
        /// Length of the observation.
        Observation "observation length",
        /// Length of the observation window.
        Window "window",
        /// Number of actions or outputs.
        Actions "actions",
        /// Kind of the action.
        ActionKind "action kind",
        /// Whether registers keep their values.
        RegisterMode "register mode",
        /// Where initial values come from.
        InitialValues "initial values",
        /// When state is reset.
        ResetScope "reset scope",
        /// Which memory programs share.
        MemoryModel "memory model",
        /// How memory is written.
        WriteDistribution "write distribution",
        /// What stands for a missing element.
        Missing "missing",
        /// State words of the front end.
        FrontEndWords "front-end words",
        /// Groups of instructions.
        Groups "groups",
        /// Number of observations that a window holds.
        History "history",
        /// Number of sections.
        Sections "sections",
        /// Number of tasks.
        Tasks "tasks",
        /// Bytes that must be zero.
        Reserved "reserved bytes",
        /// Number of instructions, which the programs announce.
        Instructions "instructions",
        /// Number of members, which the teams announce.
        Members "members",
        /// Number of kept cells of indexed memory.
        Cells "cells",
        /// Words of the memory image.
        MemoryImage "memory image words",
    }
}

named! {
    /// A field of an instruction.
    CodeField {
        /// The destination.
        D "d",
        /// The first operand.
        A "a",
        /// The second operand.
        B "b",
    }
}

named! {
    /// A feature of this crate that a policy can need.
    Feature {
        /// Scalar instructions.
        Scalar "scalar",
        /// Vector instructions.
        Vector "vector",
        /// Matrix instructions.
        Matrix "matrix",
        /// Instructions that copy evolved constants.
        Constants "constants",
        /// Team memory.
        TeamMemory "team-memory",
        /// The ten operations of the thesis's chapter 2.
        Classic "classic",
        /// Moves and latches.
        Copies "copies",
        /// Other distributions of memory writes than the thesis's.
        WriteDistributions "write-distributions",
        /// Front ends.
        FrontEnd "front-end",
        /// Windows that hold earlier observations too.
        History "history",
        /// Outputs that have programs of their own.
        ActionPrograms "action-programs",
    }
}

named! {
    /// A capacity of an agent.
    Resource {
        /// The vector width. It must be equal.
        Width "width",
        /// State words.
        Words "words",
        /// Programs.
        Programs "programs",
        /// Teams.
        Teams "teams",
        /// Random streams of team memory.
        Streams "streams",
        /// Words of the memory that programs share.
        MemoryWords "memory words",
    }
}
