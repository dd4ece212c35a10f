//! Why bytes are no blob.

use core::fmt;

use super::OLDEST_VERSION;
use crate::parts::{Field, Table};

/// Why bytes cannot be decoded as a blob.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum DecodeError {
    /// There are fewer bytes than a header has, or fewer than the header says.
    Truncated {
        /// Bytes that are needed: the length of the file, or that of the header if not even the header is complete.
        needed: usize,
        /// Bytes that were given.
        got: usize,
    },
    /// There are more bytes than the header says.
    TrailingBytes {
        /// Number of extra bytes.
        count: usize,
    },
    /// The bytes do not begin with [`MAGIC`](super::MAGIC). The file is not a blob.
    NotABlob,
    /// This build does not read the file's format version.
    Version {
        /// Version in the file.
        file: u16,
        /// Newest version that this build reads.
        supported: u16,
    },
    /// The blob was made for a different instruction table.
    InstructionSet {
        /// Fingerprint in the file.
        file: u32,
        /// Fingerprint of this build's instruction table.
        supported: u32,
    },
    /// A field of the header holds a value that the format does not define.
    HeaderField {
        /// The field.
        field: Field,
    },
    /// The checksum is wrong. The bytes were damaged.
    Checksum {
        /// Checksum in the file.
        stored: u32,
        /// Checksum computed from the file's header and body.
        computed: u32,
    },
    /// The tables cannot be read from the body, or bytes are left over after them.
    Body,
    /// A section of version 3 is refused.
    Section {
        /// Type of the section.
        kind: u16,
        /// What is wrong with it.
        fault: SectionFault,
    },
    /// The length of a table is not a multiple of the width of its records.
    RecordWidth {
        /// The table.
        table: Table,
    },
}

impl fmt::Display for DecodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Truncated { needed, got } => write!(
                f,
                "blob is truncated: {needed} bytes needed, {got} there; export or copy it again"
            ),
            Self::TrailingBytes { count } => {
                write!(
                    f,
                    "blob has {count} bytes too many; export or copy it again"
                )
            }
            Self::NotABlob => write!(f, "not a TPG blob: it does not begin with \"TPGB\""),
            Self::Version { file, supported } => write!(
                f,
                "blob has format version {file}, this build reads versions {OLDEST_VERSION} to {supported}; \
                 export it again with this build's `tpg`, or use the build that made it"
            ),
            Self::InstructionSet { file, supported } => write!(
                f,
                "blob was made for instruction set {file:08x}, this build executes {supported:08x}; \
                 export it again with this build's `tpg`, or use the build that made it"
            ),
            Self::HeaderField { field } => {
                write!(f, "header field `{field}` holds an unknown value")
            }
            Self::Checksum { stored, computed } => write!(
                f,
                "blob is damaged: checksum {stored:08x} stored, {computed:08x} computed"
            ),
            Self::Body => write!(
                f,
                "body of the blob is malformed though its checksum is right"
            ),
            Self::Section { kind, fault } => write!(f, "section of type {kind} {fault}"),
            Self::RecordWidth { table } => {
                write!(f, "table `{table}` ends in the middle of a record")
            }
        }
    }
}

impl core::error::Error for DecodeError {}

/// What is wrong with a section.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SectionFault {
    /// Its type is not above that of the section before it.
    Order,
    /// A reserved byte of its entry in the directory is not zero.
    Reserved,
    /// It has no bytes. Such a section has no entry.
    Empty,
    /// It reaches beyond the body.
    Beyond,
    /// A byte of the gap behind it is not zero.
    Padding,
    /// The policy cannot be used without it, and this build does not know its type.
    Critical,
    /// It is no UTF-8.
    Text,
    /// Its contents do not have their form.
    Form,
}

impl SectionFault {
    const fn text(self) -> &'static str {
        match self {
            Self::Order => "does not come after those of lower types",
            Self::Reserved => "has a reserved byte that is not zero in its entry",
            Self::Empty => "is empty",
            Self::Beyond => "reaches beyond the file",
            Self::Padding => "is followed by bytes that are not zero",
            Self::Critical => {
                "is needed, and this build does not know it; use the build that made the file"
            }
            Self::Text => "is not UTF-8",
            Self::Form => "does not have its form",
        }
    }
}

impl fmt::Display for SectionFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.text())
    }
}

pub(super) fn records<const N: usize>(
    bytes: &[u8],
    table: Table,
) -> Result<&[[u8; N]], DecodeError> {
    match bytes.as_chunks::<N>() {
        (records, []) => Ok(records),
        _ => Err(DecodeError::RecordWidth { table }),
    }
}
