//! Residuals and derived nodes of the generative model; one file each.
mod forward_kinematics;
mod readings;
mod reprojection;
mod target;

pub use forward_kinematics::ForwardKinematics;
pub use readings::{JointReadings, Polynomial, PoseReadings};
pub use reprojection::{Intrinsics, Reprojection};
pub use target::TargetSeen;
