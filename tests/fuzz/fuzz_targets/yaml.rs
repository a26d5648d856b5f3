//! Any text as a model, in lamc's schema or popupCAD's.
#![no_main]

libfuzzer_sys::fuzz_target!(|text: &str| lamc_fuzz::read(text));
