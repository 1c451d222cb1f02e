//! A noisy reading of the tip's pose (eq. 8 of the paper).
use handeye_solvers::manifold::so3;
use handeye_solvers::{Factor, Pose, Scalar};

/// From the reading to the tip's pose: rotation vector [rad], then translation [m], both in the world.
///
///   r = (log(R Rᵣᵀ), t - tᵣ)
#[derive(Clone, Copy, Debug)]
pub struct PoseReading {
    /// What was read, `world_from_tip`.
    pub reading: Pose,
}

impl Factor<6> for PoseReading {
    type On = (Pose,);

    fn residual<T: Scalar>(&self, (tip,): (Pose<T>,)) -> [T; 6] {
        difference(&tip, &self.reading)
    }
}

/// Rotation vector and translation that take `from` to `to`, both in the world.
pub(super) fn difference<T: Scalar>(to: &Pose<T>, from: &Pose) -> [T; 6] {
    let back = from.rotation.transpose().map(T::from);
    let w = so3::log(&so3::times(&to.rotation, &back));
    std::array::from_fn(|i| if i < 3 { w[i] } else { to.translation[i - 3] - from.translation[i - 3] })
}
