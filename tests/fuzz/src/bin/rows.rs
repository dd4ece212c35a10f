#![no_main]

libfuzzer_sys::fuzz_target!(
    init: tpg_fuzz::write_seeds("rows"),
    |data: &[u8]| tpg_fuzz::rows(data)
);
