//! Serial line, instruction counter and free memory of QEMU's RISC-V board `virt`.

/// Start of memory that the program does not use. QEMU can load a file there.
pub const SPARE: *mut u8 = 0x8100_0000 as *mut u8;
/// Size of the memory at [`SPARE`], in bytes.
pub const SPARE_BYTES: usize = 16 << 20;

/// The serial line (NS16550A).
#[derive(Debug)]
pub struct Uart(());

impl Uart {
    const DATA: usize = 0x1000_0000;
    const STATE: usize = 0x1000_0005;

    /// Returns the serial line. QEMU's line needs no setup.
    #[must_use]
    pub fn start() -> Self {
        Uart(())
    }

    /// The next received byte, or `None` if there is none. Does not wait.
    pub fn read(&mut self) -> Option<u8> {
        (Self::state() & 1 != 0).then(|| {
            // SAFETY: This address is the data register of a peripheral that this board has.
            unsafe { (Self::DATA as *const u8).read_volatile() }
        })
    }

    /// Waits for the next byte and returns it. Polls without sleeping.
    pub fn wait(&mut self) -> u8 {
        loop {
            if let Some(byte) = self.read() {
                return byte;
            }
        }
    }

    /// Waits until there is room for a byte, then sends it.
    pub fn write(&mut self, byte: u8) {
        while Self::state() & 0x20 == 0 {}
        // SAFETY: This is the same data register as in `read`.
        unsafe { (Self::DATA as *mut u8).write_volatile(byte) }
    }

    fn state() -> u8 {
        // SAFETY: This address is the line status register. A read clears only error bits, and nothing uses those.
        unsafe { (Self::STATE as *const u8).read_volatile() }
    }
}

/// Counts executed instructions (`minstret`). The count is exact under `qemu-system-riscv32 -icount shift=0`.
#[derive(Debug)]
pub struct InstructionCounter(());

impl InstructionCounter {
    /// Returns the counter. It always runs.
    #[must_use]
    pub fn start() -> Self {
        InstructionCounter(())
    }

    /// The number of instructions so far, modulo 2^32.
    #[cfg(target_arch = "riscv32")]
    #[must_use]
    pub fn now(&self) -> u32 {
        let count: u32;
        // SAFETY: The instruction only reads a counter.
        unsafe { core::arch::asm!("csrr {}, minstret", out(reg) count) }
        count
    }
}
