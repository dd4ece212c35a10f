//! The file format `*.tpg`: a header, sections, and a CRC-32.
//!
//! `docs/format-3.md` specifies version 3, which this build writes. `docs/format.md` specifies versions 1 and 2, which it
//! reads with the feature `old-formats`.

mod contract;
mod decode;
mod encode;
mod error;
mod header;
#[cfg(feature = "old-formats")]
mod old;
mod peek;
mod sections;

pub use contract::{contract, contract_bytes};
pub(crate) use contract::{default_range, lines, next_line, split_at_byte};
pub use decode::Blob;
pub use encode::{EncodeError, encode, encode_signed, encoded_bound};
pub use error::{DecodeError, SectionFault};
pub(crate) use header::HeaderFault;
pub use header::{
    ActionKind, Header, InitialValues, MemoryModel, Missing, RegisterMode, ResetScope,
    WriteDistribution,
};
pub use peek::{contract_of, labels_of};
pub use sections::{SIGNATURE_BYTES, SIGNATURE_SECTION_BYTES, Signature};

/// The first four bytes of every blob.
pub const MAGIC: [u8; 4] = *b"TPGB";
/// The newest format version that this build reads, and the only one that it writes.
pub const VERSION: u16 = 3;
/// The oldest format version that this build reads: 1 with the feature `old-formats`, else [`VERSION`].
pub const OLDEST_VERSION: u16 = if cfg!(feature = "old-formats") {
    1
} else {
    VERSION
};

/// Most entries of a directory.
pub(crate) const MAX_SECTIONS: u16 = 32;
/// Most bytes of a file of version 3.
pub const MAX_FILE_BYTES: u32 = 1 << 24;

/// Length of the checksum at the end of a blob, in bytes.
pub(crate) const CRC_BYTES: usize = 4;
/// How checksums are computed. The default needs the least flash.
///
/// The feature `fast-checksum` is faster, but it needs a table of 16 KiB.
#[cfg(not(feature = "fast-checksum"))]
pub(crate) type Checksum = crc::NoTable;
#[cfg(feature = "fast-checksum")]
pub(crate) type Checksum = crc::Table<16>;

/// The CRC-32 of IEEE 802.3. It covers every byte before it.
pub(crate) static CRC: crc::Crc<u32, Checksum> =
    crc::Crc::<u32, Checksum>::new(&crc::CRC_32_ISO_HDLC);
