//! Constrained motion to a goal: tasks and limits are rows, and one step meets them all.
//!
//! A step is one constrained Gauss-Newton step of the graph that calibration minimises, with only the joints free:
//! [`tasks`] say where to go, each with a standard deviation, so that tasks in pixels, metres and radians add up; [`limits`] say what
//! must not happen; [`Stepper`] finds the motion. Everything is kept between steps: a
//! loop with goals of one priority allocates nothing of its own after its first step.
mod arm;
mod joint_bounds;
pub mod limits;
mod model_based;
mod rows;
mod step;
pub mod tasks;

pub use arm::{Arm, Configuration, Sight};
pub use joint_bounds::Bound;
pub use limits::Limit;
pub use model_based::ModelBased;
pub use rows::{LimitRows, TaskRows};
pub use step::{Active, Constraint, Goal, Step, Stepper};
pub use tasks::Task;
