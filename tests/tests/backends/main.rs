//! The output of the backends, compiled and executed: Rust, C and machine code against the interpreter.

mod c;
mod c_algorithms;
mod c_constants;
mod c_free;
mod compiled;
mod compiled_random;
mod config;
mod functions;
mod generated;
mod jacobian_params;
mod jit;
mod lanes;
mod loops;
mod machine_code;
mod parametric;
mod readable;
mod reduction;
mod reserved;
mod selections;
mod serialised;
mod single;
mod special;
mod tables;
