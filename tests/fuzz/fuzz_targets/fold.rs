//! The target `fold` of the fuzzer.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| lamc_fuzz::run("fold", input));
