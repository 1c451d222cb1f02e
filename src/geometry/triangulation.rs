//! The point that several cameras see.
use handeye_solvers::Pose;
use nalgebra::{Matrix3, Vector3};

/// Gauss-Newton steps after the linear solution.
const STEPS: usize = 2;

/// Least eigenvalue of the mean of I - d dᵀ over the rays: two rays at an angle φ give φ² / 4, so this is φ = 2e-6 rad,
/// where rounding alone moves the point by a thousandth of its distance.
const PARALLEL: f64 = 1e-12;

/// The point in the world that n cameras see in given directions.
///
/// The point nearest to all rays in space, then Gauss-Newton steps on the angles, Σ |q / |q| - b|² with q the point in
/// the camera. `cameras_from_world` and unit `bearings` (in the camera's frame) correspond by index. `None` for fewer
/// than 2 rays, for parallel ones, and where the point would lie behind one of the cameras.
pub fn triangulate(cameras_from_world: &[Pose], bearings: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    let n = cameras_from_world.len();
    if n < 2 || n != bearings.len() {
        return None;
    }
    let (mut matrix, mut vector) = (Matrix3::zeros(), Vector3::zeros());
    for (camera, bearing) in cameras_from_world.iter().zip(bearings) {
        let direction = camera.rotation.transpose() * bearing;
        let across = Matrix3::identity() - direction * direction.transpose();
        matrix += across;
        vector += across * camera.inverse_transform(&Vector3::zeros());
    }
    let least = matrix.try_symmetric_eigen(f64::EPSILON, 100)?.eigenvalues.min();
    if least.is_nan() || least <= PARALLEL * n as f64 {
        return None;
    }
    let mut point = matrix.cholesky()?.solve(&vector);
    for _ in 0..STEPS {
        if let Some(better) = step(cameras_from_world, bearings, &point) {
            point = better;
        }
    }
    let in_front = |(camera, bearing): (&Pose, &Vector3<f64>)| camera.transform(&point).dot(bearing) > 0.0;
    (point.iter().all(|x| x.is_finite()) && cameras_from_world.iter().zip(bearings).all(in_front)).then_some(point)
}

/// One Gauss-Newton step; `None` where it does not lower the error.
fn step(cameras: &[Pose], bearings: &[Vector3<f64>], point: &Vector3<f64>) -> Option<Vector3<f64>> {
    let (mut hessian, mut gradient) = (Matrix3::zeros(), Vector3::zeros());
    for (camera, bearing) in cameras.iter().zip(bearings) {
        let in_camera = camera.transform(point);
        let distance = in_camera.norm();
        let direction = in_camera / distance;
        // d(q / |q|) / dp = (I - u uᵀ) R / |q|
        let jacobian = (camera.rotation - direction * (direction.transpose() * camera.rotation)) / distance;
        hessian += jacobian.transpose() * jacobian;
        gradient += jacobian.transpose() * (direction - bearing);
    }
    let next = point - hessian.cholesky()?.solve(&gradient);
    (error(cameras, bearings, &next) <= error(cameras, bearings, point)).then_some(next)
}

/// Σ |q / |q| - b|² [rad²].
fn error(cameras: &[Pose], bearings: &[Vector3<f64>], point: &Vector3<f64>) -> f64 {
    let squared = |(camera, bearing): (&Pose, &Vector3<f64>)| {
        let in_camera = camera.transform(point);
        (in_camera / in_camera.norm() - bearing).norm_squared()
    };
    cameras.iter().zip(bearings).map(squared).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::ransac::tests::Random;

    /// Cameras about 2 m from the origin that look at it, and a point near it.
    fn scene(random: &mut Random, n: usize) -> (Vec<Pose>, Vector3<f64>, Vec<Vector3<f64>>) {
        let cameras: Vec<_> =
            (0..n).map(|_| Pose::new(random.vector(0.5), random.vector(0.5) + Vector3::z() * 2.0)).collect();
        let point = random.vector(0.3);
        let bearings = cameras.iter().map(|c| c.transform(&point).normalize()).collect();
        (cameras, point, bearings)
    }

    #[test]
    fn exact_rays_meet_in_the_point() {
        for seed in 0..100 {
            let (cameras, point, bearings) = scene(&mut Random::new(seed), 2 + seed as usize % 5);
            assert!((triangulate(&cameras, &bearings).unwrap() - point).norm() < 1e-9);
        }
    }

    // With σ of noise per direction and n = 6 rays the residuals have 2 n - 3 = 9 degrees of freedom: over 100 points
    // χ² with 900, standard deviation 42; 3 σ.
    #[test]
    fn residuals_of_noisy_rays_follow_chi_square() {
        let sigma = 1e-3;
        let mut sum = 0.0;
        for seed in 0..100 {
            let mut random = Random::new(seed);
            let (cameras, _, bearings) = scene(&mut random, 6);
            let noisy: Vec<_> = bearings.iter().map(|b| random.tilted(b, sigma)).collect();
            sum += error(&cameras, &noisy, &triangulate(&cameras, &noisy).unwrap());
        }
        assert!((sum / (sigma * sigma) - 900.0).abs() < 3.0 * 42.5, "{}", sum / (sigma * sigma));
    }

    #[test]
    fn parallel_rays_and_points_behind_give_none() {
        let (cameras, _, bearings) = scene(&mut Random::new(3), 3);
        assert_eq!(triangulate(&cameras[..1], &bearings[..1]), None);
        assert_eq!(triangulate(&[cameras[0]; 3], &[bearings[0]; 3]), None);
        let behind: Vec<_> = bearings.iter().map(|b| -b).collect();
        assert_eq!(triangulate(&cameras, &behind), None);
        assert_eq!(triangulate(&cameras, &[Vector3::repeat(f64::NAN); 3]), None);
        let beside = [Pose::identity(), Pose::new(Vector3::zeros(), -Vector3::x())];
        assert_eq!(triangulate(&beside, &[Vector3::z(); 2]), None);
    }
}
