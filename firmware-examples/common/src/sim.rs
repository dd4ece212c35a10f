//! Simulated flash for tests on a host: erased and written as flash is, and cut off wherever a test says.

extern crate std;

use core::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};
use std::vec::Vec;

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};

use crate::slots::Flash;

/// Flash whose contents outlive it: clones share them, as one start of a board after another does.
#[derive(Debug, Clone)]
pub struct SimFlash {
    state: Arc<Mutex<State>>,
}

#[derive(Debug)]
struct State {
    bytes: Vec<u8>,
    /// Bytes that can still be erased or written before the power is cut.
    power: u64,
    /// Bytes that were erased or written so far.
    used: u64,
    /// What a byte reads as whose change the power did not outlast; as before if none.
    torn: Option<u8>,
}

impl SimFlash {
    /// New memory, full of whatever was in it.
    #[must_use]
    pub fn new(bytes: usize) -> Self {
        let state = State {
            bytes: std::vec![0x3c; bytes],
            power: u64::MAX,
            used: 0,
            torn: None,
        };
        SimFlash {
            state: Arc::new(Mutex::new(state)),
        }
    }

    /// Cuts the power after so many more bytes are erased or written; what comes then fails and changes nothing.
    pub fn cut_after(&self, bytes: u64) {
        self.with(|state| state.power = bytes);
    }

    /// Makes the byte that is being changed when the power is cut read as this from then on.
    pub fn tear(&self, value: u8) {
        self.with(|state| state.torn = Some(value));
    }

    /// Bytes that were erased or written so far.
    #[must_use]
    pub fn used(&self) -> u64 {
        self.with(|state| state.used)
    }

    fn with<T>(&self, f: impl FnOnce(&mut State) -> T) -> T {
        f(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn change(
        &self,
        part: Range<usize>,
        unit: usize,
        new: impl Fn(usize, u8) -> Option<u8>,
    ) -> Result<(), NorFlashErrorKind> {
        self.with(|state| {
            if part.start > part.end || part.end > state.bytes.len() {
                return Err(NorFlashErrorKind::OutOfBounds);
            }
            if !part.start.is_multiple_of(unit) || !part.end.is_multiple_of(unit) {
                return Err(NorFlashErrorKind::NotAligned);
            }
            for (k, byte) in state.bytes[part].iter_mut().enumerate() {
                if state.power == 0 {
                    // Only the first byte after the cut is half changed.
                    *byte = state.torn.take().unwrap_or(*byte);
                    return Err(NorFlashErrorKind::Other);
                }
                state.power -= 1;
                state.used += 1;
                *byte = new(k, *byte).ok_or(NorFlashErrorKind::Other)?;
            }
            Ok(())
        })
    }
}

impl ErrorType for SimFlash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for SimFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        let end = offset + bytes.len() as u32;
        bytes.copy_from_slice(self.mapped(offset..end));
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.with(|state| state.bytes.len())
    }
}

impl NorFlash for SimFlash {
    const WRITE_SIZE: usize = 8;
    const ERASE_SIZE: usize = 512;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        let part = from as usize..to as usize;
        self.change(part, Self::ERASE_SIZE, |_, _| Some(0xff))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        let start = offset as usize;
        let part = start..start + bytes.len();
        // Written twice without an erasure in between: some memories refuse that, so this one does.
        self.change(part, Self::WRITE_SIZE, |k, old| {
            (old == 0xff).then(|| bytes[k])
        })
    }
}

impl Flash for SimFlash {
    /// A copy that is never freed: tests are short.
    fn mapped(&self, part: Range<u32>) -> &'static [u8] {
        self.with(|state| {
            let part = part.start as usize..part.end as usize;
            state.bytes.get(part).unwrap_or_default().to_vec().leak()
        })
    }
}
