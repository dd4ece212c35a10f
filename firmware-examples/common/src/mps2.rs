//! Serial line, timer and free memory of QEMU's boards mps2-an385 (Cortex-M3) and mps2-an386 (Cortex-M4F).

/// Start of memory that the program does not use. QEMU can load a file there.
pub const SPARE: *mut u8 = 0x2100_0000 as *mut u8;
/// Size of the memory at [`SPARE`], in bytes.
pub const SPARE_BYTES: usize = 16 << 20;

/// The clock of the processor and of the timers, in hertz.
pub const CLOCK_HZ: u32 = 25_000_000;

/// A register of a peripheral of these boards.
#[derive(Clone, Copy)]
struct Register(usize);

impl Register {
    fn read(self) -> u32 {
        // SAFETY: Only this module creates registers. Each belongs to a peripheral that these boards have.
        unsafe { (self.0 as *const u32).read_volatile() }
    }

    fn write(self, value: u32) {
        // SAFETY: As in `read`. In addition, none of these registers makes a peripheral access memory.
        unsafe { (self.0 as *mut u32).write_volatile(value) }
    }
}

/// The first serial line (CMSDK UART 0).
#[derive(Debug)]
pub struct Uart(());

impl Uart {
    const DATA: Register = Register(0x4000_4000);
    const STATE: Register = Register(0x4000_4004);
    const CONTROL: Register = Register(0x4000_4008);
    const INTERRUPT: Register = Register(0x4000_400c);
    const DIVIDER: Register = Register(0x4000_4010);
    /// The processor's registers for the line's interrupt, number 0. This one enables it, `UNPEND` clears it.
    const ENABLE: Register = Register(0xe000_e100);
    const UNPEND: Register = Register(0xe000_e280);

    /// Switches the serial line on. QEMU ignores the baud rate.
    #[must_use]
    pub fn start() -> Self {
        Self::DIVIDER.write(16);
        // Enable sending, receiving and the receive interrupt. No handler runs. The interrupt only ends a wait.
        Self::CONTROL.write(0b1011);
        #[cfg(target_arch = "arm")]
        // SAFETY: This masks interrupts. The examples handle none.
        unsafe {
            core::arch::asm!("cpsid i");
        }
        Self::ENABLE.write(1);
        Uart(())
    }

    /// The next received byte, or `None` if there is none. Does not wait.
    pub fn read(&mut self) -> Option<u8> {
        (Self::STATE.read() & 2 != 0).then(|| Self::DATA.read() as u8)
    }

    /// Waits for the next byte and returns it. The processor sleeps meanwhile.
    pub fn wait(&mut self) -> u8 {
        loop {
            Self::INTERRUPT.write(2);
            Self::UNPEND.write(1);
            if let Some(byte) = self.read() {
                return byte;
            }
            #[cfg(target_arch = "arm")]
            // SAFETY: This only sleeps until an interrupt is pending. A byte that arrives after `read` above makes it
            // pending, so the sleep ends.
            unsafe {
                core::arch::asm!("wfi");
            }
        }
    }

    /// Waits until there is room for a byte, then sends it.
    pub fn write(&mut self, byte: u8) {
        while Self::STATE.read() & 1 != 0 {}
        Self::DATA.write(u32::from(byte));
    }
}

/// Counts executed instructions with timer 0, under `qemu-system-arm -icount shift=3`. An instruction then takes 8 ns
/// and a timer tick 40 ns.
#[derive(Debug)]
pub struct InstructionCounter(());

impl InstructionCounter {
    const CONTROL: Register = Register(0x4000_0000);
    const VALUE: Register = Register(0x4000_0004);
    const RELOAD: Register = Register(0x4000_0008);

    /// Starts timer 0 and returns the counter.
    #[must_use]
    pub fn start() -> Self {
        Self::RELOAD.write(u32::MAX);
        Self::VALUE.write(u32::MAX);
        Self::CONTROL.write(1);
        InstructionCounter(())
    }

    /// The number of instructions so far, modulo 2^32. The resolution is 5 instructions.
    #[must_use]
    pub fn now(&self) -> u32 {
        u32::MAX.wrapping_sub(Self::VALUE.read()).wrapping_mul(5)
    }
}
