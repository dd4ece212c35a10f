//! Serial line, timer and free memory of QEMU's boards mps2-an385 (Cortex-M3), mps2-an386 (Cortex-M4F) and, with the
//! feature `an505`, mps2-an505 (Cortex-M33).

/// Start of memory that the program does not use. QEMU can load a file there.
pub const SPARE: *mut u8 = map::SPARE as *mut u8;
/// Size of the memory at [`SPARE`], in bytes.
pub const SPARE_BYTES: usize = 16 << 20;

/// The clock of the processor and of the timers, in hertz.
pub const CLOCK_HZ: u32 = map::CLOCK_HZ;

/// Where a board has what: addresses and frequencies.
#[cfg(not(feature = "an505"))]
mod map {
    pub const SPARE: usize = 0x2100_0000;
    pub const CLOCK_HZ: u32 = 25_000_000;
    pub const UART: usize = 0x4000_4000;
    /// The word of the interrupt controller with the serial line's receive interrupt, number 0 of that word.
    pub const INTERRUPT_WORD: usize = 0;
    pub const TIMER: usize = 0x4000_0000;
    /// Under `-icount shift=3`, a tick of the timer is so many instructions: 40 ns of 8 ns each.
    pub const INSTRUCTIONS_PER_TICK: (u64, u64) = (5, 1);
}

/// The secure view of the board's devices: the programs run in the secure state.
#[cfg(feature = "an505")]
mod map {
    pub const SPARE: usize = 0x8000_0000;
    pub const CLOCK_HZ: u32 = 20_000_000;
    pub const UART: usize = 0x5020_0000;
    pub const INTERRUPT_WORD: usize = 1;
    pub const TIMER: usize = 0x5000_0000;
    /// Under `-icount shift=6`, a tick of the timer is so many instructions: 50 ns of 64 ns each.
    pub const INSTRUCTIONS_PER_TICK: (u64, u64) = (25, 32);
}

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
    const DATA: Register = Register(map::UART);
    const STATE: Register = Register(map::UART + 0x04);
    const CONTROL: Register = Register(map::UART + 0x08);
    const INTERRUPT: Register = Register(map::UART + 0x0c);
    const DIVIDER: Register = Register(map::UART + 0x10);
    /// The processor's registers for the line's interrupt. This one enables it, `UNPEND` clears it.
    const ENABLE: Register = Register(0xe000_e100 + 4 * map::INTERRUPT_WORD);
    const UNPEND: Register = Register(0xe000_e280 + 4 * map::INTERRUPT_WORD);

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

/// Counts executed instructions with timer 0, under `qemu-system-arm -icount` with the shift that `boards.toml` has for
/// the board.
#[derive(Debug)]
pub struct InstructionCounter(());

impl InstructionCounter {
    const CONTROL: Register = Register(map::TIMER);
    const VALUE: Register = Register(map::TIMER + 0x04);
    const RELOAD: Register = Register(map::TIMER + 0x08);

    /// Starts timer 0 and returns the counter.
    #[must_use]
    pub fn start() -> Self {
        Self::RELOAD.write(u32::MAX);
        Self::VALUE.write(u32::MAX);
        Self::CONTROL.write(1);
        InstructionCounter(())
    }

    /// The number of instructions so far, modulo 2^32. The resolution is 5 instructions, with the feature `an505` 1.
    /// Differences are wrong once the timer, of 2^32 ticks, has run around.
    #[must_use]
    pub fn now(&self) -> u32 {
        let ticks = u64::from(u32::MAX.wrapping_sub(Self::VALUE.read()));
        let (instructions, per) = map::INSTRUCTIONS_PER_TICK;
        (ticks * instructions / per) as u32
    }
}
