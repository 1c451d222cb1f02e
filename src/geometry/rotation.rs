//! Singular values of 3 x 3 matrices, and the rotation nearest to one.
//!
//! nalgebra's decomposition of this size goes through Mᵀ M, which loses half of the digits where a singular value is
//! small (it is 0 for every essential matrix and every planar set of points). One-sided Jacobi rotations do not.
use nalgebra::{Matrix3, Vector3};

/// M = U diag(s) Vᵀ with rotations V and U (to a sign in its last column) and s in descending order.
pub(super) struct Svd {
    pub u: Matrix3<f64>,
    pub s: Vector3<f64>,
    pub v: Matrix3<f64>,
}

/// Sweeps over the three pairs of columns: convergence is quadratic, 4 or 5 are the rule.
const SWEEPS: usize = 30;

/// `None` where the matrix is not finite or has a rank below 2.
pub(super) fn svd(m: &Matrix3<f64>) -> Option<Svd> {
    let scale = m.amax();
    if !(scale > 0.0 && scale.is_finite()) {
        return None;
    }
    let (mut b, mut v) = (m / scale, Matrix3::identity());
    for _ in 0..SWEEPS {
        let mut turned = false;
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            let (x, y) = (b.column(i).norm_squared(), b.column(j).norm_squared());
            let dot = b.column(i).dot(&b.column(j));
            if dot.abs() <= 1e-16 * (x * y).sqrt() {
                continue;
            }
            turned = true;
            // The smaller of the two angles that make the columns orthogonal.
            let zeta = (y - x) / (2.0 * dot);
            let t = zeta.signum() / (zeta.abs() + (1.0 + zeta * zeta).sqrt());
            let c = 1.0 / (1.0 + t * t).sqrt();
            for matrix in [&mut b, &mut v] {
                let (p, q) = (
                    matrix.column(i) * c - matrix.column(j) * (c * t),
                    matrix.column(j) * c + matrix.column(i) * (c * t),
                );
                matrix.set_column(i, &p);
                matrix.set_column(j, &q);
            }
        }
        if !turned {
            break;
        }
    }
    for (i, j) in [(0, 1), (0, 2), (1, 2)] {
        if b.column(i).norm_squared() < b.column(j).norm_squared() {
            for matrix in [&mut b, &mut v] {
                matrix.swap_columns(i, j);
                matrix.column_mut(j).neg_mut();
            }
        }
    }
    let [b1, b2, b3]: [Vector3<f64>; 3] = std::array::from_fn(|k| b.column(k).into_owned());
    let (s1, s2, s3) = (b1.norm(), b2.norm(), b3.norm());
    if s2 <= 1e-15 * s1 {
        return None;
    }
    let (u1, u2) = (b1 / s1, b2 / s2);
    let u3 = u1.cross(&u2).normalize();
    let u3 = if u3.dot(&b3) < 0.0 { -u3 } else { u3 };
    Some(Svd { u: Matrix3::from_columns(&[u1, u2, u3]), s: Vector3::new(s1, s2, s3) * scale, v })
}

/// Below this ratio to the first, the second and third singular value do not fix a rotation: a set of points that is
/// 100,000 times as long as it is wide.
const COLLINEAR: f64 = 1e-10;

/// The rotation R that maximises tr(Rᵀ M), which is the one nearest to M (Arun et al. 1987, with Umeyama's sign).
///
/// `None` where M leaves it open: its rank is below 2, or it is as near to two rotations.
pub fn nearest_rotation(m: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let (rotation, _) = nearest_rotation_and_trace(m)?;
    Some(rotation)
}

/// The rotation and tr(Rᵀ M).
pub(super) fn nearest_rotation_and_trace(m: &Matrix3<f64>) -> Option<(Matrix3<f64>, f64)> {
    let Svd { u, s, v } = svd(m)?;
    let sign = u.determinant().signum();
    if s[1] + sign * s[2] <= COLLINEAR * s[0] {
        return None;
    }
    let rotation = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v.transpose();
    Some((rotation, s[0] + s[1] + sign * s[2]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use handeye_solvers::manifold::so3;

    fn matrices() -> impl Iterator<Item = Matrix3<f64>> {
        (0..200).map(|i| {
            let number = |k: usize| (f64::from(i) * 3.7 + k as f64 * 1.3).sin();
            let m = Matrix3::from_fn(|r, c| number(3 * r + c));
            match i % 4 {
                0 => m,
                1 => so3::cross_matrix(&Vector3::new(number(1), number(2), number(3))) * so3::exp(&m.column(0).into()),
                2 => m * Matrix3::from_diagonal(&Vector3::new(1.0, 1e-6, 1e-12)),
                _ => Matrix3::from_diagonal(&Vector3::new(number(0), -number(1), number(2))),
            }
        })
    }

    #[test]
    fn factors_are_orthogonal_sorted_and_multiply_back() {
        for m in matrices() {
            let Svd { u, s, v } = svd(&m).unwrap();
            assert!((u.transpose() * u - Matrix3::identity()).norm() < 1e-13);
            assert!((v.transpose() * v - Matrix3::identity()).norm() < 1e-13);
            assert!((v.determinant() - 1.0).abs() < 1e-13);
            assert!(s[0] >= s[1] && s[1] >= s[2]);
            assert!((u * Matrix3::from_diagonal(&s) * v.transpose() - m).norm() < 1e-14, "{m}");
        }
    }

    #[test]
    fn no_small_turn_brings_the_nearest_rotation_nearer() {
        for m in matrices() {
            let Some(rotation) = nearest_rotation(&m) else { continue };
            assert!((rotation.determinant() - 1.0).abs() < 1e-12);
            for k in 0..6 {
                let turned = so3::exp(&Vector3::ith(k % 3, if k < 3 { 1e-4 } else { -1e-4 })) * rotation;
                assert!((m - turned).norm() >= (m - rotation).norm() - 1e-14, "{m}");
            }
        }
    }

    #[test]
    fn a_matrix_of_rank_one_has_no_nearest_rotation() {
        let v = Vector3::new(0.3, -0.2, 0.9);
        assert_eq!(nearest_rotation(&(v * v.transpose())), None);
        assert_eq!(nearest_rotation(&Matrix3::zeros()), None);
        assert_eq!(nearest_rotation(&Matrix3::from_element(f64::NAN)), None);
        assert_eq!(nearest_rotation(&-Matrix3::identity()), None);
    }
}
