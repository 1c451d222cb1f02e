//! Constrained motion to a goal: tasks and limits are rows, and one step meets them all.
//!
//! A step is one constrained Gauss-Newton step of the graph that calibration minimises, with only the joints free:
//! [`tasks`] say where to go, each with a standard deviation, so that tasks in pixels, metres and radians add up; [`limits`] say what
//! must not happen. A [`Stepper`] gathers their rows from a rig, and a [`MotionSolver`] finds the motion from rows, wherever they come
//! from. Everything is kept between steps: a loop with goals of one priority allocates nothing of its own after its first step.
mod arm;
mod joint_bounds;
pub mod limits;
mod model_based;
mod motion_solver;
mod rows;
mod step;
pub mod tasks;

pub use arm::{Arm, Configuration, Sight};
pub use joint_bounds::{Bound, JointBounds};
pub use limits::Limit;
pub use model_based::ModelBased;
pub use motion_solver::{Active, Constraint, MotionSolver, Step};
pub use rows::{LimitRows, TaskRows};
pub use step::{Goal, Stepper};
pub use tasks::Task;
