//! Standard Denavit-Hartenberg links, with Hayati's extra rotation (Hayati and Mirmirani 1985).
use handeye_solvers::{Pose, Scalar};
use nalgebra::{Matrix3, Vector3};

/// Rz(angle) Tz(d) Tx(a) Rx(alpha) Ry(beta), multiplied out.
#[inline]
pub(super) fn link<T: Scalar>(angle: T, d: T, a: T, alpha: T, beta: T) -> Pose<T> {
    let (s, c) = angle.sin_cos();
    let [m1, m2, m3] = twist(alpha, beta);
    // Rz times the rows of Rx Ry, of which the first has a zero in the middle.
    Pose {
        rotation: Matrix3::new(
            c * m1[0] - s * m2[0],
            -s * m2[1],
            c * m1[2] - s * m2[2],
            s * m1[0] + c * m2[0],
            c * m2[1],
            s * m1[2] + c * m2[2],
            m3[0],
            m3[1],
            m3[2],
        ),
        translation: Vector3::new(a * c, a * s, d),
    }
}

/// Rx(alpha) Ry(beta), by rows.
#[inline]
pub(super) fn twist<T: Scalar>(alpha: T, beta: T) -> [[T; 3]; 3] {
    let ((sa, ca), (sb, cb)) = (alpha.sin_cos(), beta.sin_cos());
    [[cb, T::zero(), sb], [sa * sb, ca, -sa * cb], [-ca * sb, sa, ca * cb]]
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::chain::{Convention, JointKind};
    use handeye_solvers::manifold::so3;

    pub(in crate::chain) fn turn(axis: usize, angle: f64) -> Pose {
        Pose { rotation: so3::exp(&Vector3::ith(axis, angle)), translation: Vector3::zeros() }
    }

    pub(in crate::chain) fn shift(axis: usize, length: f64) -> Pose {
        Pose { rotation: Matrix3::identity(), translation: Vector3::ith(axis, length) }
    }

    pub(in crate::chain) fn distance(a: &Pose, b: &Pose) -> f64 {
        (a.rotation - b.rotation).norm() + (a.translation - b.translation).norm()
    }

    #[test]
    fn a_link_is_the_product_of_its_elementary_motions() {
        let (offset, d, a, alpha, beta, j) = (0.3, 0.1, -0.2, 1.1, 0.07, 0.9);
        let expected = |angle, d| turn(2, angle) * shift(2, d) * shift(0, a) * turn(0, alpha) * turn(1, beta);
        let link = |kind| Convention::Dh.link(kind, &[offset, d, a, alpha, beta], j);
        assert!(distance(&link(JointKind::Revolute), &expected(offset + j, d)) < 1e-15);
        assert!(distance(&link(JointKind::Prismatic), &expected(offset, d + j)) < 1e-15);
    }
}
