//! Essential matrices: E = [t] R for p_b = R p_a + t, so that bᵀ E a = 0 for the bearings of every point.
use super::rotation::{Svd, svd};
use handeye_solvers::Pose;
use handeye_solvers::manifold::so3::cross_matrix;
use nalgebra::{Matrix3, Vector3};

/// E = [t / |t|] R of a pose `b_from_a`; its Frobenius norm is √2.
pub fn essential(b_from_a: &Pose) -> Matrix3<f64> {
    cross_matrix(&b_from_a.translation.normalize()) * b_from_a.rotation
}

/// The four poses `b_from_a`, with a baseline of length 1, of an essential matrix (Hartley and Zisserman, result 9.19).
///
/// Of these, the true one puts the points in front of both cameras: see [`in_front_of_both`]. `None` for a matrix of
/// rank below 2.
pub fn decompose(e: &Matrix3<f64>) -> Option<[Pose; 4]> {
    let Svd { mut u, v, .. } = svd(e)?;
    // A sign of u's last column is a sign of t, and all signs of t are taken.
    if u.determinant() < 0.0 {
        u.column_mut(2).neg_mut();
    }
    let quarter = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    let (r1, r2) = (u * quarter * v.transpose(), u * quarter.transpose() * v.transpose());
    let t: Vector3<f64> = u.column(2).into_owned();
    let pose = |rotation, translation| Pose { rotation, translation };
    Some([pose(r1, t), pose(r1, -t), pose(r2, t), pose(r2, -t)])
}

/// Whether the point that two cameras see in directions `a` and `b` lies in front of both.
///
/// `None` where the rays are too nearly parallel to tell: at an angle below `parallax` [rad].
pub fn in_front_of_both(b_from_a: &Pose, a: &Vector3<f64>, b: &Vector3<f64>, parallax: f64) -> Option<bool> {
    // λ_b b = λ_a R a + t; products with b and with R a leave λ_a and λ_b, each times |c|².
    let turned = b_from_a.rotation * a;
    let c = turned.cross(b);
    let t = &b_from_a.translation;
    (c.norm_squared() > parallax * parallax).then(|| b.cross(t).dot(&c) > 0.0 && turned.cross(t).dot(&c) > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::ransac::tests::{Random, distance};

    #[test]
    fn of_four_poses_one_is_true_and_one_puts_points_in_front() {
        for seed in 0..100 {
            let mut random = Random::new(seed);
            let mut pose = Pose::new(random.vector(1.0), random.vector(1.0));
            pose.translation.normalize_mut();
            let poses = decompose(&essential(&pose)).unwrap();
            assert_eq!(poses.iter().filter(|p| distance(p, &pose) < 1e-9).count(), 1);
            // In front of both: along the ray, so that it holds for wide fields of view.
            let point = random.vector(1.0) + Vector3::z() * 3.0;
            let (a, b) = (point.normalize(), pose.transform(&point).normalize());
            let in_front: Vec<_> = poses.iter().filter(|p| in_front_of_both(p, &a, &b, 0.0) == Some(true)).collect();
            assert_eq!(in_front.len(), 1);
            assert!(distance(in_front[0], &pose) < 1e-9);
        }
    }

    #[test]
    fn parallel_rays_tell_nothing_and_a_matrix_of_rank_one_is_none() {
        let pose = Pose::new(Vector3::zeros(), Vector3::x());
        assert_eq!(in_front_of_both(&pose, &Vector3::z(), &Vector3::z(), 1e-6), None);
        assert_eq!(decompose(&Matrix3::zeros()), None);
        assert_eq!(decompose(&(Vector3::x() * Vector3::y().transpose())), None);
    }
}
