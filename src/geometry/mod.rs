//! Closed forms on points and poses: what estimation starts from. None of them needs a starting value.
//!
//! Points are in metres (or any other unit), bearings are unit directions in a camera's frame
//! (`CameraModel::unproject`), so that every camera model fits. Degenerate input gives `None` or an empty list.
mod alignment;
mod between;
mod daniilidis;
mod essential;
mod five_point;
mod hand_eye;
mod looking_at;
mod object_space;
pub(crate) mod orientation;
mod perspective_n_point;
mod polynomial;
mod ransac;
mod rays;
mod relative_pose;
mod reprojection;
mod resection;
mod rotation;
mod sampson;
mod triangulation;

pub use alignment::{Similarity, align, align_robust, align_similarity};
pub use between::between;
pub use daniilidis::hand_eye_daniilidis;
pub use essential::{decompose, essential, in_front_of_both};
pub use five_point::five_point;
pub use hand_eye::{hand_eye_park, robot_world};
pub use looking_at::looking_at;
pub use perspective_n_point::resect;
pub use rays::{pose_from_rays, poses_from_rays};
pub use relative_pose::{RelativePose, relative_pose, relative_pose_candidates};
pub use resection::{Resection, resect_robust};
pub use rotation::nearest_rotation;
pub use triangulation::triangulate;
