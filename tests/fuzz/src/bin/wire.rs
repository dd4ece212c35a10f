#![no_main]

libfuzzer_sys::fuzz_target!(
    init: tpg_fuzz::write_seeds("wire"),
    |data: &[u8]| tpg_fuzz::wire(data)
);
