//! Poses between two others.
use handeye_solvers::Pose;
use handeye_solvers::manifold::so3;

/// The pose at a share of the way, from 0 at the one to 1 at the other, which are given exactly: the origin goes on a line, the rotation
/// about one axis at one speed (slerp).
///
///   R(s) = exp(s log(R₁ R₀ᵀ)) R₀,   t(s) = t₀ + s (t₁ - t₀)
pub fn between(from: &Pose, to: &Pose, share: f64) -> Pose {
    if share <= 0.0 {
        return *from;
    }
    if share >= 1.0 {
        return *to;
    }
    let turn = so3::log(&(to.rotation * from.rotation.transpose()));
    Pose {
        rotation: so3::exp(&(share * turn)) * from.rotation,
        translation: from.translation + share * (to.translation - from.translation),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

    fn poses() -> impl Iterator<Item = Pose> {
        (0..30).map(|i| {
            let number = |k: usize| (f64::from(i) * 3.7 + k as f64 * 1.3).sin();
            Pose::new(Vector3::from_fn(|k, _| number(k)), Vector3::from_fn(|k, _| number(k + 3)))
        })
    }

    #[test]
    fn poses_between_others_are_where_quaternions_have_them() {
        let as_isometry = |pose: &Pose| {
            Isometry3::from_parts(Translation3::from(pose.translation), UnitQuaternion::from_matrix(&pose.rotation))
        };
        for (from, to) in poses().zip(poses().skip(7)) {
            for share in [0.0, 0.1, 0.5, 0.9, 1.0] {
                let ours = between(&from, &to, share);
                let theirs = as_isometry(&from).lerp_slerp(&as_isometry(&to), share);
                assert!((ours.translation - theirs.translation.vector).norm() < 1e-14);
                assert!((ours.rotation - theirs.rotation.to_rotation_matrix().matrix()).norm() < 1e-9, "{share}");
            }
            assert_eq!((between(&from, &to, 0.0), between(&from, &to, 1.0)), (from, to));
        }
    }
}
