//! Residuals and derived nodes of the generative model; one file each.
mod forward_kinematics;
mod in_camera;
mod joint_action;
mod joint_reading;
mod length;
mod point_observation;
mod pose_action;
mod pose_reading;
mod readings;
mod reprojection;
mod target;

pub use forward_kinematics::ForwardKinematics;
pub use in_camera::InCamera;
pub use joint_action::JointAction;
pub use joint_reading::JointReading;
pub use length::{OriginDistance, PointDistance};
pub use point_observation::PointObservation;
pub use pose_action::{Motion, PoseAction};
pub use pose_reading::PoseReading;
pub use readings::{JointReadings, Polynomial, PoseReadings};
pub use reprojection::{Intrinsics, Reprojection};
pub use target::{CameraFromTarget, Drifting, TargetSeen};
