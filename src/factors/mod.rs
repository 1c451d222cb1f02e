//! Residuals and derived nodes of the generative model; one file each.
mod forward_kinematics;
mod reprojection;

pub use forward_kinematics::ForwardKinematics;
pub use reprojection::{Intrinsics, Reprojection};
