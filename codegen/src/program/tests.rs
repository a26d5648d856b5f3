//! The program as bytes, its table of signatures, and random functions for the tests of what works on programs.

pub mod random;
mod serial;
mod signatures;
