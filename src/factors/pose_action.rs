//! A commanded motion of the tip's pose, executed with an error (eq. 12 of the paper).
use super::pose_reading::difference;
use handeye_solvers::{Factor, Function, Pose, Scalar};

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
        difference(&Motion.compute((before, after)), &self.action)
    }
}

/// A derived node: the motion P' P⁻¹ of the world that takes a pose P to another, P'.
#[derive(Clone, Copy, Debug)]
pub struct Motion;

impl Function for Motion {
    type On = (Pose, Pose);
    type Output = Pose;

    fn compute<T: Scalar>(&self, (before, after): (Pose<T>, Pose<T>)) -> Pose<T> {
        after * before.inverse()
    }
}
