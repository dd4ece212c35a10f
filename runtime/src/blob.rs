//! The file format `*.tpg`: header, postcard body, CRC-32. `docs/format.md` is its normative description.

mod decode;
mod encode;
mod header;

pub use decode::{Blob, DecodeError};
pub use encode::{EncodeError, encode, encoded_bound};
pub(crate) use header::HeaderFault;
pub use header::{ActionKind, Header, InitialValues, MemoryModel, RegisterMode, ResetScope};

/// First bytes of every blob.
pub const MAGIC: [u8; 4] = *b"TPGB";
/// The newest format version that this build writes and reads: policies with a front end have it.
pub const VERSION: u16 = 2;
/// The oldest format version that this build reads; policies without a front end are written in it.
pub const OLDEST_VERSION: u16 = 1;

/// Bytes of the checksum at the end.
pub(crate) const CRC_BYTES: usize = 4;
/// How checksums are computed: in as little flash as possible, or by a table of 16 KiB.
#[cfg(not(feature = "fast-checksum"))]
pub(crate) type Checksum = crc::NoTable;
#[cfg(feature = "fast-checksum")]
pub(crate) type Checksum = crc::Table<16>;

/// CRC-32 (IEEE 802.3) over header and body.
pub(crate) static CRC: crc::Crc<u32, Checksum> =
    crc::Crc::<u32, Checksum>::new(&crc::CRC_32_ISO_HDLC);

/// The body as postcard sees it: byte strings of fixed-width records.
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
