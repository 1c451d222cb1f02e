//! Servoing without a rig: what Ramirez, "Towards Practical Uncalibrated Visual Servoing", 2016, did with robots or tells in words, in
//! simulation. Arms are scenes, run as `handeye servo` runs them; what is no arm before cameras is
//! [`Controlled`](super::controlled::Controlled).
mod dead_band;
mod depth_camera;
mod distance;
mod drone;
mod moving_target;
mod pick;
mod scenes;
mod virtual_spring;
mod wrench;

pub(super) use dead_band::DEAD_BAND;
pub(super) use depth_camera::DEPTH_CAMERA;
pub(super) use distance::FIGURE5_17;
pub(super) use drone::DRONE;
pub(super) use moving_target::MOVING_TARGET;
pub(super) use pick::PICK;
pub(super) use virtual_spring::VIRTUAL_SPRING;
pub(super) use wrench::WRENCH;
