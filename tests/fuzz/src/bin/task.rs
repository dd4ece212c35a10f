#![no_main]

libfuzzer_sys::fuzz_target!(
    init: tpg_fuzz::write_seeds("task"),
    |data: &[u8]| tpg_fuzz::task(data)
);
