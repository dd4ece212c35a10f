//! The errors of the verifier.

use core::fmt;

use crate::blob::DecodeError;
use crate::parts::{CodeField, Feature, Field, Table};

/// Why a policy is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum VerifyError {
    /// The bytes cannot be decoded as a blob.
    Decode(DecodeError),
    /// A header field contradicts the tables or another field, or exceeds a limit.
    Header {
        /// The field.
        field: Field,
        /// The value that is needed, or the limit that the value exceeds or falls below.
        needed: u32,
        /// The value found.
        got: u32,
    },
    /// The action range is empty or not finite, or a discrete policy has a range other than 0 to 0.
    ActionRange,
    /// A record does not have the one encoding that the format allows, or refers to data that is not there.
    Record {
        /// The table.
        table: Table,
        /// Index of the record in the table.
        index: u32,
    },
    /// A team has no program.
    EmptyTeam {
        /// Number of the team.
        team: u16,
    },
    /// A team lists a program twice.
    DuplicateMember {
        /// Number of the team.
        team: u16,
        /// Number of the program.
        program: u16,
    },
    /// No program of a team has an atomic action.
    NoExit {
        /// Number of the team.
        team: u16,
    },
    /// A team lists a program that does not exist.
    NoSuchProgram {
        /// Number of the team.
        team: u16,
        /// Number of the program.
        program: u16,
    },
    /// A program leads to a team or an action that does not exist, or its output is not a register of the right kind.
    NoSuchTarget {
        /// Number of the program.
        program: u16,
    },
    /// A program leads to a team, but in this kind of policy each program gives an output.
    LeadsToTeam {
        /// Number of the program.
        program: u16,
    },
    /// No program of the team gives this output, but in this kind of policy each output needs a program.
    NoProgramFor {
        /// Number of the output.
        output: u16,
    },
    /// A field of an instruction refers to something that does not exist or that it must not refer to.
    Operand {
        /// Number of the program that contains the instruction.
        program: u16,
        /// Index of the instruction in the program.
        instruction: u16,
        /// The field.
        field: CodeField,
    },
    /// An instruction needs a group, a memory model or evolved constants that the header does not name.
    Group {
        /// Number of the program that contains the instruction.
        program: u16,
        /// Index of the instruction in the program.
        instruction: u16,
    },
    /// The policy needs a part of the runtime that this build does not have.
    Unsupported {
        /// The feature of this crate that adds the part.
        feature: Feature,
    },
    /// A constant or a word of the memory image is not a finite number.
    NotFinite {
        /// The table.
        table: Table,
        /// Index of the word in the table.
        index: u32,
    },
    /// The labels do not have exactly one line with name and unit for each input and each output, or a name is empty.
    Labels,
    /// The ranges are not one for each input and output, the header's range is not what those of the outputs span, or they
    /// say what holds without them.
    Ranges,
    /// The name of the task or of its wrappers is empty or longer than 255 bytes.
    Texts,
    /// The hash of the contract is not that of header, labels and ranges.
    Contract {
        /// Hash in the file.
        stored: u64,
        /// Hash computed from header, labels and ranges.
        computed: u64,
    },
    /// The front-end section is malformed, or its presence does not agree with the format version.
    FrontEndMalformed,
}

impl fmt::Display for VerifyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Decode(error) => error.fmt(f),
            Self::Header { field, needed, got } => {
                write!(f, "header says {field} = {got}, the policy needs {needed}")
            }
            Self::ActionRange => write!(f, "action range in the header is empty or not finite"),
            Self::Record { table, index } => {
                write!(
                    f,
                    "record {index} of table `{table}` is out of place or malformed"
                )
            }
            Self::EmptyTeam { team } => write!(f, "team {team} has no program"),
            Self::DuplicateMember { team, program } => {
                write!(f, "team {team} lists program {program} twice")
            }
            Self::NoExit { team } => write!(f, "team {team} has no program with an atomic action"),
            Self::NoSuchProgram { team, program } => {
                write!(
                    f,
                    "team {team} lists program {program}, which does not exist"
                )
            }
            Self::NoSuchTarget { program } => write!(
                f,
                "program {program} leads to a team or action that does not exist"
            ),
            Self::LeadsToTeam { program } => write!(
                f,
                "program {program} leads to a team, where each program gives an output"
            ),
            Self::NoProgramFor { output } => {
                write!(f, "no program of the team gives output {output}")
            }
            Self::Operand {
                program,
                instruction,
                field,
            } => write!(
                f,
                "instruction {instruction} of program {program}: field `{field}` is out of range"
            ),
            Self::Unsupported { feature } => write!(
                f,
                "the policy needs the feature `{feature}`, which this runtime was built without: \
                 build tpg-runtime with it"
            ),
            Self::Group {
                program,
                instruction,
            } => write!(
                f,
                "instruction {instruction} of program {program} is of a group or memory model \
                 that the header does not announce"
            ),
            Self::NotFinite { table, index } => {
                write!(f, "word {index} of table `{table}` is not a finite number")
            }
            Self::Labels => write!(
                f,
                "labels are not one `name<TAB>unit` line for each input and output"
            ),
            Self::Ranges => write!(
                f,
                "ranges are not one for each input and output, do not span the header's, or are needless"
            ),
            Self::Texts => write!(
                f,
                "the name of the task or of its wrappers is empty or longer than 255 bytes"
            ),
            Self::Contract { stored, computed } => write!(
                f,
                "contract {stored:016x} stored, {computed:016x} computed from header, labels and ranges"
            ),
            Self::FrontEndMalformed => write!(f, "front-end section is malformed"),
        }
    }
}

impl core::error::Error for VerifyError {}

impl From<DecodeError> for VerifyError {
    fn from(error: DecodeError) -> Self {
        Self::Decode(error)
    }
}
