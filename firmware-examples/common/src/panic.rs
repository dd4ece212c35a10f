//! The panic handler of the examples stops the program. No decision calls it: `scripts/check-bare-metal` checks that.

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
