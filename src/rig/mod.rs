//! Rigs: robot, cameras and features, what is known of them, what is free and what is held.
pub mod catalog;
mod model;
mod names;
mod paths;
pub(crate) mod read;
mod replace;
mod types;
mod values;
mod write;

pub use model::{Model, ModelCamera, ModelFeature};
pub(crate) use names::{problem_of_joint_name, problem_of_name};
pub use paths::{CameraField, JointField, Parameter, matches};
pub use read::{files_named, read_text};
pub(crate) use read::{problem_of_distortion, problem_of_fixed};
pub use replace::replace_file;
pub use types::*;
pub use values::Value;
