//! Names of what arrays hold: indices with a type of their own.
//!
//! A generated module has a constant for each joint, body, point, parameter and input, such as
//! `sixbar::joint::GROUND_EAST`. They index the arrays of the module, and slices: `state.q[EAST]`.

use core::fmt;
use core::ops::{Index, IndexMut};

/// Defines an index.
macro_rules! names {
    ($($(#[doc = $doc:literal])+ $name:ident;)+) => {
        $(
            $(#[doc = $doc])+
            #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
            #[cfg_attr(feature = "defmt", derive(defmt::Format))]
            pub struct $name(usize);

            impl $name {
                /// The one at this place.
                pub const fn new(index: usize) -> Self {
                    Self(index)
                }

                /// Its place.
                pub const fn index(self) -> usize {
                    self.0
                }
            }

            impl From<$name> for usize {
                fn from(name: $name) -> usize {
                    name.0
                }
            }

            impl fmt::Display for $name {
                fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
                    self.0.fmt(out)
                }
            }

            impl<T> Index<$name> for [T] {
                type Output = T;

                #[inline]
                fn index(&self, name: $name) -> &T {
                    &self[name.0]
                }
            }

            impl<T> IndexMut<$name> for [T] {
                #[inline]
                fn index_mut(&mut self, name: $name) -> &mut T {
                    &mut self[name.0]
                }
            }
        )+
    };
}

names! {
    /// A joint: its place in q, u, du/dt, motor torques, reactions and `JOINTS`.
    Joint;
    /// A body: its place in the poses and in `BODIES`.
    Body;
    /// A point: its place in the points and in `POINTS`.
    Point;
    /// A parameter: its place in [`Change::parameters`](crate::plumbing::Change::parameters).
    Parameter;
    /// An input: its place in [`Change::inputs`](crate::plumbing::Change::inputs).
    Input;
}
