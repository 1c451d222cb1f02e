//! A rig as files that others read: its arm in a URDF, its cameras' intrinsics, where they stand in ROS.
mod cameras;
mod transforms;
mod urdf;

pub use cameras::{to_camchain, to_intrinsics};
pub use transforms::{to_static_transforms, to_tf};
pub use urdf::to_urdf;
