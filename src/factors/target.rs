//! The residual of a target that a camera reports as a whole pose, which may drift.
use handeye_solvers::manifold::so3;
use handeye_solvers::{Factor, Function, Pose, Scalar, Vector};

/// A derived node: `camera_from_target`, on `world_from_carrier`, `carrier_from_target`, `world_from_mount` and `mount_from_camera`.
#[derive(Clone, Copy, Debug)]
pub struct CameraFromTarget;

impl Function for CameraFromTarget {
    type On = (Pose, Pose, Pose, Pose);
    type Output = Pose;

    fn compute<T: Scalar>(&self, (carrier, target, mount, camera): (Pose<T>, Pose<T>, Pose<T>, Pose<T>)) -> Pose<T> {
        (mount * camera).inverse() * (carrier * target)
    }
}

/// A tag's or board's pose in a camera against where the model has it.
///
///   r = (log(R_seenᵀ R), s t - t_seen) - C d
///
/// On `camera_from_target`, the scale s of the reported translations, which is 1 unless the poses are monocular or the target's size
/// is wrong, and a drift d of the report, which C carries along with the side that stands in the world. The rotation is in the
/// target's frame [rad], the translation in the camera's [m].
#[derive(Clone, Copy, Debug)]
pub struct TargetSeen {
    /// `camera_from_target`, as a detector reports it.
    pub seen: Pose,
    /// True where the camera stands in the world and the target moves; false where the target stands.
    pub camera_stands: bool,
}

impl TargetSeen {
    /// C: a drift in the frame that stands -> the error that it makes. Rotations of a standing target and translations before a
    /// standing camera are in a frame that stands already.
    pub fn carried<T: Scalar>(&self, drift: &[T; 6]) -> [T; 6] {
        let rotation = &self.seen.rotation;
        let mut carried = *drift;
        let moving = if self.camera_stands { 0 } else { 3 };
        for i in 0..3 {
            let entry = |k: usize| if self.camera_stands { rotation[(k, i)] } else { rotation[(i, k)] };
            carried[moving + i] = (0..3).fold(T::from(0.0), |sum, k| sum + drift[moving + k] * entry(k));
        }
        carried
    }

    /// The inverse of [`TargetSeen::carried`].
    pub fn uncarried(&self, error: &[f64; 6]) -> [f64; 6] {
        let seen = Pose { rotation: self.seen.rotation.transpose(), ..self.seen };
        TargetSeen { seen, ..*self }.carried(error)
    }
}

impl Factor<6> for TargetSeen {
    type On = (Pose, Vector<1>, Vector<6>);

    fn residual<T: Scalar>(&self, (predicted, scale, drift): (Pose<T>, Vector<1, T>, Vector<6, T>)) -> [T; 6] {
        let w = so3::log(&so3::times(&self.seen.rotation.transpose().map(T::from), &predicted.rotation));
        let v = predicted.translation * scale[0] - self.seen.translation.map(T::from);
        let drift = self.carried(&std::array::from_fn(|k| drift[k]));
        std::array::from_fn(|k| if k < 3 { w[k] } else { v[k - 3] } - drift[k])
    }
}

/// A drift now less that at the view before: a random walk.
#[derive(Clone, Copy, Debug)]
pub struct Drifting;

impl Factor<6> for Drifting {
    type On = (Vector<6>, Vector<6>);

    fn residual<T: Scalar>(&self, (before, now): (Vector<6, T>, Vector<6, T>)) -> [T; 6] {
        std::array::from_fn(|k| now[k] - before[k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn pose(k: f64) -> Pose {
        Pose::new(Vector3::new(k.sin(), 0.4 * k.cos(), 0.2 * k), Vector3::new(0.3 * k, -0.2, k.sin()))
    }

    fn none<const N: usize>(value: f64) -> Vector<N> {
        Vector::<N>::repeat(value)
    }

    #[test]
    fn a_target_where_the_model_has_it_leaves_nothing() {
        let (carrier, target, mount, camera) = (pose(1.0), pose(2.0), pose(3.0), pose(4.0));
        let mut seen = (mount * camera).inverse() * carrier * target;
        seen.translation *= 1.7;
        let predicted = CameraFromTarget.compute((carrier, target, mount, camera));
        let factor = TargetSeen { seen, camera_stands: false };
        let residual = factor.residual::<f64>((predicted, none(1.7), none(0.0)));
        assert!(residual.iter().all(|r| r.abs() < 1e-12), "{residual:?}");
    }

    /// What stands is not where the reports have it: one drift explains all views.
    #[test]
    fn a_shift_of_the_side_that_stands_is_one_drift_in_all_views() {
        let small = Pose::new(Vector3::new(1e-5, -2e-5, 3e-5), Vector3::new(-4e-5, 5e-5, 6e-5));
        for camera_stands in [false, true] {
            let drifts = [1.0, 2.0, 5.0].map(|k| {
                let view = pose(k);
                let seen = if camera_stands { small * view } else { view * small };
                let factor = TargetSeen { seen, camera_stands };
                factor.uncarried(&factor.residual::<f64>((view, none(1.0), none(0.0))))
            });
            assert!(drifts[0].iter().any(|r| r.abs() > 1e-5));
            // A turn of the camera moves what it sees by how far away that is, which differs between views.
            let is_shared = |k: &usize| !camera_stands || *k < 3;
            for k in (0..6).filter(is_shared) {
                assert!((drifts[1][k] - drifts[0][k]).abs() + (drifts[2][k] - drifts[0][k]).abs() < 1e-8, "{drifts:?}");
            }
        }
    }
}
