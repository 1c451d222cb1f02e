//! From the motion of an arm to what its robot takes.
use super::{Arm, Configuration};
use crate::recording::Command;
use handeye_solvers::manifold::so3;

/// What a robot takes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Takes {
    /// Joint readings to go to.
    Joints,
    /// Joint motions.
    #[default]
    JointDelta,
    /// Joint speeds.
    JointVelocity,
    /// Motions of the tip in the world.
    PoseDelta,
    /// Velocities of the tip in the world.
    PoseVelocity,
}

impl Takes {
    /// All of them.
    pub const ALL: &'static [Takes] =
        &[Takes::Joints, Takes::JointDelta, Takes::JointVelocity, Takes::PoseDelta, Takes::PoseVelocity];

    /// The word for it in scene files.
    pub fn name(self) -> &'static str {
        match self {
            Takes::Joints => "joints",
            Takes::JointDelta => "joint-deltas",
            Takes::JointVelocity => "joint-velocities",
            Takes::PoseDelta => "pose-deltas",
            Takes::PoseVelocity => "pose-velocities",
        }
    }

    /// The command for a joint motion of the next `dt` seconds.
    pub fn command(self, arm: &Arm, at: &Configuration, motion: &[f64], dt: f64) -> Command {
        let after = || at.joints.iter().zip(motion).map(|(joint, motion)| joint + motion).collect::<Vec<f64>>();
        match self {
            Takes::Joints => Command::Joints(after()),
            Takes::JointDelta => Command::JointDelta(motion.to_vec()),
            Takes::JointVelocity => Command::JointVelocity(motion.iter().map(|motion| motion / dt).collect()),
            Takes::PoseDelta => Command::PoseDelta(arm.tip(&after()) * at.posture.tip().inverse()),
            Takes::PoseVelocity => {
                let (before, after) = (at.posture.tip(), arm.tip(&after()));
                let w = so3::log(&(after.rotation * before.rotation.transpose())) / dt;
                let v = (after.translation - before.translation) / dt;
                Command::PoseVelocity([w.x, w.y, w.z, v.x, v.y, v.z])
            }
        }
    }
}
