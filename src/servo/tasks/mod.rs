//! Tasks: where a motion shall lead; one file each.
mod image_points;
mod joint_target;
mod look_at;
mod manipulability;
mod tip_pose;

pub use image_points::ImagePoints;
pub use joint_target::JointTarget;
pub use look_at::LookAt;
pub use manipulability::{Manipulability, TipMotion};
pub use tip_pose::TipPose;

use super::{Arm, Configuration, TaskRows};

/// A goal that a step leads towards.
pub trait Task {
    /// Adds rows: the change that is wanted of something, and how it changes with the joints.
    fn rows(&self, arm: &Arm, at: &Configuration, rows: &mut TaskRows);
}
