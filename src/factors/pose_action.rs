//! A commanded motion of the tip's pose, executed with an error (eq. 12 of the paper).
use super::pose_reading::difference;
use handeye_solvers::{Factor, Pose, Scalar};

/// From the commanded motion A to the one that took place, P' P⁻¹: rotation vector [rad], then translation [m], on the
/// tip's poses before (P) and after (P').
#[derive(Clone, Copy, Debug)]
pub struct PoseAction {
    /// A, a motion of the world that takes the tip along: P' = A P.
    pub action: Pose,
}

impl Factor<6> for PoseAction {
    type On = (Pose, Pose);

    fn residual<T: Scalar>(&self, (before, after): (Pose<T>, Pose<T>)) -> [T; 6] {
        difference(&(after * before.inverse()), &self.action)
    }
}
