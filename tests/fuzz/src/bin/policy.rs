#![no_main]

libfuzzer_sys::fuzz_target!(
    init: tpg_fuzz::write_seeds("policy"),
    |data: &[u8]| tpg_fuzz::policy(data)
);
