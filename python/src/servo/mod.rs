//! `handeye.servo`: steps, tasks, limits, controllers and the loop around them.
mod controllers;
mod decision;
mod held_back;
mod limits;
mod prediction_bounds;
mod servo_loop;
mod step;
mod tasks;

pub use controllers::{Controller, ImageBased, ModelBased, ModelBasedTip, PoseBased, UncalibratedJoints};
pub use decision::{Decision, MotionCommand, Stop};
pub use held_back::Active;
pub use limits::{HalfSpace, InImage, Limit, LinkDistance, PixelSpeed, TipBox, TipSpeed, VirtualFixture};
pub use prediction_bounds::PredictionBounds;
pub use servo_loop::{ServoLoop, Tick};
pub use step::{Goal, Step, Stepper};
pub use tasks::{FunctionTask, ImagePoints, JointTarget, LookAt, Manipulability, Task, TipPose};
