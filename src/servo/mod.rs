//! Constrained motion to a goal: tasks and limits are rows, and one step meets them all.
//!
//! A step is one constrained Gauss-Newton step of the graph that calibration minimises, with only the joints free:
//! [`tasks`] say where to go, each with a standard deviation, so that tasks in pixels, metres and radians add up; [`limits`] say what
//! must not happen. A [`Stepper`] gathers their rows from a rig, and a [`MotionSolver`] finds the motion from rows, wherever they come
//! from. Everything is kept between steps: a loop with goals of one priority allocates nothing of its own after its first step.
mod approach;
mod arm;
mod controller;
mod gain;
mod image_based;
pub mod image_tasks;
mod interaction_matrix;
mod joint_bounds;
mod known_arm;
pub mod limits;
mod model_based;
mod model_based_tip;
mod motion_solver;
mod pixel_reader;
mod pose_based;
mod prediction_bounds;
mod readings;
mod rig_foresight;
mod rows;
mod servo_loop;
mod step;
mod stop;
mod takes;
mod target_watch;
pub mod tasks;
mod tracker_watch;
pub mod uncalibrated;
mod uncalibrated_joints;
mod uncalibrated_task;

pub use crate::recording::Command;
pub use approach::stretched;
pub use arm::{Arm, Configuration, Sight};
pub use controller::{Controller, Decision, Measurement};
pub use gain::Gain;
pub use image_based::{Depth, ImageBased, ImageSettings};
pub use interaction_matrix::InteractionMatrix;
pub use joint_bounds::{Bound, JointBounds};
pub use limits::Limit;
pub use model_based::ModelBased;
pub use model_based_tip::ModelBasedTip;
pub use motion_solver::{Active, Constraint, MotionSolver, Step};
pub use pose_based::{PoseBased, PoseSettings};
pub use prediction_bounds::PredictionBounds;
pub use rows::{LimitRows, TaskRows};
pub use servo_loop::{LoopSettings, ServoLoop, Tick};
pub use step::{Goal, Stepper};
pub use stop::Stop;
pub use takes::Takes;
pub use tasks::Task;
pub use uncalibrated_joints::UncalibratedJoints;
pub use uncalibrated_task::UncalibratedTask;
