//! The tip to a pose: its position, its orientation, or both.
use super::{Arm, Configuration, Task, TaskRows};
use handeye_solvers::Pose;
use handeye_solvers::manifold::so3;

/// Brings the tip to a pose: t + v Δq = t*, and exp(w Δq) R = R*, in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipPose {
    /// `world_from_tip` as it shall be.
    pub target: Pose,
    /// Standard deviation of each coordinate of the position [m]; infinite where it may be anywhere.
    pub xyz_sd: f64,
    /// Standard deviation about each axis [rad]; infinite where the orientation may be any.
    pub rot_sd: f64,
}

impl Task for TipPose {
    fn rows(&self, _arm: &Arm, at: &Configuration, rows: &mut TaskRows) {
        let tip = at.posture.tip();
        let away = self.target.translation - tip.translation;
        let turn = so3::log(&(self.target.rotation * tip.rotation.transpose()));
        let twists = || at.posture.axes.iter().map(|axis| axis.twist(&tip.translation));
        for k in 0..3 {
            if self.xyz_sd.is_finite() {
                rows.push(twists().map(|(_, v)| v[k]), away[k], self.xyz_sd);
            }
            if self.rot_sd.is_finite() {
                rows.push(twists().map(|(w, _)| w[k]), turn[k], self.rot_sd);
            }
        }
    }
}
