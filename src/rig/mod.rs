//! Rigs: robot, cameras and features, what is known of them, what is free and what is held.
mod types;

pub use types::*;
