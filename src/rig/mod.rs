//! Rigs: robot, cameras and features, what is known of them, what is free and what is held.
mod names;
mod paths;
mod read;
mod replace;
mod rotations;
mod types;
mod write;

pub use paths::{CameraField, JointField, Parameter, matches};
pub use types::*;
