//! The examples' panic handler. It stops the program. `scripts/check-bare-metal` checks that no decision calls it.

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
