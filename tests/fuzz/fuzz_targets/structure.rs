//! The target `structure` of the fuzzer.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| lamc_fuzz::run("structure", input));
