//! The pinhole camera: x' = x / z, y' = y / z.
pub(super) use super::perspective::{divide, ray, sees};
use handeye_solvers::Scalar;
use nalgebra::Vector3;

pub(super) const NAME: &str = "pinhole";
pub(super) const DISTORTION: &[&str] = &[];

#[inline]
pub(super) fn lens<T: Scalar>(_: &[T], point_in_camera: &Vector3<T>) -> [T; 2] {
    divide(point_in_camera)
}

#[cfg(test)]
mod tests {
    use crate::camera::{CameraModel, tests::agrees};

    // x / z and y / z by hand.
    #[test]
    fn pixels_are_those_of_the_published_formula() {
        let expected = [
            ([0.3, -0.2, 1.1], [483.6363636363636, 132.72727272727272]),
            ([-0.9, 0.5, 0.8], [-355.0, 608.75]),
            ([0.02, 0.04, 2.0], [326.0, 251.8]),
        ];
        agrees(CameraModel::Pinhole, [0.0; 8], &expected);
    }
}
