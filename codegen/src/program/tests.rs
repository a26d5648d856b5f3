//! The program as bytes, and random functions for the tests of what works on programs.

pub mod random;
mod serial;
