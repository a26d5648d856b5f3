//! FOLD 1.1 and 1.2, the exchange format of crease patterns (<https://github.com/edemaine/fold>).

mod angles;
mod frames;
mod graph;
mod json;
mod read;
mod unfold;
mod write;

pub use read::read;
pub use write::write;
