//! A rig as files that others read: its arm in a URDF, its cameras' intrinsics, where they stand in ROS.
mod cameras;
mod transforms;
mod unit;
mod urdf;

pub use cameras::{to_camchain, to_intrinsics};
pub use transforms::{to_static_transforms, to_tf};
pub use unit::note_on_unit;
pub use urdf::to_urdf;
