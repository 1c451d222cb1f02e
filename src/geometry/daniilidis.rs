//! The fixed pose between two frames by dual quaternions, rotation and translation at once.
use handeye_solvers::Pose;
use handeye_solvers::manifold::so3;
use nalgebra::{DMatrix, Matrix3, Vector3, Vector4};

/// Motions that turn by less than this [rad] have no screw axis to speak of and are left out.
const LEAST_TURN: f64 = 1e-3;

/// X with aᵢ X = X bᵢ, from relative motions (Daniilidis 1999), as [`super::hand_eye_park`] takes them.
///
/// A screw keeps its angle and pitch under X, so that the vector parts of the two dual quaternions give six linear equations in
/// the eight numbers of X's. They leave a plane of solutions, on which two quadratic constraints pick X. `None` where fewer
/// than two motions turn, or all about one axis.
pub fn hand_eye_daniilidis(a: &[Pose], b: &[Pose]) -> Option<Pose> {
    let turns = |pose: &Pose| so3::log(&pose.rotation).norm() > LEAST_TURN;
    let pairs: Vec<_> = a.iter().zip(b).filter(|(a, b)| turns(a) && turns(b)).collect();
    if pairs.len() < 2 || a.len() != b.len() {
        return None;
    }
    let mut rows = DMatrix::zeros(6 * pairs.len(), 8);
    for (k, (a, b)) in pairs.iter().enumerate() {
        let ((qa, da), (qb, db)) = (dual_quaternion(a), dual_quaternion(b));
        let block = |x: &Vector4<f64>, y: &Vector4<f64>| -> (Vector3<f64>, Matrix3<f64>) {
            (vector(x) - vector(y), so3::cross_matrix(&(vector(x) + vector(y))))
        };
        let ((real, real_cross), (dual, dual_cross)) = (block(&qa, &qb), block(&da, &db));
        rows.fixed_view_mut::<3, 1>(6 * k, 0).copy_from(&real);
        rows.fixed_view_mut::<3, 3>(6 * k, 1).copy_from(&real_cross);
        rows.fixed_view_mut::<3, 1>(6 * k + 3, 0).copy_from(&dual);
        rows.fixed_view_mut::<3, 3>(6 * k + 3, 1).copy_from(&dual_cross);
        rows.fixed_view_mut::<3, 1>(6 * k + 3, 4).copy_from(&real);
        rows.fixed_view_mut::<3, 3>(6 * k + 3, 5).copy_from(&real_cross);
    }
    let eigen = (rows.transpose() * rows).try_symmetric_eigen(f64::EPSILON, 200)?;
    let mut order: Vec<usize> = (0..8).collect();
    order.sort_by(|&i, &j| eigen.eigenvalues[i].total_cmp(&eigen.eigenvalues[j]));
    (eigen.eigenvalues[order[2]] > 1e-10 * eigen.eigenvalues[order[7]]).then_some(())?;
    let column = |k: usize| {
        let v = eigen.eigenvectors.column(order[k]);
        (Vector4::new(v[0], v[1], v[2], v[3]), Vector4::new(v[4], v[5], v[6], v[7]))
    };
    let ((u1, v1), (u2, v2)) = (column(0), column(1));
    // q = λ₁ u₁ + λ₂ u₂ has length 1 and is at right angles to its dual part.
    let (x, y, z) = (u1.dot(&v1), u1.dot(&v2) + u2.dot(&v1), u2.dot(&v2));
    let length = |s: f64| s * s * u1.norm_squared() + 2.0 * s * u1.dot(&u2) + u2.norm_squared();
    let root = (y * y - 4.0 * x * z).max(0.0).sqrt();
    // λ = (s, 1), or (1, s) where x is 0 and the first root runs away.
    let both = if x.abs() >= z.abs() {
        [(-y + root) / (2.0 * x), (-y - root) / (2.0 * x)].map(|s| (s, 1.0, length(s)))
    } else {
        let other = |s: f64| u1.norm_squared() + 2.0 * s * u1.dot(&u2) + s * s * u2.norm_squared();
        [(-y + root) / (2.0 * z), (-y - root) / (2.0 * z)].map(|s| (1.0, s, other(s)))
    };
    let (l1, l2, _) = both.into_iter().filter(|(.., length)| length.is_finite()).max_by(|a, b| a.2.total_cmp(&b.2))?;
    let (q, dual) = (u1 * l1 + u2 * l2, v1 * l1 + v2 * l2);
    let norm = q.norm();
    let (q, dual) = (q / norm, dual / norm);
    let rotation = so3::from_quaternion([q.y, q.z, q.w, q.x]);
    // t = 2 dual q*
    let (s, v, ds, dv) = (q.x, vector(&q), dual.x, vector(&dual));
    let translation = (dv * s - v * ds - dv.cross(&v)) * 2.0;
    translation.iter().chain(rotation.iter()).all(|x| x.is_finite()).then_some(Pose { rotation, translation })
}

/// The vector part of a quaternion that is written (w, x, y, z).
fn vector(q: &Vector4<f64>) -> Vector3<f64> {
    Vector3::new(q.y, q.z, q.w)
}

/// Real and dual part, each (w, x, y, z), with w >= 0: the same sign for two motions of the same angle.
fn dual_quaternion(pose: &Pose) -> (Vector4<f64>, Vector4<f64>) {
    let [x, y, z, w] = so3::quaternion(&pose.rotation);
    let q = if w < 0.0 { -Vector4::new(w, x, y, z) } else { Vector4::new(w, x, y, z) };
    let (t, v) = (pose.translation, vector(&q));
    let dual = (t * q.x + t.cross(&v)) * 0.5;
    (q, Vector4::new(-0.5 * t.dot(&v), dual.x, dual.y, dual.z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::ransac::tests::{Random, distance};

    fn pose(random: &mut Random) -> Pose {
        Pose::new(random.vector(1.4), random.vector(1.0))
    }

    #[test]
    fn exact_motions_give_the_exact_pose_between_the_frames() {
        for seed in 0..100 {
            let mut random = Random::new(seed);
            let x = pose(&mut random);
            let a: Vec<_> = (0..3 + seed % 6).map(|_| pose(&mut random)).collect();
            let b: Vec<_> = a.iter().map(|&a| x.inverse() * a * x).collect();
            let found = hand_eye_daniilidis(&a, &b).unwrap();
            assert!(distance(&found, &x) < 1e-7, "seed {seed}: {}", distance(&found, &x));
        }
    }

    #[test]
    fn one_axis_does_not_determine_the_pose() {
        let mut random = Random::new(4);
        let x = pose(&mut random);
        let a: Vec<_> = (1..9).map(|i| Pose::new(Vector3::z() * 0.2 * f64::from(i), random.vector(1.0))).collect();
        let b: Vec<_> = a.iter().map(|&a| x.inverse() * a * x).collect();
        assert_eq!(hand_eye_daniilidis(&a, &b), None);
    }
}
