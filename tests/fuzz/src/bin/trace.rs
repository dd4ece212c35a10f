#![no_main]

libfuzzer_sys::fuzz_target!(
    init: tpg_fuzz::write_seeds("trace"),
    |data: &[u8]| tpg_fuzz::trace(data)
);
