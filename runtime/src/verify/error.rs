//! Why a policy is refused.

use core::fmt;

use crate::blob::DecodeError;

/// Why a well-formed blob is no executable policy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum VerifyError {
    /// The bytes are no blob.
    Decode(DecodeError),
    /// A header field contradicts the tables or another field.
    Header {
        /// Which field.
        field: &'static str,
        /// What the rest of the blob asks for.
        needed: u32,
        /// What the header says.
        got: u32,
    },
    /// The action range is empty or not finite.
    ActionRange,
    /// A record differs from the one form in which it may be stored.
    Record {
        /// Which table.
        table: &'static str,
        /// Which record of it.
        index: u32,
    },
    /// A team has no member.
    EmptyTeam {
        /// The team.
        team: u16,
    },
    /// No member of a team has an atomic action.
    NoExit {
        /// The team.
        team: u16,
    },
    /// A team lists a program that does not exist.
    NoSuchProgram {
        /// The team.
        team: u16,
        /// The program.
        program: u16,
    },
    /// A program leads to a team or an action that does not exist.
    NoSuchTarget {
        /// The program.
        program: u16,
    },
    /// A program leads to a team, in a policy whose programs each give an output.
    LeadsToTeam {
        /// The program.
        program: u16,
    },
    /// No program gives this output, in a policy whose programs each give one.
    NoProgramFor {
        /// The output.
        output: u16,
    },
    /// An instruction's field refers to something that it must not, or that does not exist.
    Operand {
        /// Program that contains the instruction.
        program: u16,
        /// Its number within the program.
        instruction: u16,
        /// `d`, `a` or `b`.
        field: char,
    },
    /// An instruction belongs to a group or a memory model that the header does not announce.
    Group {
        /// Program that contains the instruction.
        program: u16,
        /// Its number within the program.
        instruction: u16,
    },
    /// The policy needs a part of the runtime that this build leaves out.
    Unsupported {
        /// The feature of this crate that brings the part.
        feature: &'static str,
    },
    /// A constant or a word of the memory image is not finite.
    NotFinite {
        /// Which table.
        table: &'static str,
        /// Which word of it.
        index: u32,
    },
    /// The labels are not one line with name and unit for each input and output.
    Labels,
    /// The front-end section does not have its layout, or the format version is of policies without one.
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
