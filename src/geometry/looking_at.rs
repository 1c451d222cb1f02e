//! Poses from which a camera looks at a point.
use handeye_solvers::Pose;
use nalgebra::{Matrix3, Vector3};

/// `world_from_camera` of a camera at a place that looks at another [m], its images upright where `down` points down. `None` where the two
/// places are one, `down` points along the way from one to the other, or a number is not finite.
pub fn looking_at(from: &Vector3<f64>, at: &Vector3<f64>, down: &Vector3<f64>) -> Option<Pose> {
    let ahead = (at - from).try_normalize(0.0)?;
    let right = down.try_normalize(0.0)?.cross(&ahead).try_normalize(ALONG)?;
    let rotation = Matrix3::from_columns(&[right, ahead.cross(&right), ahead]);
    rotation.iter().all(|x| x.is_finite()).then_some(Pose { translation: *from, rotation })
}

/// Nearer than this to the way, what points down says nothing of the turn about it [rad].
const ALONG: f64 = 1e-12;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_looked_at_lies_on_the_axis_and_what_is_below_it_below() {
        let places =
            |first: u32| (first..first + 30).map(|i| Vector3::from_fn(|k, _| (f64::from(i) * 3.7 + k as f64).sin()));
        for (from, at) in places(0).zip(places(5)) {
            let down = -Vector3::z();
            let pose = looking_at(&from, &at, &down).unwrap();
            assert!((pose.rotation.determinant() - 1.0).abs() < 1e-12);
            let [ahead, below] = [at, at + 0.01 * down].map(|point| pose.inverse_transform(&point));
            assert!((ahead - (at - from).norm() * Vector3::z()).norm() < 1e-12);
            assert!(below.y > 0.0 && below.x.abs() < 1e-12, "{below}");
        }
        let here = Vector3::new(1.0, 2.0, 3.0);
        assert_eq!(looking_at(&here, &here, &Vector3::z()), None);
        assert_eq!(looking_at(&here, &(here + Vector3::z()), &Vector3::z()), None);
        for x in [f64::NAN, f64::INFINITY] {
            let nowhere = Vector3::new(0.0, x, 0.0);
            assert_eq!(looking_at(&here, &nowhere, &Vector3::z()), None);
            assert_eq!(looking_at(&nowhere, &here, &Vector3::z()), None);
            assert_eq!(looking_at(&here, &Vector3::zeros(), &nowhere), None);
        }
    }
}
