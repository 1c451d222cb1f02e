//! Modified Denavit-Hartenberg links (Craig, Introduction to Robotics), with Hayati's extra rotation.
use super::dh::twist;
use handeye_solvers::{Pose, Scalar};
use nalgebra::{Matrix3, Vector3};

/// Rx(alpha) Ry(beta) Tx(a) Rz(angle) Tz(d), multiplied out.
///
/// With beta = 0 it is Craig's Rx(alpha) Tx(a) Rz(angle) Tz(d). Beta stands beside alpha because what it tilts is the
/// joint's own axis against the one before, out of the plane that alpha tilts it in.
#[inline]
pub(super) fn link<T: Scalar>(angle: T, d: T, a: T, alpha: T, beta: T) -> Pose<T> {
    let (s, c) = angle.sin_cos();
    let m = twist(alpha, beta);
    Pose {
        rotation: Matrix3::new(
            c * m[0][0],
            -s * m[0][0],
            m[0][2],
            c * m[1][0] + s * m[1][1],
            c * m[1][1] - s * m[1][0],
            m[1][2],
            c * m[2][0] + s * m[2][1],
            c * m[2][1] - s * m[2][0],
            m[2][2],
        ),
        translation: Vector3::new(a * m[0][0] + d * m[0][2], a * m[1][0] + d * m[1][2], a * m[2][0] + d * m[2][2]),
    }
}

#[cfg(test)]
mod tests {
    use crate::chain::dh::tests::{distance, shift, turn};
    use crate::chain::{Convention, JointKind};

    #[test]
    fn a_link_is_the_product_of_its_elementary_motions() {
        let (offset, d, a, alpha, beta, j) = (0.3, 0.1, -0.2, 1.1, 0.07, 0.9);
        let expected = |angle, d| turn(0, alpha) * turn(1, beta) * shift(0, a) * turn(2, angle) * shift(2, d);
        let link = |kind| Convention::ModifiedDh.link(kind, &[offset, d, a, alpha, beta], j);
        assert!(distance(&link(JointKind::Revolute), &expected(offset + j, d)) < 1e-15);
        assert!(distance(&link(JointKind::Prismatic), &expected(offset, d + j)) < 1e-15);
    }
}
