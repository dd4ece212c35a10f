//! QEMU's boards mps2-an385 (Cortex-M3) and mps2-an386 (Cortex-M4F): serial line, timer, free memory.

/// Memory that holds nothing of the program; QEMU can load a file to its start.
pub const SPARE: *mut u8 = 0x2100_0000 as *mut u8;
/// Bytes of [`SPARE`].
pub const SPARE_BYTES: usize = 16 << 20;

/// Processor clock, also that of the timers, in hertz.
pub const CLOCK_HZ: u32 = 25_000_000;

/// A register of a peripheral of these boards.
#[derive(Clone, Copy)]
struct Register(usize);

impl Register {
    fn read(self) -> u32 {
        // SAFETY: only this module makes registers, all of them of peripherals that these boards have.
        unsafe { (self.0 as *const u32).read_volatile() }
    }

    fn write(self, value: u32) {
        // SAFETY: as above; none of these registers leads the peripheral to memory.
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
    /// The processor's registers for the line's interrupt, number 0: enable, no longer pending.
    const ENABLE: Register = Register(0xe000_e100);
    const UNPEND: Register = Register(0xe000_e280);

    /// Switches the line on; QEMU ignores the rate.
    #[must_use]
    pub fn start() -> Self {
        Self::DIVIDER.write(16);
        // Send, receive, interrupt when a byte has come; nobody handles it, it only ends a wait.
        Self::CONTROL.write(0b1011);
        #[cfg(target_arch = "arm")]
        // SAFETY: masks interrupts, of which the examples handle none.
        unsafe {
            core::arch::asm!("cpsid i");
        }
        Self::ENABLE.write(1);
        Uart(())
    }

    /// The next byte, if one has come.
    pub fn read(&mut self) -> Option<u8> {
        (Self::STATE.read() & 2 != 0).then(|| Self::DATA.read() as u8)
    }

    /// Waits for the next byte, the processor asleep.
    pub fn wait(&mut self) -> u8 {
        loop {
            Self::INTERRUPT.write(2);
            Self::UNPEND.write(1);
            if let Some(byte) = self.read() {
                return byte;
            }
            #[cfg(target_arch = "arm")]
            // SAFETY: sleeps until an interrupt is pending, which a byte since the look above has made it.
            unsafe {
                core::arch::asm!("wfi");
            }
        }
    }

    /// Sends a byte when there is room for it.
    pub fn write(&mut self, byte: u8) {
        while Self::STATE.read() & 1 != 0 {}
        Self::DATA.write(u32::from(byte));
    }
}

/// Counts executed instructions by timer 0, under `qemu-system-arm -icount shift=3`: one takes 8 ns, a tick 40 ns.
#[derive(Debug)]
pub struct InstructionCounter(());

impl InstructionCounter {
    const CONTROL: Register = Register(0x4000_0000);
    const VALUE: Register = Register(0x4000_0004);
    const RELOAD: Register = Register(0x4000_0008);

    /// Starts the timer.
    #[must_use]
    pub fn start() -> Self {
        Self::RELOAD.write(u32::MAX);
        Self::VALUE.write(u32::MAX);
        Self::CONTROL.write(1);
        InstructionCounter(())
    }

    /// Instructions so far, to a multiple of 5, modulo 2^32.
    #[must_use]
    pub fn now(&self) -> u32 {
        u32::MAX.wrapping_sub(Self::VALUE.read()).wrapping_mul(5)
    }
}
