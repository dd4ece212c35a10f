#![no_main]

libfuzzer_sys::fuzz_target!(
    init: tpg_fuzz::write_seeds("session"),
    |data: &[u8]| tpg_fuzz::session(data)
);
