//! What a host and a board say to each other over a serial line; feature `wire`.
//!
//! A frame is a zero byte, then the COBS form of a postcard message and its CRC-32 (as in the file format, little-endian),
//! then a zero byte. A frame that does not decode or has a wrong checksum is dropped and counted.
//!
//! Each request has a number, and its answer repeats it. A host that gets no answer sends the request again. The board
//! keeps its last answer, so it does not decide twice. Floats travel as the bytes of their bits, little-endian.

mod answers;

use core::fmt;

pub use answers::Answers;
use postcard::ser_flavors::{Cobs, Flavor, Slice};
use serde::{Deserialize, Serialize};

use crate::blob::{Blob, CRC, CRC_BYTES, Checksum, VERSION};
use crate::isa::FINGERPRINT;
use crate::verify::Policy;

/// Version of the conversation. All versions greet with the same bytes.
pub const PROTOCOL: u16 = 2;

/// Most bytes that a frame adds to the values or the policy part it carries, for up to 8 KiB of payload.
pub const OVERHEAD: usize = 128;

/// A numbered message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Frame<M> {
    /// Number of the request. An answer repeats the number of its request.
    pub seq: u32,
    /// The message.
    pub message: M,
}

/// A request of the host. The board answers each one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Request<'a> {
    /// Asks for the board's identity and begins a conversation. The board forgets the numbers of earlier requests.
    Hello,
    /// Begin an evaluation of the agent or another of its episodes.
    Reset {
        /// `true` begins an evaluation, `false` begins an episode.
        agent: bool,
        /// Seed of the agent's random streams.
        seed: u64,
    },
    /// Choose the action for an observation.
    Observe {
        /// The observation: four bytes for each element.
        values: &'a [u8],
    },
    /// Make room for a new policy. The confirmed policy stays.
    Begin {
        /// Number of bytes of its file.
        bytes: u32,
        /// Hash of its [contract](crate::blob::contract()).
        contract: u64,
        /// Its release number.
        release: u32,
        /// Whether another contract than that of the confirmed policy is wanted.
        forced: bool,
    },
    /// Store a part of the new policy. Each part begins where the one before ended.
    Store {
        /// Offset of the part's first byte in the file.
        at: u32,
        /// The part.
        bytes: &'a [u8],
    },
    /// Check the new policy and use it from now on. The board reverts it at its next start if it is not confirmed by then.
    Commit,
    /// Ask what a slot holds.
    Slot {
        /// Number of the slot. Slot 0 is the policy that the firmware was built with.
        number: u8,
    },
    /// Give up the policy in use for the confirmed one of the other slot, or for the built-in one.
    Revert,
    /// Ask for a part of the [contract](crate::blob::contract_bytes) of the confirmed policy, to which a new one must fit.
    Contract {
        /// Offset of the part's first byte.
        at: u32,
    },
    /// Erase a slot. If it is the one in use, the board gives up its policy first.
    Erase {
        /// Number of the slot: 1 or 2.
        number: u8,
    },
}

/// An answer of the board.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Answer<'a> {
    /// The answer to [`Request::Hello`].
    Identity(Identity),
    /// The request was carried out.
    Ready,
    /// An action of a discrete policy.
    Index {
        /// Number of the action.
        index: u16,
        /// Number of instructions that the decision executed.
        instructions: u32,
    },
    /// An action of a continuous policy.
    Values {
        /// One value for each output, four bytes each.
        values: &'a [u8],
        /// Number of instructions that the decision executed.
        instructions: u32,
    },
    /// The request was not carried out. Nothing has changed.
    Refused {
        /// The reason.
        refusal: Refusal,
        /// A number that belongs to the reason. [`Refusal`] says which.
        detail: u32,
    },
    /// The answer to [`Request::Slot`].
    Slot(Stored),
    /// The answer to [`Request::Contract`].
    Contract {
        /// Bytes of the whole contract.
        total: u32,
        /// The part.
        bytes: &'a [u8],
    },
}

/// Why a board refuses a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Refusal {
    /// The observation has a wrong length. The detail is its number of elements.
    Length,
    /// The board cannot store policies. The detail is 0.
    NoSlots,
    /// The policy in use is the one that the firmware was built with, so none comes before it. The detail is 0.
    Oldest,
    /// The new policy is too long. The detail is the most bytes that the board can store.
    Room,
    /// The part does not begin where the one before ended. The detail is the offset that the board expects.
    Order,
    /// The stored bytes are not a valid policy, or the board cannot run it. The detail is the number of bytes.
    Policy,
    /// The board's agent is too small for the new policy. The detail is how much the policy needs of what is short.
    Capacity,
    /// The flash memory could not be erased or written. The detail is the offset of the failure in bytes.
    Memory,
    /// There is no such slot. The detail is its number.
    Slot,
    /// The new policy has another contract than the confirmed one, so it is one for another robot. The detail is 0.
    Robot,
    /// The stored policy has another contract than was announced. The detail is the number of bytes.
    Announced,
    /// The new policy's release number is lower than one that the board has, which is the detail.
    Release,
    /// The new policy does not count as signed by the board's key. The detail is 0 without a signature, 1 with another
    /// key's, 2 with a forged one.
    Signature,
    /// The board drives its own plant, so it decides for nobody else. The detail is 0.
    Drives,
}

impl Refusal {
    /// The reason in words, with its number if it has one.
    #[must_use]
    pub const fn explain(self, detail: u32) -> Explained {
        Explained(self, detail)
    }
}

/// A refusal in words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Explained(Refusal, u32);

impl fmt::Display for Explained {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Explained(refusal, n) = self;
        match refusal {
            Refusal::Length => {
                write!(f, "its policy takes another number of values than {n}")
            }
            Refusal::NoSlots => write!(f, "it cannot store policies"),
            Refusal::Oldest => {
                write!(
                    f,
                    "it uses the policy that its firmware was built with, and none comes before that"
                )
            }
            Refusal::Room => {
                write!(
                    f,
                    "new policy is too long, the board has room for {n} bytes"
                )
            }
            Refusal::Order => {
                write!(f, "part of the policy is out of order, due is byte {n}")
            }
            Refusal::Policy => {
                write!(f, "the {n} bytes that were stored are no valid policy")
            }
            Refusal::Capacity => write!(
                f,
                "new policy does not fit the board's agent, of what is short it needs {n}"
            ),
            Refusal::Memory => {
                write!(f, "its memory for policies cannot be written at byte {n}")
            }
            Refusal::Slot => write!(f, "it has no slot {n}"),
            Refusal::Release => {
                write!(f, "it has release {n} and takes none below that")
            }
            Refusal::Signature => f.write_str(match n {
                0 => "it takes signed policies alone, and the new one is not signed: use `tpg sign`",
                1 => "new policy is signed by another key than the board's",
                _ => "new policy is forged: its signature does not belong to these bytes and the board's key",
            }),
            Refusal::Drives => {
                write!(f, "it drives its own plant and decides for nobody else")
            }
            Refusal::Robot => {
                write!(f, "new policy is for a robot with another contract")
            }
            Refusal::Announced => {
                write!(
                    f,
                    "the {n} bytes that were stored have another contract than was announced"
                )
            }
        }
    }
}

/// What a slot holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum SlotState {
    /// No whole policy: erased, or an update was broken off.
    Empty,
    /// A policy that this firmware does not accept: damaged, too large, or of another version.
    Unusable,
    /// A policy that was not confirmed. If it is not in use, it was reverted.
    Unconfirmed,
    /// A policy that was confirmed, or the one that the firmware was built with.
    Confirmed,
}

impl SlotState {
    /// Its name in messages and reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Empty => "empty",
            Self::Unusable => "unusable",
            Self::Unconfirmed => "unconfirmed",
            Self::Confirmed => "confirmed",
        }
    }
}

/// Whether a policy is signed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Signed {
    /// The policy has no signature.
    No,
    /// The policy has a signature, which this firmware did not verify.
    Unverified,
    /// The firmware verified the signature by its key.
    Verified,
}

impl Signed {
    /// Its name in messages and reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::No => "unsigned",
            Self::Unverified => "signature not verified",
            Self::Verified => "signature verified",
        }
    }
}

/// A slot of a board and the policy in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Stored {
    /// Number of the slot. Slot 0 is the policy that the firmware was built with.
    pub number: u8,
    /// What it holds.
    pub state: SlotState,
    /// Whether the board uses this policy.
    pub in_use: bool,
    /// Bytes of the policy's file, 0 in an empty slot.
    pub bytes: u32,
    /// Checksum of the policy's file: its last four bytes.
    pub crc: u32,
    /// Format version of the policy's file, 0 in an empty slot.
    pub format: u16,
    /// Hash of the policy's [contract](crate::blob::contract()), 0 if it cannot be read.
    pub contract: u64,
    /// Release number of the policy, 0 for none.
    pub release: u32,
    /// Whether the policy is signed.
    pub signed: Signed,
}

impl Stored {
    /// The description of a slot that holds the bytes `file`, without a verified signature.
    #[must_use]
    pub fn new(number: u8, state: SlotState, in_use: bool, file: &[u8]) -> Self {
        let blob = Blob::decode(file).ok();
        let signature = blob.and_then(|blob| blob.signature());
        let version = file.get(4..).and_then(<[u8]>::first_chunk);
        Stored {
            number,
            state,
            in_use,
            bytes: u32::try_from(file.len()).unwrap_or(u32::MAX),
            crc: stored_crc(file),
            format: version.map_or(0, |version| u16::from_le_bytes(*version)),
            contract: blob.map_or(0, |blob| blob.contract()),
            release: blob.map_or(0, |blob| blob.header().release),
            signed: signature.map_or(Signed::No, |_| Signed::Unverified),
        }
    }
}

/// Hash of the contract of a policy's file, 0 if the bytes are no such file.
#[must_use]
pub fn contract_of(file: &[u8]) -> u64 {
    Blob::decode(file).map_or(0, |blob| blob.contract())
}

fn stored_crc(file: &[u8]) -> u32 {
    let last = file.last_chunk();
    last.map_or(0, |stored| u32::from_le_bytes(*stored))
}

/// The board's versions and the policy that it runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Identity {
    /// [`PROTOCOL`] of the board.
    pub protocol: u16,
    /// Version of the file format that the board reads.
    pub format: u16,
    /// Fingerprint of the board's instruction table.
    pub instruction_set: u32,
    /// Bytes of the policy's file.
    pub policy_bytes: u32,
    /// Checksum of the policy's file: its last four bytes.
    pub policy_crc: u32,
    /// The policy's provenance.
    pub provenance: [u8; 16],
    /// Slot of the policy. Slot 0 is the policy that the firmware was built with.
    pub slot: u8,
    /// Number of damaged frames that the board has dropped since it started.
    pub damaged: u32,
}

impl Identity {
    /// The identity of a board that runs a policy, read from the bytes `file`.
    #[must_use]
    pub fn new(policy: &Policy<'_>, file: &[u8]) -> Self {
        Identity {
            protocol: PROTOCOL,
            format: VERSION,
            instruction_set: FINGERPRINT,
            policy_bytes: u32::try_from(file.len()).unwrap_or(u32::MAX),
            policy_crc: stored_crc(file),
            provenance: policy.header().provenance,
            slot: 0,
            damaged: 0,
        }
    }
}

/// CRC-32 of `bytes`, as at the end of frames and policies.
#[must_use]
pub const fn checksum(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}

/// The message does not fit into the buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameTooLong;

impl fmt::Display for FrameTooLong {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "message does not fit the buffer of a frame")
    }
}

impl core::error::Error for FrameTooLong {}

/// Encodes a message with COBS and appends the checksum of the message.
struct Sealed<'b> {
    inner: Cobs<Slice<'b>>,
    digest: crc::Digest<'static, u32, Checksum>,
}

impl Flavor for Sealed<'_> {
    type Output = usize;

    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        self.digest.update(&[byte]);
        self.inner.try_push(byte)
    }

    fn finalize(mut self) -> postcard::Result<usize> {
        for byte in self.digest.finalize().to_le_bytes() {
            self.inner.try_push(byte)?;
        }
        Ok(self.inner.finalize()?.len())
    }
}

/// Writes a frame to the start of `buffer`. Returns its length in bytes.
///
/// # Errors
/// [`FrameTooLong`] if it does not fit.
pub fn write<M: Serialize>(frame: &Frame<M>, buffer: &mut [u8]) -> Result<usize, FrameTooLong> {
    let (first, rest) = buffer.split_first_mut().ok_or(FrameTooLong)?;
    *first = 0;
    let sealed = Sealed {
        inner: Cobs::try_new(Slice::new(rest)).map_err(|_| FrameTooLong)?,
        digest: CRC.digest(),
    };
    let len = postcard::serialize_with_flavor(frame, sealed).map_err(|_| FrameTooLong)?;
    Ok(len + 1)
}

/// Finds the frames in a stream of bytes. A frame longer than `N` bytes counts as damaged.
#[derive(Debug, Clone)]
pub struct Receiver<const N: usize> {
    buffer: [u8; N],
    len: usize,
    damaged: u32,
}

impl<const N: usize> Default for Receiver<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> Receiver<N> {
    /// A receiver at the start of a stream.
    #[must_use]
    pub const fn new() -> Self {
        Receiver {
            buffer: [0; N],
            len: 0,
            damaged: 0,
        }
    }

    /// Number of damaged frames dropped so far.
    #[must_use]
    pub const fn damaged(&self) -> u32 {
        self.damaged
    }

    /// Takes the next byte of the stream. Returns a frame if the byte completes an undamaged one.
    pub fn push<'b, M: Deserialize<'b>>(&'b mut self, byte: u8) -> Option<Frame<M>> {
        if byte != 0 {
            // Bytes past the buffer are dropped but still counted. The length then shows that the frame is damaged.
            if let Some(place) = self.buffer.get_mut(self.len) {
                *place = byte;
            }
            self.len = self.len.saturating_add(1);
            return None;
        }
        let len = core::mem::take(&mut self.len);
        if len == 0 {
            return None;
        }
        let Self {
            buffer, damaged, ..
        } = self;
        let frame = unseal(buffer.get_mut(..len).unwrap_or_default());
        if frame.is_none() {
            *damaged = damaged.saturating_add(1);
        }
        frame
    }
}

fn unseal<'b, M: Deserialize<'b>>(encoded: &'b mut [u8]) -> Option<Frame<M>> {
    let len = cobs::decode_in_place(encoded).ok()?;
    let encoded: &'b [u8] = encoded;
    let (message, stored) = encoded.get(..len)?.split_last_chunk::<CRC_BYTES>()?;
    if CRC.checksum(message) != u32::from_le_bytes(*stored) {
        return None;
    }
    match postcard::take_from_bytes(message) {
        Ok((frame, [])) => Some(frame),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    const REQUEST: Frame<Request<'static>> = Frame {
        seq: 77,
        message: Request::Observe {
            values: &[0, 0, 128, 63, 0, 0, 0, 0],
        },
    };

    fn encoded() -> Vec<u8> {
        let mut buffer = [0xaa; 64];
        let len = write(&REQUEST, &mut buffer).expect("it fits");
        buffer[..len].to_vec()
    }

    /// Feeds bytes to a receiver. Returns how many good frames came out and how many were dropped.
    fn feed(bytes: &[u8]) -> (usize, u32) {
        let mut receiver = Receiver::<64>::new();
        let mut good = 0;
        for byte in bytes {
            if let Some(frame) = receiver.push::<Request<'_>>(*byte) {
                assert_eq!(frame, REQUEST);
                good += 1;
            }
        }
        (good, receiver.damaged())
    }

    #[test]
    fn frames_survive_one_after_another() {
        let bytes = encoded();
        assert_eq!(bytes.first(), Some(&0));
        assert_eq!(bytes.last(), Some(&0));
        assert!(!bytes[1..bytes.len() - 1].contains(&0));
        assert_eq!(feed(&bytes.repeat(3)), (3, 0));
    }

    #[test]
    fn every_flipped_bit_and_missing_byte_costs_one_frame_at_most() {
        let bytes = encoded();
        for at in 1..bytes.len() - 1 {
            for bit in 0..8 {
                let mut noisy = bytes.clone();
                noisy[at] ^= 1 << bit;
                noisy.extend(&bytes);
                let (good, damaged) = feed(&noisy);
                assert!(
                    good == 1 && (1..=2).contains(&damaged),
                    "byte {at} bit {bit}"
                );
            }
            let mut short = bytes.clone();
            short.remove(at);
            short.extend(&bytes);
            assert_eq!(feed(&short), (1, 1), "without byte {at}");
        }
    }

    #[test]
    fn overlong_noise_is_one_damaged_frame() {
        let mut noise = std::vec![0x55; 10_000];
        noise.extend(encoded());
        assert_eq!(feed(&noise), (1, 1));
        let mut buffer = [0; 10];
        assert_eq!(write(&REQUEST, &mut buffer), Err(FrameTooLong));
    }
}
