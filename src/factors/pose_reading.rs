//! A noisy reading of the tip's pose (eq. 8 of the paper).
use handeye_solvers::manifold::so3;
use handeye_solvers::{Factor, Pose, Scalar};

/// From the reading to the pose of what was read: rotation vector [rad], then translation [m], both in the world.
///
///   r = (log(R Rᵣᵀ), t - tᵣ), (R, t) = P Z
///
/// on (P = world_from_tip, Z = tip_from_tool). The tool is the identity where the tip itself is what was read.
#[derive(Clone, Copy, Debug)]
pub struct PoseReading {
    /// What was read, `world_from_tool`.
    pub reading: Pose,
}

impl Factor<6> for PoseReading {
    type On = (Pose, Pose);

    fn residual<T: Scalar>(&self, (tip, tool): (Pose<T>, Pose<T>)) -> [T; 6] {
        difference(&(tip * tool), &self.reading)
    }
}

/// Rotation vector and translation that take `from` to `to`, both in the world.
pub(super) fn difference<T: Scalar>(to: &Pose<T>, from: &Pose) -> [T; 6] {
    let back = from.rotation.transpose().map(T::from);
    let w = so3::log(&so3::times(&to.rotation, &back));
    std::array::from_fn(|i| if i < 3 { w[i] } else { to.translation[i - 3] - from.translation[i - 3] })
}
