//! Decodes a blob into a view that borrows its bytes.
//!
//! Checks the header, the length, the checksum and the tables' layout.

use core::fmt;

use super::header::HeaderFault;
use super::{CRC, CRC_BYTES, Header, OLDEST_VERSION, SectionFault, Signature, VERSION};
use super::{contract, sections};
use crate::isa::FINGERPRINT;
use crate::tables::Tables;

/// A blob whose header, length and checksum are correct. The contents of its tables are not checked yet.
#[derive(Debug, Clone, Copy)]
pub struct Blob<'a> {
    header: Header,
    tables: Tables<'a>,
    signature: Option<Signature<'a>>,
}

/// Why bytes cannot be decoded as a blob.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
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
        /// Name of the field.
        field: &'static str,
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
        /// Name of the table.
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
            Self::Section { kind, fault } => write!(f, "section of type {kind} {fault}"),
            Self::RecordWidth { table } => {
                write!(f, "table `{table}` ends in the middle of a record")
            }
        }
    }
}

impl core::error::Error for DecodeError {}

impl<'a> Blob<'a> {
    /// Decodes a blob. The tables borrow from `bytes` and are not copied.
    ///
    /// The contents of the tables are not checked. [`Policy::verify`](crate::Policy::verify) checks them.
    ///
    /// # Errors
    /// Any [`DecodeError`]. Truncated files, extra bytes and any single flipped bit are always refused.
    pub fn decode(bytes: &'a [u8]) -> Result<Self, DecodeError> {
        let header = Header::read(bytes).map_err(|fault| match fault {
            HeaderFault::Short(needed) => DecodeError::Truncated {
                needed,
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
        let needed = usize::try_from(header.file_bytes()).unwrap_or(usize::MAX);
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
        let body = covered.get(header.stored_bytes()..).unwrap_or_default();
        #[cfg(feature = "old-formats")]
        if header.version < VERSION {
            let tables = super::old::read(body)?;
            return Ok(Blob {
                header,
                tables,
                signature: None,
            });
        }
        let (tables, signed) = sections::read(body, header.sections)?;
        let signature = Signature::of(covered).filter(|_| signed);
        if signature.is_some() != signed {
            return Err(DecodeError::Section {
                kind: sections::kind::SIGNATURE,
                fault: SectionFault::Form,
            });
        }
        Ok(Blob {
            header,
            tables,
            signature,
        })
    }

    /// The file's signature, which nothing has verified. `None` if the file has none, as before version 3.
    #[must_use]
    pub const fn signature(&self) -> Option<Signature<'a>> {
        self.signature
    }

    /// The hash of the file's contract, computed from header and labels. It works for every version.
    ///
    /// [`Policy::verify`](crate::Policy::verify) compares it with the stored one.
    #[must_use]
    pub fn contract(&self) -> u64 {
        contract(&self.header, self.tables.labels)
    }

    /// The header.
    #[must_use]
    pub const fn header(&self) -> &Header {
        &self.header
    }

    /// The tables, as they are stored.
    #[must_use]
    pub const fn tables(&self) -> &Tables<'a> {
        &self.tables
    }
}

pub(super) fn records<'a, const N: usize>(
    bytes: &'a [u8],
    table: &'static str,
) -> Result<&'a [[u8; N]], DecodeError> {
    match bytes.as_chunks::<N>() {
        (records, []) => Ok(records),
        _ => Err(DecodeError::RecordWidth { table }),
    }
}
