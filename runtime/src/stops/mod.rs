mod stopped;

pub use stopped::Stopped;
