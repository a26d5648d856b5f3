//! Rules that hold for the sources themselves.

mod architecture;
