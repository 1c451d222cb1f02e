//! The residual of a target that a camera reports as a whole pose.
use handeye_solvers::manifold::so3;
use handeye_solvers::{Factor, Pose, Scalar, Vector};

/// A tag's or board's pose in a camera against where the model has it.
///
///   camera_from_target = (mount · pose)⁻¹ carrier · target,   r = (log(R_seenᵀ R), s t - t_seen)
///
/// On `world_from_carrier`, `carrier_from_target`, `world_from_mount`, `mount_from_camera` and the scale s of the reported
/// translations, which is 1 unless the poses are monocular or the target's size is wrong. The rotation is in the target's frame
/// [rad], the translation in the camera's [m].
#[derive(Clone, Copy, Debug)]
pub struct TargetSeen {
    /// `camera_from_target`, as a detector reports it.
    pub seen: Pose,
}

impl Factor<6> for TargetSeen {
    type On = (Pose, Pose, Pose, Pose, Vector<1>);

    fn residual<T: Scalar>(
        &self,
        (carrier, target, mount, camera, scale): (Pose<T>, Pose<T>, Pose<T>, Pose<T>, Vector<1, T>),
    ) -> [T; 6] {
        let predicted = (mount * camera).inverse() * (carrier * target);
        let w = so3::log(&so3::times(&self.seen.rotation.transpose().map(T::from), &predicted.rotation));
        let v = predicted.translation * scale[0] - self.seen.translation.map(T::from);
        [w.x, w.y, w.z, v.x, v.y, v.z]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use handeye_solvers::check;
    use nalgebra::Vector3;

    fn pose(k: f64) -> Pose {
        Pose::new(Vector3::new(k.sin(), 0.4 * k.cos(), 0.2 * k), Vector3::new(0.3 * k, -0.2, k.sin()))
    }

    #[test]
    fn a_target_where_the_model_has_it_leaves_nothing() {
        let (carrier, target, mount, camera) = (pose(1.0), pose(2.0), pose(3.0), pose(4.0));
        let mut seen = (mount * camera).inverse() * carrier * target;
        seen.translation *= 1.7;
        let residual = TargetSeen { seen }.residual::<f64>((carrier, target, mount, camera, Vector::<1>::new(1.7)));
        assert!(residual.iter().all(|r| r.abs() < 1e-12), "{residual:?}");
    }

    #[test]
    fn derivatives_agree_with_differences() {
        let at = (pose(1.0), pose(2.0), pose(3.0), pose(4.0), Vector::<1>::new(1.3));
        let near = (at.2 * at.3).inverse() * at.0 * at.1 * Pose::new(Vector3::repeat(0.1), Vector3::repeat(0.02));
        check::factor(&TargetSeen { seen: near }, &at).unwrap();
    }
}
