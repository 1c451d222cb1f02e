//! A feature as a depth camera sees it: a point in the camera's frame.
use super::InCamera;
use super::in_camera::Sightline;
use handeye_solvers::{Factor, Function, Jacobian, Pose, Scalar, Vector};
use nalgebra::Vector3;

/// Predicted minus seen point [m] of a feature, along the camera's axes.
///
///   r = (Q C)⁻¹ P f - point
///
/// on the nodes of [`InCamera`].
#[derive(Clone, Copy, Debug)]
pub struct PointObservation {
    /// Where the feature was seen in the camera's frame [m].
    pub point: [f64; 3],
}

impl Factor<3> for PointObservation {
    type On = (Pose, Vector<3>, Pose, Pose);

    fn residual<T: Scalar>(&self, on: (Pose<T>, Vector<3, T>, Pose<T>, Pose<T>)) -> [T; 3] {
        let predicted = InCamera.compute(on);
        std::array::from_fn(|k| predicted[k] - self.point[k])
    }

    #[inline]
    fn evaluate(&self, x: &[&[f64]], jacobian: Option<&mut Jacobian<'_>>) -> [f64; 3] {
        let sightline = Sightline::new(x);
        if let Some(jacobian) = jacobian {
            for row in 0..3 {
                sightline.write(jacobian, row, &Vector3::ith(row, 1.0));
            }
        }
        std::array::from_fn(|k| sightline.in_camera[k] - self.point[k])
    }
}
