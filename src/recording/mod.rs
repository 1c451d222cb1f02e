//! Recordings: what was commanded, read and seen; one file per format.
mod types;

pub use types::*;
