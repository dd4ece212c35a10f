#![no_main]

libfuzzer_sys::fuzz_target!(
    init: tpg_fuzz::write_seeds("configuration"),
    |data: &[u8]| tpg_fuzz::configuration(data)
);
