//! Decodes a blob into a view that borrows its bytes.
//!
//! Checks the header, the length, the checksum and the tables' layout.

use super::error::{DecodeError, SectionFault};
use super::header::HeaderFault;
use super::{CRC, CRC_BYTES, Header, Signature, VERSION};
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

    /// The hash of the file's contract, computed from header, labels and ranges. It works for every version.
    ///
    /// [`Policy::verify`](crate::Policy::verify) compares it with the stored one.
    #[must_use]
    pub fn contract(&self) -> u64 {
        contract(&self.header, self.tables.labels, self.tables.ranges)
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
