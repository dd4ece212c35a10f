#![no_main]

libfuzzer_sys::fuzz_target!(
    init: tpg_fuzz::write_seeds("loader"),
    |data: &[u8]| tpg_fuzz::loader(data)
);
