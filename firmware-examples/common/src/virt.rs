//! QEMU's RISC-V board virt: serial line, instruction counter, free memory.

/// Memory that holds nothing of the program; QEMU can load a file to its start.
pub const SPARE: *mut u8 = 0x8100_0000 as *mut u8;
/// Bytes of [`SPARE`].
pub const SPARE_BYTES: usize = 16 << 20;

/// The serial line (NS16550A).
#[derive(Debug)]
pub struct Uart(());

impl Uart {
    const DATA: usize = 0x1000_0000;
    const STATE: usize = 0x1000_0005;

    /// Switches the line on; QEMU's needs nothing to be set.
    #[must_use]
    pub fn start() -> Self {
        Uart(())
    }

    /// The next byte, if one has come.
    pub fn read(&mut self) -> Option<u8> {
        (Self::state() & 1 != 0).then(|| {
            // SAFETY: the data register of a peripheral that this board has.
            unsafe { (Self::DATA as *const u8).read_volatile() }
        })
    }

    /// Waits for the next byte.
    pub fn wait(&mut self) -> u8 {
        loop {
            if let Some(byte) = self.read() {
                return byte;
            }
        }
    }

    /// Sends a byte when there is room for it.
    pub fn write(&mut self, byte: u8) {
        while Self::state() & 0x20 == 0 {}
        // SAFETY: as above.
        unsafe { (Self::DATA as *mut u8).write_volatile(byte) }
    }

    fn state() -> u8 {
        // SAFETY: the line status register; reading it clears error bits that nobody uses.
        unsafe { (Self::STATE as *const u8).read_volatile() }
    }
}

/// Counts executed instructions (`minstret`), exactly under `qemu-system-riscv32 -icount shift=0`.
#[derive(Debug)]
pub struct InstructionCounter(());

impl InstructionCounter {
    /// The counter, which always runs.
    #[must_use]
    pub fn start() -> Self {
        InstructionCounter(())
    }

    /// Instructions so far, modulo 2^32.
    #[cfg(target_arch = "riscv32")]
    #[must_use]
    pub fn now(&self) -> u32 {
        let count: u32;
        // SAFETY: reads a counter.
        unsafe { core::arch::asm!("csrr {}, minstret", out(reg) count) }
        count
    }
}
