//! The file format `*.tpg`: a header, a body in postcard's encoding, and a CRC-32.
//!
//! `docs/format.md` is the specification of the format.

mod contract;
mod decode;
mod encode;
mod header;

pub(crate) use contract::lines;
pub use contract::{contract, contract_bytes};
pub use decode::{Blob, DecodeError};
pub use encode::{EncodeError, encode, encoded_bound};
pub(crate) use header::HeaderFault;
pub use header::{
    ActionKind, Header, InitialValues, MemoryModel, RegisterMode, ResetScope, WriteDistribution,
};

/// The first four bytes of every blob.
pub const MAGIC: [u8; 4] = *b"TPGB";
/// The newest format version that this build reads and writes. Policies with a front end are written in this version.
pub const VERSION: u16 = 2;
/// The oldest format version that this build reads. Policies without a front end are written in this version.
pub const OLDEST_VERSION: u16 = 1;

/// Length of the checksum at the end of a blob, in bytes.
pub(crate) const CRC_BYTES: usize = 4;
/// How checksums are computed. The default needs the least flash.
///
/// The feature `fast-checksum` is faster, but it needs a table of 16 KiB.
#[cfg(not(feature = "fast-checksum"))]
pub(crate) type Checksum = crc::NoTable;
#[cfg(feature = "fast-checksum")]
pub(crate) type Checksum = crc::Table<16>;

/// The CRC-32 of IEEE 802.3. It covers the header and the body.
pub(crate) static CRC: crc::Crc<u32, Checksum> =
    crc::Crc::<u32, Checksum>::new(&crc::CRC_32_ISO_HDLC);

/// The body as postcard reads and writes it.
///
/// The tables of fixed-width records are byte strings, so that the decoder can borrow them from the file.
#[derive(serde::Serialize, serde::Deserialize)]
struct Body<'a> {
    teams: &'a [u8],
    members: &'a [u8],
    programs: &'a [u8],
    code: &'a [u8],
    constants: &'a [u8],
    cells: &'a [u8],
    memory: &'a [u8],
    front_end: &'a [u8],
    labels: &'a str,
    task: &'a str,
    observability: &'a str,
}
