//! Radial and tangential distortion after Brown (1971) and Conrady (1919): OpenCV's five coefficients, ROS's plumb_bob.
//!
//!   x' = x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²)
//!   y' = y (1 + k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2 y²) + 2 p2 x y
//!
//! with x, y divided by the depth and r² = x² + y².
use super::perspective::divide;
pub(super) use super::perspective::{ray, sees};
use handeye_solvers::Scalar;
use nalgebra::Vector3;

pub(super) const NAME: &str = "brown-conrady";
pub(super) const DISTORTION: &[&str] = &["k1", "k2", "p1", "p2", "k3"];

#[inline]
pub(super) fn lens<T: Scalar>(distortion: &[T], point_in_camera: &Vector3<T>) -> [T; 2] {
    let &[k1, k2, p1, p2, k3, ..] = distortion else { return divide(point_in_camera) };
    let [x, y] = divide(point_in_camera);
    let r2 = x * x + y * y;
    let radial = ((k3 * r2 + k2) * r2 + k1) * r2 + 1.0;
    tangential([x, y], r2, radial, [p1, p2])
}

/// The tangential part, which the rational model shares.
#[inline]
pub(super) fn tangential<T: Scalar>([x, y]: [T; 2], r2: T, radial: T, [p1, p2]: [T; 2]) -> [T; 2] {
    let two_xy = x * y * 2.0;
    [x * radial + p1 * two_xy + p2 * (r2 + x * x * 2.0), y * radial + p1 * (r2 + y * y * 2.0) + p2 * two_xy]
}

#[cfg(test)]
mod tests {
    use crate::camera::{CameraModel, tests::agrees};

    // Evaluated outside this project (Python, term by term) from the formula in OpenCV's documentation of calib3d.
    #[test]
    fn pixels_are_those_of_the_published_formula() {
        let expected = [
            ([0.3, -0.2, 1.1], [478.70825184733076, 135.99806979448172]),
            ([-0.9, 0.5, 0.8], [-174.5015814208984, 510.8392713317871]),
            ([0.02, 0.04, 2.0], [325.999130134991, 251.7990267654823]),
        ];
        agrees(CameraModel::BrownConrady, [-0.28, 0.09, 1.1e-3, -7e-4, -0.012, 0.0, 0.0, 0.0], &expected);
    }
}
