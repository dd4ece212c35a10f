//! Simulated flash for tests on a host. It erases and writes as flash does. A test can cut its power after any byte.

extern crate std;

use core::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};
use std::vec::Vec;

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};

use crate::slots::Flash;

/// Simulated flash. Clones share their contents, as successive starts of a board do.
#[derive(Debug, Clone)]
pub struct SimFlash {
    state: Arc<Mutex<State>>,
}

#[derive(Debug)]
struct State {
    bytes: Vec<u8>,
    /// How many more bytes can be erased or written before the power is cut.
    power: u64,
    /// How many bytes were erased or written so far.
    used: u64,
    /// The value of the byte that was being changed when the power was cut. `None` leaves the byte as it was.
    torn: Option<u8>,
}

impl SimFlash {
    /// New memory of `bytes` bytes. It is not erased: every byte is 0x3c.
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

    /// Cuts the power after `bytes` more bytes are erased or written. Later changes fail and have no effect, except on
    /// the one byte set by [`tear`](Self::tear).
    pub fn cut_after(&self, bytes: u64) {
        self.with(|state| state.power = bytes);
    }

    /// Sets the value that the byte being changed has after the power cut.
    pub fn tear(&self, value: u8) {
        self.with(|state| state.torn = Some(value));
    }

    /// How many bytes were erased or written so far.
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
                    // Only the first byte after the cut gets the torn value.
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
        // Some flash memories refuse a second write without an erase, so this one does too.
        self.change(part, Self::WRITE_SIZE, |k, old| {
            (old == 0xff).then(|| bytes[k])
        })
    }
}

impl Flash for SimFlash {
    /// Returns a copy that is never freed. Tests are short, so the leak does not matter.
    fn mapped(&self, part: Range<u32>) -> &'static [u8] {
        self.with(|state| {
            let part = part.start as usize..part.end as usize;
            state.bytes.get(part).unwrap_or_default().to_vec().leak()
        })
    }
}
