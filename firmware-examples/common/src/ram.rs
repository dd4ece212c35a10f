//! RAM used in place of flash on emulated boards. It keeps its contents over a reset. Erasing and writing work as in
//! flash.

use core::ops::Range;

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};

use crate::slots::Flash;

/// Memory at a fixed address, used as flash.
#[derive(Debug)]
pub struct RamFlash {
    start: *mut u8,
    bytes: usize,
}

impl RamFlash {
    /// Uses `bytes` bytes of memory from `start` as flash.
    ///
    /// # Safety
    /// The memory must be valid for reads and writes and nothing else may use it, for as long as the program runs.
    #[must_use]
    pub const unsafe fn new(start: *mut u8, bytes: usize) -> Self {
        RamFlash { start, bytes }
    }

    fn check(&self, from: u32, to: usize, unit: usize) -> Result<(), NorFlashErrorKind> {
        if from as usize > to || to > self.bytes {
            return Err(NorFlashErrorKind::OutOfBounds);
        }
        if !(from as usize).is_multiple_of(unit) || !to.is_multiple_of(unit) {
            return Err(NorFlashErrorKind::NotAligned);
        }
        Ok(())
    }

    /// Replaces `len` bytes from offset `from`. `new` gives a byte from its index and its old value.
    fn change(&mut self, from: u32, len: usize, new: impl Fn(usize, u8) -> u8) {
        for k in 0..len {
            // SAFETY: Callers have checked the range, and only this value uses that memory.
            unsafe {
                let place = self.start.add(from as usize + k);
                place.write_volatile(new(k, place.read_volatile()));
            }
        }
    }
}

impl ErrorType for RamFlash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for RamFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        self.check(offset, offset as usize + bytes.len(), 1)?;
        let part = self.mapped(offset..offset + bytes.len() as u32);
        bytes.copy_from_slice(part);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes
    }
}

impl NorFlash for RamFlash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = 4096;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        self.check(from, to as usize, Self::ERASE_SIZE)?;
        self.change(from, (to - from) as usize, |_, _| 0xff);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        self.check(offset, offset as usize + bytes.len(), Self::WRITE_SIZE)?;
        // A write can only clear bits, as in flash.
        self.change(offset, bytes.len(), |k, old| {
            old & bytes.get(k).copied().unwrap_or(0xff)
        });
        Ok(())
    }
}

impl Flash for RamFlash {
    fn mapped(&self, part: Range<u32>) -> &'static [u8] {
        if part.start > part.end || part.end as usize > self.bytes {
            return &[];
        }
        // SAFETY: The range lies within this value's memory, which exists as long as the program runs. The slots change
        // only ranges that nothing reads any more.
        unsafe { core::slice::from_raw_parts(self.start.add(part.start as usize), part.len()) }
    }
}
