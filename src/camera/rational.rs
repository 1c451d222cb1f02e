//! Rational radial and tangential distortion: OpenCV's eight coefficients, ROS's rational_polynomial.
//!
//!   x' = x (1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶) + 2 p1 x y + p2 (r² + 2 x²)
//!
//! and y' alike, with x, y divided by the depth and r² = x² + y².
use super::brown_conrady::tangential;
use super::perspective::divide;
pub(super) use super::perspective::{ray, sees};
use handeye_solvers::Scalar;
use nalgebra::Vector3;

pub(super) const NAME: &str = "rational";
pub(super) const DISTORTION: &[&str] = &["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"];

#[inline]
pub(super) fn lens<T: Scalar>(distortion: &[T], point_in_camera: &Vector3<T>) -> [T; 2] {
    let &[k1, k2, p1, p2, k3, k4, k5, k6, ..] = distortion else { return divide(point_in_camera) };
    let [x, y] = divide(point_in_camera);
    let r2 = x * x + y * y;
    let above = ((k3 * r2 + k2) * r2 + k1) * r2 + 1.0;
    let below = ((k6 * r2 + k5) * r2 + k4) * r2 + 1.0;
    tangential([x, y], r2, above / below, [p1, p2])
}

#[cfg(test)]
mod tests {
    use crate::camera::{CameraModel, tests::agrees};

    // Evaluated outside this project (Python, term by term) from the formula in OpenCV's documentation of calib3d.
    #[test]
    fn pixels_are_those_of_the_published_formula() {
        let expected = [
            ([0.3, -0.2, 1.1], [479.16125046297856, 135.70110403533482]),
            ([-0.9, 0.5, 0.8], [-153.92373885074988, 499.5976721499467]),
            ([0.02, 0.04, 2.0], [325.99922007499515, 251.7992036474904]),
        ];
        agrees(CameraModel::Rational, [0.15, -0.02, 1.1e-3, -7e-4, 0.004, 0.4, 0.03, -0.002], &expected);
    }
}
