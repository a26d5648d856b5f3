//! The target whose name is in the variable `TARGET`: one program for all of them is compiled once.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| lamc_fuzz::run(input));
