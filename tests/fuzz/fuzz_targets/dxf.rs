//! The target `dxf` of the fuzzer.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| lamc_fuzz::run("dxf", input));
