//! `handeye.servo`: steps, tasks, limits, controllers and the loop around them.
mod controllers;
mod limits;
mod servo_loop;
mod step;
mod tasks;

pub use controllers::{
    Controller, Decision, ImageBased, ModelBased, ModelBasedTip, MotionCommand, PoseBased, UncalibratedJoints,
};
pub use limits::{HalfSpace, InImage, Limit, LinkDistance, PixelSpeed, TipBox, TipSpeed, VirtualFixture};
pub use servo_loop::{ServoLoop, Stop, Tick};
pub use step::{Active, Goal, PredictionBounds, Step, Stepper};
pub use tasks::{FunctionTask, ImagePoints, JointTarget, LookAt, Manipulability, Task, TipPose};
