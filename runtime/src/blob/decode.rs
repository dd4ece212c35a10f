//! Bytes to borrowed view: lengths, header, checksum, tables.

use core::fmt;

use super::header::HeaderFault;
use super::{Body, CRC, CRC_BYTES, Header, OLDEST_VERSION, VERSION};
use crate::isa::FINGERPRINT;
use crate::tables::Tables;

/// A blob whose header, lengths and checksum are right; its tables are not checked yet.
#[derive(Debug, Clone, Copy)]
pub struct Blob<'a> {
    header: Header,
    tables: Tables<'a>,
}

/// Why bytes are no blob of this version.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum DecodeError {
    /// Fewer bytes than the smallest blob, or than the header announces.
    Truncated {
        /// Bytes that the blob should have.
        needed: usize,
        /// Bytes that there are.
        got: usize,
    },
    /// More bytes than the header announces.
    TrailingBytes {
        /// Bytes too many.
        count: usize,
    },
    /// The bytes do not begin with the magic: this is some other file.
    NotABlob,
    /// Another version of the format.
    Version {
        /// Version of the file.
        file: u16,
        /// Newest version that this build reads.
        supported: u16,
    },
    /// Made for another instruction table.
    InstructionSet {
        /// Fingerprint in the file.
        file: u32,
        /// Fingerprint of this build's table.
        supported: u32,
    },
    /// A field of the header holds no value of its kind.
    HeaderField {
        /// Which field.
        field: &'static str,
    },
    /// The checksum differs: the bytes were damaged.
    Checksum {
        /// Checksum in the file.
        stored: u32,
        /// Checksum of its bytes.
        computed: u32,
    },
    /// The body is no postcard message of this version's tables.
    Body,
    /// A table's length is no multiple of its records' width.
    RecordWidth {
        /// Which table.
        table: &'static str,
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
            Self::RecordWidth { table } => {
                write!(f, "table `{table}` ends in the middle of a record")
            }
        }
    }
}

impl core::error::Error for DecodeError {}

impl<'a> Blob<'a> {
    /// Views `bytes` as a blob; nothing is copied.
    ///
    /// # Errors
    /// Any [`DecodeError`]: every truncation, trailing byte and flipped bit is refused.
    pub fn decode(bytes: &'a [u8]) -> Result<Self, DecodeError> {
        let header = Header::read(bytes).map_err(|fault| match fault {
            HeaderFault::Short => DecodeError::Truncated {
                needed: Header::BYTES,
                got: bytes.len(),
            },
            HeaderFault::Magic => DecodeError::NotABlob,
            HeaderFault::Version(file) => DecodeError::Version {
                file,
                supported: VERSION,
            },
            HeaderFault::Fingerprint(file) => DecodeError::InstructionSet {
                file,
                supported: FINGERPRINT,
            },
            HeaderFault::Field(field) => DecodeError::HeaderField { field },
        })?;
        let needed = usize::try_from(header.body_bytes)
            .unwrap_or(usize::MAX)
            .saturating_add(Header::BYTES + CRC_BYTES);
        if bytes.len() < needed {
            return Err(DecodeError::Truncated {
                needed,
                got: bytes.len(),
            });
        }
        if bytes.len() > needed {
            return Err(DecodeError::TrailingBytes {
                count: bytes.len() - needed,
            });
        }
        let (covered, stored) = bytes
            .split_last_chunk::<CRC_BYTES>()
            .ok_or(DecodeError::Body)?;
        let (stored, computed) = (u32::from_le_bytes(*stored), CRC.checksum(covered));
        if stored != computed {
            return Err(DecodeError::Checksum { stored, computed });
        }
        let body = covered.get(Header::BYTES..).unwrap_or_default();
        let (body, rest) =
            postcard::take_from_bytes::<Body<'a>>(body).map_err(|_| DecodeError::Body)?;
        if !rest.is_empty() {
            return Err(DecodeError::Body);
        }
        let tables = Tables {
            teams: records(body.teams, "teams")?,
            members: records(body.members, "members")?,
            programs: records(body.programs, "programs")?,
            code: records(body.code, "code")?,
            constants: records(body.constants, "constants")?,
            cells: records(body.cells, "cells")?,
            memory: records(body.memory, "memory")?,
            front_end: body.front_end,
            labels: body.labels,
            task: body.task,
            observability: body.observability,
        };
        Ok(Blob { header, tables })
    }

    /// What the header says.
    #[must_use]
    pub const fn header(&self) -> &Header {
        &self.header
    }

    /// The tables, as stored.
    #[must_use]
    pub const fn tables(&self) -> &Tables<'a> {
        &self.tables
    }
}

fn records<'a, const N: usize>(
    bytes: &'a [u8],
    table: &'static str,
) -> Result<&'a [[u8; N]], DecodeError> {
    match bytes.as_chunks::<N>() {
        (records, []) => Ok(records),
        _ => Err(DecodeError::RecordWidth { table }),
    }
}
