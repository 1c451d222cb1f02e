//! The equidistant fisheye of Kannala and Brandt (2006), as in OpenCV's fisheye module and ROS's equidistant.
//!
//!   θ = atan2(r, z), θ' = θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸), (x', y') = θ' (x, y) / r, r² = x² + y²
//!
//! θ may exceed 90°. Straight behind, at θ = 180°, one point has a circle for its image, and here its centre.
use handeye_solvers::Scalar;
use nalgebra::Vector3;

pub(super) const NAME: &str = "kannala-brandt";
pub(super) const DISTORTION: &[&str] = &["k1", "k2", "k3", "k4"];

/// Where (r / z)² is smaller, θ / r is taken from its series; the first omitted term is below 1e-18 relative.
const NEAR_AXIS: f64 = 1e-4;

/// Least squared sine of the angle to the axis behind: keeps the derivative finite at the singular direction.
const AXIS_BEHIND: f64 = 1e-20;

/// Below this squared distance to the centre [m²] a point is the centre itself.
const CENTRE: f64 = 1e-200;

#[inline]
pub(super) fn lens<T: Scalar>(distortion: &[T], p: &Vector3<T>) -> [T; 2] {
    let r2 = p.x * p.x + p.y * p.y;
    let z2 = p.z * p.z;
    if (r2 + z2).value() < CENTRE {
        return [T::zero(); 2];
    }
    let (theta_over_r, theta2) = if p.z.value() > 0.0 && r2.value() < NEAR_AXIS * z2.value() {
        // atan(q) / q = 1 - q²/3 + q⁴/5 - ... with q = r / z
        let q2 = r2 / z2;
        let ratio = (((q2 * (1.0 / 9.0) - 1.0 / 7.0) * q2 + 1.0 / 5.0) * q2 - 1.0 / 3.0) * q2 + 1.0;
        (ratio / p.z, q2 * ratio * ratio)
    } else {
        let r = (r2 + z2 * AXIS_BEHIND).sqrt();
        let theta = angle(r, p.z);
        (theta / r, theta * theta)
    };
    let polynomial = match *distortion {
        [k1, k2, k3, k4, ..] => (((k4 * theta2 + k3) * theta2 + k2) * theta2 + k1) * theta2 + 1.0,
        _ => T::one(),
    };
    let scale = theta_over_r * polynomial;
    [p.x * scale, p.y * scale]
}

/// atan2(r, z) for r > 0, from the flatter side of the arc tangent: atan2 on dual numbers is NaN at z = 0.
#[inline]
fn angle<T: Scalar>(r: T, z: T) -> T {
    if z.value().abs() < r.value() {
        T::frac_pi_2() - (z / r).atan()
    } else if z.value() > 0.0 {
        (r / z).atan()
    } else {
        T::pi() + (r / z).atan()
    }
}

/// Anywhere but at the centre.
pub(super) fn sees(p: &Vector3<f64>) -> bool {
    p.norm_squared() > CENTRE
}

/// The direction at θ = |(x, y)| from the axis, on the side of (x, y).
pub(super) fn ray<T: Scalar>([x, y]: [T; 2]) -> Vector3<T> {
    let theta2 = x * x + y * y;
    if theta2.value() < NEAR_AXIS {
        let sine = ((theta2 * (-1.0 / 5_040.0) + 1.0 / 120.0) * theta2 - 1.0 / 6.0) * theta2 + 1.0;
        let cosine = ((theta2 * (-1.0 / 720.0) + 1.0 / 24.0) * theta2 - 0.5) * theta2 + 1.0;
        return Vector3::new(x * sine, y * sine, cosine);
    }
    let theta = theta2.sqrt();
    let sine = theta.sin() / theta;
    Vector3::new(x * sine, y * sine, theta.cos())
}

#[cfg(test)]
mod tests {
    use crate::camera::{CameraModel, tests::agrees};

    // Evaluated outside this project (Python, term by term) from the formula in OpenCV's documentation of fisheye.
    #[test]
    fn pixels_are_those_of_the_published_formula() {
        let expected = [
            ([0.3, -0.2, 1.1], [477.66934531636264, 136.63898473705115]),
            ([-0.9, 0.5, 0.8], [-148.06769865292785, 495.70365019002537]),
            ([0.02, 0.04, 2.0], [325.9989103628524, 251.7978570469431]),
            // 100° from the axis, behind the image plane.
            ([0.5908846518073247, 0.7878462024097664, -0.1736481776669303], [908.4027673492585, 1011.461406080139]),
        ];
        agrees(CameraModel::KannalaBrandt, [-0.03, 0.012, -0.006, 0.001, 0.0, 0.0, 0.0, 0.0], &expected);
    }
}
