//! The last two sectors of the chip's flash, 128 KiB each, for the two policy slots; `memory.x` keeps the program out.

use core::ops::Range;

use stm32f4xx_hal::{
    flash::{Error, FlashExt as _},
    pac::FLASH,
};
use tpg_board::slots::{ErrorType, Flash, NorFlash, ReadNorFlash};

/// Sectors 6 and 7 of the STM32F446 (RM0390, table 5), as distances from the begin of flash.
const PLACE: Range<u32> = 0x4_0000..0x8_0000;

/// The two sectors. While one is erased, up to four seconds, the processor waits.
pub struct SlotFlash(FLASH);

impl SlotFlash {
    /// Takes the chip's flash, and forgets errors of whoever wrote to it before, such as a debugger.
    pub fn new(flash: FLASH) -> Self {
        flash.sr().write(|w| {
            w.operr().clear_bit_by_one();
            w.wrperr().clear_bit_by_one();
            w.pgaerr().clear_bit_by_one();
            w.pgperr().clear_bit_by_one();
            w.pgserr().clear_bit_by_one()
        });
        SlotFlash(flash)
    }

    /// Whether a part lies within the two sectors: what lies beside them is the program.
    fn holds(&self, from: u32, len: usize) -> bool {
        from as usize + len <= PLACE.len()
    }
}

impl ErrorType for SlotFlash {
    type Error = Error;
}

impl ReadNorFlash for SlotFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        let part = self.mapped(offset..offset + bytes.len() as u32);
        if part.len() != bytes.len() {
            return Err(Error::Operation);
        }
        bytes.copy_from_slice(part);
        Ok(())
    }

    fn capacity(&self) -> usize {
        PLACE.len()
    }
}

impl NorFlash for SlotFlash {
    /// Byte by byte, which any supply voltage of the chip allows.
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = 128 * 1024;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Error> {
        if from > to || !self.holds(to, 0) {
            return Err(Error::Operation);
        }
        let [from, to] = [from, to].map(|offset| PLACE.start + offset);
        NorFlash::erase(&mut self.0.unlocked(), from, to)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        if !self.holds(offset, bytes.len()) {
            return Err(Error::Operation);
        }
        NorFlash::write(&mut self.0.unlocked(), PLACE.start + offset, bytes)
    }
}

impl Flash for SlotFlash {
    fn mapped(&self, part: Range<u32>) -> &'static [u8] {
        if part.start > part.end || !self.holds(part.end, 0) {
            return &[];
        }
        let start = self.0.address() + (PLACE.start + part.start) as usize;
        // SAFETY: the part lies within two sectors of flash that nothing but this value changes. The slots change only
        // parts of which nobody reads any more.
        unsafe { core::slice::from_raw_parts(start as *const u8, part.len()) }
    }
}
