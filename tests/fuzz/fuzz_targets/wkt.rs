//! Any text as the geometry of a popupCAD part.
#![no_main]

const DESIGN: &str = include_str!("../../data/drawings/drawn_pendulum.cad.joints");

libfuzzer_sys::fuzz_target!(|geometry: &str| {
    let begin = DESIGN.find("['POLYGON").unwrap_or_default();
    let end = begin + DESIGN[begin..].find("']").unwrap_or_default() + 2;
    lamc_fuzz::read(&format!("{}[{geometry:?}]{}", &DESIGN[..begin], &DESIGN[end..]));
});
