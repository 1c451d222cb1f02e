//! Poses between two others, and poses from which a camera looks at a point.
use handeye_solvers::Pose;
use handeye_solvers::manifold::so3;
use nalgebra::{Matrix3, Vector3};

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

/// `world_from_camera` of a camera at a place that looks at another [m], its images upright where `down` points down. `None` where the two
/// places are one, or `down` points along the way from one to the other.
pub fn looking_at(from: &Vector3<f64>, at: &Vector3<f64>, down: &Vector3<f64>) -> Option<Pose> {
    let ahead = (at - from).try_normalize(0.0)?;
    let right = down.try_normalize(0.0)?.cross(&ahead).try_normalize(ALONG)?;
    Some(Pose { translation: *from, rotation: Matrix3::from_columns(&[right, ahead.cross(&right), ahead]) })
}

/// Nearer than this to the way, what points down says nothing of the turn about it [rad].
const ALONG: f64 = 1e-12;

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Isometry3, Translation3, UnitQuaternion};

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

    #[test]
    fn what_is_looked_at_lies_on_the_axis_and_what_is_below_it_below() {
        for (from, at) in poses().zip(poses().skip(5)) {
            let down = -Vector3::z();
            let pose = looking_at(&from.translation, &at.translation, &down).unwrap();
            assert!((pose.rotation.determinant() - 1.0).abs() < 1e-12);
            let [ahead, below] =
                [at.translation, at.translation + 0.01 * down].map(|point| pose.inverse_transform(&point));
            assert!((ahead - (at.translation - from.translation).norm() * Vector3::z()).norm() < 1e-12);
            assert!(below.y > 0.0 && below.x.abs() < 1e-12, "{below}");
        }
        let here = Vector3::new(1.0, 2.0, 3.0);
        assert_eq!(looking_at(&here, &here, &Vector3::z()), None);
        assert_eq!(looking_at(&here, &(here + Vector3::z()), &Vector3::z()), None);
    }
}
