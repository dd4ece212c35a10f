//! The panic handler of the examples: stops. No decision leads here; `scripts/check-bare-metal` looks.

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
