//! What a solver may move: vectors, rotations, rigid poses and unit directions, each with its own small steps.
mod direction;
mod pose;
mod rotation;
pub mod so3;
mod variable;
mod vector;

pub use direction::Direction;
pub use pose::Pose;
pub use rotation::Rotation;
pub use variable::Variable;
pub use vector::{DynamicVector, Vector};
