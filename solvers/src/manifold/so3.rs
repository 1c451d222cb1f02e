//! Exponential and logarithm of rotations, exact in value and derivative everywhere, zero included.
//!
//! Notation: K is the cross-product matrix of w, θ = |w|.
use crate::Scalar;
use nalgebra::{Matrix3, Vector3};

/// Below this θ² the Taylor series stand in: their first omitted term is under 1e-16 relative.
const SMALL: f64 = 1e-4;

/// Rotation matrix of a rotation vector (Rodrigues).
///
///   exp(w) = I + (sin θ / θ) K + ((1 - cos θ) / θ²) K²
pub fn exp<T: Scalar>(w: &Vector3<T>) -> Matrix3<T> {
    let theta2 = w.x * w.x + w.y * w.y + w.z * w.z;
    let (a, b) = if theta2.value() < SMALL {
        (
            series(theta2, &[1.0, -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5_040.0]),
            series(theta2, &[0.5, -1.0 / 24.0, 1.0 / 720.0, -1.0 / 40_320.0]),
        )
    } else {
        let theta = theta2.sqrt();
        (theta.sin() / theta, (T::one() - theta.cos()) / theta2)
    };
    let (x, y, z) = (w.x, w.y, w.z);
    let (bxy, bxz, byz) = (b * x * y, b * x * z, b * y * z);
    let one = T::one();
    Matrix3::new(
        one - b * (y * y + z * z),
        bxy - a * z,
        bxz + a * y,
        bxy + a * z,
        one - b * (x * x + z * z),
        byz - a * x,
        bxz - a * y,
        byz + a * x,
        one - b * (x * x + y * y),
    )
}

/// Rotation vector of a rotation matrix, with an angle in [0, π].
///
/// Goes through the quaternion, so that angles near π keep their accuracy.
pub fn log<T: Scalar>(r: &Matrix3<T>) -> Vector3<T> {
    let [x, y, z, w] = quaternion(r);
    let s2 = x * x + y * y + z * z;
    // angle / |v| with |v| = sin(angle / 2), w = cos(angle / 2) >= 0.
    let scale = if s2.value() < SMALL {
        let t2 = s2 / (w * w);
        series(t2, &[2.0, -2.0 / 3.0, 2.0 / 5.0, -2.0 / 7.0, 2.0 / 9.0]) / w
    } else {
        let s = s2.sqrt();
        s.atan2(w) * 2.0 / s
    };
    Vector3::new(x * scale, y * scale, z * scale)
}

/// Unit quaternion `[x, y, z, w]` of a rotation matrix, with w >= 0 (Shepperd's method: the largest component first).
pub fn quaternion<T: Scalar>(r: &Matrix3<T>) -> [T; 4] {
    let (m00, m11, m22) = (r.m11, r.m22, r.m33);
    let trace = m00 + m11 + m22;
    let (t, a, b, c) = (trace.value(), m00.value(), m11.value(), m22.value());
    let q = if t >= a && t >= b && t >= c {
        let s = (trace + 1.0).sqrt() * 2.0;
        [(r.m32 - r.m23) / s, (r.m13 - r.m31) / s, (r.m21 - r.m12) / s, s / 4.0]
    } else if a >= b && a >= c {
        let s = (m00 - m11 - m22 + 1.0).sqrt() * 2.0;
        [s / 4.0, (r.m12 + r.m21) / s, (r.m13 + r.m31) / s, (r.m32 - r.m23) / s]
    } else if b >= c {
        let s = (m11 - m00 - m22 + 1.0).sqrt() * 2.0;
        [(r.m12 + r.m21) / s, s / 4.0, (r.m23 + r.m32) / s, (r.m13 - r.m31) / s]
    } else {
        let s = (m22 - m00 - m11 + 1.0).sqrt() * 2.0;
        [(r.m13 + r.m31) / s, (r.m23 + r.m32) / s, s / 4.0, (r.m21 - r.m12) / s]
    };
    if q[3].value() < 0.0 { q.map(|v| -v) } else { q }
}

/// Rotation matrix of a quaternion `[x, y, z, w]` of any length but 0.
pub fn from_quaternion<T: Scalar>([x, y, z, w]: [T; 4]) -> Matrix3<T> {
    let s = T::from(2.0) / (x * x + y * y + z * z + w * w);
    let one = T::one();
    Matrix3::new(
        one - s * (y * y + z * z),
        s * (x * y - z * w),
        s * (x * z + y * w),
        s * (x * y + z * w),
        one - s * (x * x + z * z),
        s * (y * z - x * w),
        s * (x * z - y * w),
        s * (y * z + x * w),
        one - s * (x * x + y * y),
    )
}

/// Inverse of the left Jacobian: log(exp(δ) exp(w)) = w + J⁻¹(w) δ to first order.
///
///   J⁻¹(w) = I - K/2 + (1/θ² - (1 + cos θ) / (2 θ sin θ)) K²
pub fn left_jacobian_inverse(w: &Vector3<f64>) -> Matrix3<f64> {
    let theta2 = w.norm_squared();
    let b = if theta2 < SMALL {
        series(theta2, &[1.0 / 12.0, 1.0 / 720.0, 1.0 / 30_240.0])
    } else {
        let theta = theta2.sqrt();
        // (1 + cos θ) / sin θ = cot(θ/2), which stays finite at π.
        1.0 / theta2 - 0.5 / (theta * (0.5 * theta).tan())
    };
    let k = cross_matrix(w);
    Matrix3::identity() - k * 0.5 + k * k * b
}

/// The matrix K with K v = w × v.
#[inline]
pub fn cross_matrix(w: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -w.z, w.y, w.z, 0.0, -w.x, -w.y, w.x, 0.0)
}

/// A B, written out: nalgebra's product of 3 x 3 matrices is two to three times slower on dual numbers.
#[inline]
pub fn times<T: Scalar>(a: &Matrix3<T>, b: &Matrix3<T>) -> Matrix3<T> {
    Matrix3::from_fn(|i, j| a[(i, 0)] * b[(0, j)] + a[(i, 1)] * b[(1, j)] + a[(i, 2)] * b[(2, j)])
}

/// A v, written out for the same reason.
#[inline]
pub fn apply<T: Scalar>(a: &Matrix3<T>, v: &Vector3<T>) -> Vector3<T> {
    Vector3::new(
        a.m11 * v.x + a.m12 * v.y + a.m13 * v.z,
        a.m21 * v.x + a.m22 * v.y + a.m23 * v.z,
        a.m31 * v.x + a.m32 * v.y + a.m33 * v.z,
    )
}

/// Aᵀ v.
#[inline]
pub fn apply_transposed<T: Scalar>(a: &Matrix3<T>, v: &Vector3<T>) -> Vector3<T> {
    Vector3::new(
        a.m11 * v.x + a.m21 * v.y + a.m31 * v.z,
        a.m12 * v.x + a.m22 * v.y + a.m32 * v.z,
        a.m13 * v.x + a.m23 * v.y + a.m33 * v.z,
    )
}

/// The rotation nearest to a matrix that is one up to rounding (one Newton step of the polar decomposition).
#[inline]
pub fn renormalize(r: &Matrix3<f64>) -> Matrix3<f64> {
    r * (Matrix3::identity() * 1.5 - r.transpose() * r * 0.5)
}

/// c0 + c1 x + c2 x² + ..., by Horner's rule.
#[inline]
fn series<T: Scalar>(x: T, coefficients: &[f64]) -> T {
    coefficients.iter().rev().fold(T::zero(), |sum, &c| sum * x + c)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scalar::{derivatives, seed};
    use std::f64::consts::PI;

    fn angles() -> impl Iterator<Item = Vector3<f64>> {
        let axis = Vector3::new(0.36, -0.48, 0.8);
        [0.0, 1e-9, 1e-5, 0.0099, 0.0101, 0.3, 1.5, 3.0, 3.1, PI - 1e-3, PI - 1e-6].into_iter().map(move |a| axis * a)
    }

    #[test]
    fn log_undoes_exp_up_to_half_a_turn() {
        for w in angles() {
            assert!((log(&exp(&w)) - w).norm() < 1e-12, "{w}");
        }
    }

    #[test]
    fn exp_agrees_with_an_independent_implementation() {
        for w in angles() {
            let theirs = *nalgebra::Rotation3::from_scaled_axis(w).matrix();
            assert!((exp(&w) - theirs).norm() < 1e-14, "{w}");
        }
    }

    #[test]
    fn derivatives_of_exp_and_log_agree_with_differences_everywhere() {
        let h = 1e-6;
        for w in angles().filter(|w| w.norm() < 3.1) {
            let lifted = Vector3::from_fn(|i, _| seed::<3>(w[i], i));
            let matrix = exp(&lifted);
            let back = log(&matrix);
            for i in 0..3 {
                let step = Vector3::ith(i, h);
                let differences = (exp(&(w + step)) - exp(&(w - step))) / (2.0 * h);
                for (d, m) in differences.iter().zip(matrix.iter()) {
                    assert!((d - derivatives(m)[i]).abs() < 1e-8, "exp at {w}");
                }
                for k in 0..3 {
                    let expected = if i == k { 1.0 } else { 0.0 };
                    assert!((derivatives(&back[k])[i] - expected).abs() < 1e-9, "log at {w}");
                }
            }
        }
    }

    #[test]
    fn quaternions_and_matrices_give_the_same_rotation() {
        for w in angles() {
            let r = exp(&w);
            assert!((from_quaternion(quaternion(&r)) - r).norm() < 1e-14);
        }
    }

    #[test]
    fn left_jacobian_inverse_agrees_with_differences() {
        let h = 1e-6;
        for w in angles().filter(|w| w.norm() < 3.1) {
            let jacobian = left_jacobian_inverse(&w);
            for i in 0..3 {
                let moved = |s: f64| log(&(exp(&Vector3::ith(i, s)) * exp(&w)));
                let column = (moved(h) - moved(-h)) / (2.0 * h);
                assert!((column - jacobian.column(i)).norm() < 1e-8, "{w}");
            }
        }
    }
}
