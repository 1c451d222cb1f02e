//! What a known rig is for: pixels and points to poses and joints, with covariance, and poses to joints.
mod box_step;
mod branch;
mod closest;
mod history;
mod information;
mod inverse;
mod joint_box;
mod joints;
mod pixel_error;
mod pose;
mod pose_error;
mod prior;
mod search;
mod sighting;
mod starts;
mod tip;
mod views;

pub(crate) use views::{Glance, Views};

pub use branch::Branch;
pub use history::Moment;
pub use inverse::{InverseKinematics, InverseOptions, Reached};
pub use joints::{InferOptions, Inference};
pub use pose::InferredPose;
pub use prior::Prior;
pub use sighting::{Names, PointSighting, Sighting, Sightings};
pub use tip::TipInference;
