//! The fixed pose between two frames that move together, from poses of both.
use super::rotation::nearest_rotation;
use handeye_solvers::Pose;
use handeye_solvers::manifold::so3;
use nalgebra::{Matrix3, Matrix6, SMatrix, SVector, Vector3, Vector6};

/// From this angle of a motion on [rad] its weight falls to 0 at half a turn, where its axis has no sign.
const HALF_TURN: f64 = 3.0;

/// Least ratio of the extreme eigenvalues of normal equations at which the translation counts as determined: motions
/// about axes 3e-5 rad apart.
const DETERMINED: f64 = 1e-9;

/// X with aᵢ X = X bᵢ, from relative motions (Park and Martin 1994).
///
/// For a camera on the arm, aᵢ is a motion of the tip, `tip(s)_from_tip(t)`, bᵢ the camera's over the same samples,
/// `camera(s)_from_camera(t)`, and X is `tip_from_camera`. `a` and `b` correspond by index, at least 2. `None` where
/// all motions turn about one axis, or none turns.
pub fn hand_eye_park(a: &[Pose], b: &[Pose]) -> Option<Pose> {
    if a.len() < 2 || a.len() != b.len() {
        return None;
    }
    // The rotation vectors of a are those of b, turned by X.
    let moment = a.iter().zip(b).map(|(a, b)| {
        let (alpha, beta) = (so3::log(&a.rotation), so3::log(&b.rotation));
        let weight =
            |v: &Vector3<f64>| ((std::f64::consts::PI - v.norm()) / (std::f64::consts::PI - HALF_TURN)).clamp(0.0, 1.0);
        alpha * beta.transpose() * (weight(&alpha) * weight(&beta))
    });
    let rotation = nearest_rotation(&moment.sum::<Matrix3<f64>>())?;
    // (R_a - I) t_x = R_x t_b - t_a
    let (mut hessian, mut vector) = (Matrix3::zeros(), Vector3::zeros());
    for (a, b) in a.iter().zip(b) {
        let rows = a.rotation - Matrix3::identity();
        hessian += rows.transpose() * rows;
        vector += rows.transpose() * (rotation * b.translation - a.translation);
    }
    let eigenvalues = hessian.try_symmetric_eigen(f64::EPSILON, 100)?.eigenvalues;
    (eigenvalues.min() > DETERMINED * eigenvalues.max()).then_some(())?;
    let translation = hessian.cholesky()?.solve(&vector);
    translation.iter().all(|x| x.is_finite()).then_some(Pose { rotation, translation })
}

/// X and Z with aᵢ X = Z bᵢ, from poses (Shah 2013, by the Kronecker product).
///
/// For a camera that watches a target on the arm, aᵢ is `base_from_tip`, bᵢ `camera_from_target`, X is
/// `tip_from_target` and Z `base_from_camera`. `a` and `b` correspond by index, at least 3. `None` where the rotations
/// share one axis.
pub fn robot_world(a: &[Pose], b: &[Pose]) -> Option<(Pose, Pose)> {
    if a.len() < 3 || a.len() != b.len() {
        return None;
    }
    // vec(R_a R_x R_bᵀ) = (R_b ⊗ R_a) vec(R_x), which is the same for all samples: the sum stretches vec(R_x) most.
    let sum =
        a.iter().zip(b).map(|(a, b)| b.rotation.kronecker(&a.rotation)).sum::<SMatrix<f64, 9, 9>>() / a.len() as f64;
    let eigen = (sum.transpose() * sum).try_symmetric_eigen(f64::EPSILON, 200)?;
    let mut order: Vec<usize> = (0..9).collect();
    order.sort_by(|&i, &j| eigen.eigenvalues[j].total_cmp(&eigen.eigenvalues[i]));
    let [first, second] = [order[0], order[1]];
    (eigen.eigenvalues[first] - eigen.eigenvalues[second] > DETERMINED * eigen.eigenvalues[first]).then_some(())?;
    let stretched: SVector<f64, 9> = eigen.eigenvectors.column(first).into_owned();
    let matrix = Matrix3::from_column_slice(stretched.as_slice());
    let r_x = nearest_rotation(&(matrix * matrix.determinant().signum()))?;
    let turned = a.iter().zip(b).map(|(a, b)| a.rotation * r_x * b.rotation.transpose());
    let r_z = nearest_rotation(&turned.sum::<Matrix3<f64>>())?;
    // [R_a, -I] (t_x, t_z) = R_z t_b - t_a
    let (mut hessian, mut vector) = (Matrix6::zeros(), Vector6::zeros());
    for (a, b) in a.iter().zip(b) {
        let mut rows = SMatrix::<f64, 3, 6>::zeros();
        rows.fixed_view_mut::<3, 3>(0, 0).copy_from(&a.rotation);
        rows.fixed_view_mut::<3, 3>(0, 3).copy_from(&-Matrix3::identity());
        hessian += rows.transpose() * rows;
        vector += rows.transpose() * (r_z * b.translation - a.translation);
    }
    let eigenvalues = hessian.try_symmetric_eigen(f64::EPSILON, 100)?.eigenvalues;
    (eigenvalues.min() > DETERMINED * eigenvalues.max()).then_some(())?;
    let t = hessian.cholesky()?.solve(&vector);
    let pose = |rotation, k: usize| Pose { rotation, translation: t.fixed_rows::<3>(k).into_owned() };
    t.iter().all(|x| x.is_finite()).then(|| (pose(r_x, 0), pose(r_z, 3)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::ransac::tests::{Random, distance};

    fn pose(random: &mut Random) -> Pose {
        Pose::new(random.vector(1.7), random.vector(1.0))
    }

    #[test]
    fn exact_motions_give_the_exact_pose_between_the_frames() {
        for seed in 0..100 {
            let mut random = Random::new(seed);
            let x = pose(&mut random);
            let a: Vec<_> = (0..2 + seed % 6).map(|_| pose(&mut random)).collect();
            let b: Vec<_> = a.iter().map(|&a| x.inverse() * a * x).collect();
            assert!(distance(&hand_eye_park(&a, &b).unwrap(), &x) < 1e-9, "seed {seed}");
        }
    }

    #[test]
    fn exact_poses_give_both_exact_frames() {
        for seed in 0..100 {
            let mut random = Random::new(seed);
            let (x, z) = (pose(&mut random), pose(&mut random));
            let a: Vec<_> = (0..4 + seed % 6).map(|_| pose(&mut random)).collect();
            let b: Vec<_> = a.iter().map(|&a| z.inverse() * a * x).collect();
            let (found_x, found_z) = robot_world(&a, &b).unwrap();
            assert!(distance(&found_x, &x) < 1e-9 && distance(&found_z, &z) < 1e-9, "seed {seed}");
        }
    }

    // Each of the 30 motions has an error of σ in rotation and in translation, and the motions are of the order of 1:
    // 10 σ is far out for each of 100 estimates.
    #[test]
    fn noisy_motions_give_a_pose_within_the_noise() {
        let sigma = 1e-3;
        for seed in 0..100 {
            let mut random = Random::new(seed);
            let (x, z) = (pose(&mut random), pose(&mut random));
            let a: Vec<_> = (0..30).map(|_| pose(&mut random)).collect();
            let mut noisy = |p: Pose| Pose::new(random.gaussian(sigma), random.gaussian(sigma)) * p;
            let b: Vec<_> = a.iter().map(|&a| noisy(x.inverse() * a * x)).collect();
            assert!(distance(&hand_eye_park(&a, &b).unwrap(), &x) < 10.0 * sigma);
            let b: Vec<_> = a.iter().map(|&a| noisy(z.inverse() * a * x)).collect();
            let (found_x, found_z) = robot_world(&a, &b).unwrap();
            assert!(distance(&found_x, &x) < 10.0 * sigma && distance(&found_z, &z) < 10.0 * sigma);
        }
    }

    #[test]
    fn one_axis_does_not_determine_the_pose() {
        let mut random = Random::new(4);
        let (x, z) = (pose(&mut random), pose(&mut random));
        let a: Vec<_> = (1..9).map(|i| Pose::new(Vector3::z() * 0.2 * f64::from(i), random.vector(1.0))).collect();
        let b: Vec<_> = a.iter().map(|&a| x.inverse() * a * x).collect();
        assert_eq!(hand_eye_park(&a, &b), None);
        let b: Vec<_> = a.iter().map(|&a| z.inverse() * a * x).collect();
        assert_eq!(robot_world(&a, &b), None);
        let still = [Pose::identity(); 5];
        assert_eq!(hand_eye_park(&still, &still), None);
        assert_eq!(robot_world(&still, &still), None);
        assert_eq!(hand_eye_park(&a[..1], &b[..1]), None);
        assert_eq!(robot_world(&a, &b[1..]), None);
    }
}
