//! Any text as the formula of a torque.
#![no_main]

libfuzzer_sys::fuzz_target!(|formula: &str| {
    let quoted = format!("{formula:?}");
    lamc_fuzz::read(&format!(
        "name: m
parameters: {{ k: 0.5 }}
inputs: [motor]
bodies: {{ base: {{ fixed: true }}, arm: {{ point_masses: [{{ mass: 1, at: [1, 0, 0] }}] }} }}
joints: {{ j: {{ bodies: [base, arm], axis: [[0, 0], [0, 1]], torque: {quoted} }} }}
"
    ));
});
