//! Serial line, instruction counter and free memory of QEMU's board microbit (Cortex-M0 of a Nordic nRF51).

/// Start of memory that the program does not use. QEMU can load a file there. It lies in the flash that the emulator is
/// told to have beyond the micro:bit's, so a program can only read it.
pub const SPARE: *mut u8 = 0x0020_0000 as *mut u8;
/// Size of the memory at [`SPARE`], in bytes.
pub const SPARE_BYTES: usize = 2 << 20;

/// A register of a peripheral of this board.
#[derive(Clone, Copy)]
struct Register(usize);

impl Register {
    fn read(self) -> u32 {
        // SAFETY: Only this module creates registers. Each belongs to a peripheral that this board has.
        unsafe { (self.0 as *const u32).read_volatile() }
    }

    fn write(self, value: u32) {
        // SAFETY: As in `read`. In addition, none of these registers makes a peripheral access memory.
        unsafe { (self.0 as *mut u32).write_volatile(value) }
    }
}

/// The serial line.
#[derive(Debug)]
pub struct Uart(());

impl Uart {
    const START_RECEIVER: Register = Register(0x4000_2000);
    const START_SENDER: Register = Register(0x4000_2008);
    const RECEIVED: Register = Register(0x4000_2108);
    const SENT: Register = Register(0x4000_211c);
    const ENABLE: Register = Register(0x4000_2500);
    const RECEIVE: Register = Register(0x4000_2518);
    const SEND: Register = Register(0x4000_251c);

    /// Switches the serial line on. QEMU ignores the baud rate.
    #[must_use]
    pub fn start() -> Self {
        Self::ENABLE.write(4);
        Self::START_RECEIVER.write(1);
        Self::START_SENDER.write(1);
        Uart(())
    }

    /// The next received byte, or `None` if there is none. Does not wait.
    pub fn read(&mut self) -> Option<u8> {
        (Self::RECEIVED.read() != 0).then(|| {
            // Cleared before the byte is taken: taking it sets the event again if another byte waits.
            Self::RECEIVED.write(0);
            Self::RECEIVE.read() as u8
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

    /// Sends a byte and waits until it is sent.
    pub fn write(&mut self, byte: u8) {
        Self::SENT.write(0);
        Self::SEND.write(u32::from(byte));
        while Self::SENT.read() == 0 {}
    }
}

/// Counts executed instructions with timer 0, under `qemu-system-arm -icount shift=6`. An instruction then takes 64 ns
/// and a timer tick 62.5 ns.
#[derive(Debug)]
pub struct InstructionCounter(());

impl InstructionCounter {
    const START: Register = Register(0x4000_8000);
    const CAPTURE: Register = Register(0x4000_8040);
    const BITS: Register = Register(0x4000_8508);
    const PRESCALER: Register = Register(0x4000_8510);
    const CAPTURED: Register = Register(0x4000_8540);

    /// Starts timer 0 with 32 bits and 16 MHz, and returns the counter.
    #[must_use]
    pub fn start() -> Self {
        Self::BITS.write(3);
        Self::PRESCALER.write(0);
        Self::START.write(1);
        InstructionCounter(())
    }

    /// The number of instructions so far, modulo 2^32. Differences are wrong once the timer, of 2^32 ticks, has run around.
    #[must_use]
    pub fn now(&self) -> u32 {
        Self::CAPTURE.write(1);
        (u64::from(Self::CAPTURED.read()) * 125 / 128) as u32
    }
}
