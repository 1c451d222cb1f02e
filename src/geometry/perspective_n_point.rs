//! The pose of a camera from known points and the directions that they are seen in.
//!
//! As in SQPnP (Terzakis and Lourakis 2020) the translation is eliminated from the error in object space, which leaves
//! a quadratic form rᵀ Ω r in the nine elements of the rotation. Its minima on SO(3) are found from starts that cover
//! all rotations, at a cost that does not depend on the number of points, and then refined on the angles.
use super::reprojection::refine;
use super::rotation::nearest_rotation;
use handeye_solvers::Pose;
use handeye_solvers::manifold::so3;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

type Matrix9 = SMatrix<f64, 9, 9>;
type Matrix3x9 = SMatrix<f64, 3, 9>;
type Vector9 = SVector<f64, 9>;

/// Iterations from one start; minima are isolated, and refined again afterwards.
const ITERATIONS: usize = 20;

/// Eigenvectors of Ω that serve as starts.
const EIGENVECTORS: usize = 4;

/// Most solutions: three points have up to four.
const SOLUTIONS: usize = 4;

/// Two rotations closer than this (Frobenius norm) are one solution.
const SAME: f64 = 1e-3;

/// The poses `camera_from_points` that may have been, least error first: at most 4.
///
/// `points`: at least 3, in any frame and unit. `bearings`: unit directions in the camera's frame, by index. The error
/// is Σ |q / |q| - b|², q the point in the camera's frame. Every minimum of it that has all points in front of the
/// camera is a candidate: points in a plane often have two, three points up to four. Empty for collinear points.
pub fn resect(points: &[Vector3<f64>], bearings: &[Vector3<f64>]) -> Vec<Pose> {
    resect_with_errors(points, bearings).into_iter().map(|(pose, _)| pose).collect()
}

/// The poses and their errors [rad²].
pub(super) fn resect_with_errors(points: &[Vector3<f64>], bearings: &[Vector3<f64>]) -> Vec<(Pose, f64)> {
    if points.len() < 3 || points.len() != bearings.len() {
        return Vec::new();
    }
    // Centred and scaled to a size of 1, so that nothing below depends on frame and unit.
    let n = points.len() as f64;
    let mean = points.iter().sum::<Vector3<f64>>() / n;
    let size = (points.iter().map(|p| (p - mean).norm_squared()).sum::<f64>() / n).sqrt();
    if !(size > 0.0 && size.is_finite()) {
        return Vec::new();
    }
    let scaled: Vec<_> = points.iter().map(|p| (p - mean) / size).collect();
    let Some(form) = Form::new(&scaled, bearings) else { return Vec::new() };
    let all: Vec<usize> = (0..points.len()).collect();
    let mut solutions: Vec<(Pose, f64)> = Vec::new();
    for rotation in form.minima() {
        let start = Pose { rotation, translation: form.translation(&rotation) };
        if !in_front(&start, &scaled, bearings) {
            continue;
        }
        let Some((pose, error)) = refine(&start, &scaled, bearings, &all) else { continue };
        let is_new = solutions.iter().all(|(other, _)| (other.rotation - pose.rotation).norm() > SAME);
        if is_new && in_front(&pose, &scaled, bearings) {
            solutions.push((pose, error));
        }
    }
    solutions.sort_by(|p, q| p.1.total_cmp(&q.1));
    solutions.truncate(SOLUTIONS);
    for (pose, _) in &mut solutions {
        pose.translation = pose.translation * size - pose.rotation * mean;
    }
    solutions
}

fn in_front(camera: &Pose, points: &[Vector3<f64>], bearings: &[Vector3<f64>]) -> bool {
    points.iter().zip(bearings).all(|(p, b)| camera.transform(p).dot(b) > 0.0)
}

/// rᵀ Ω r, the error in object space with the best translation, t = T r; r is the rotation by columns.
struct Form {
    omega: Matrix9,
    translation: Matrix3x9,
}

impl Form {
    /// `None` where the bearings are all one, or not finite.
    fn new(points: &[Vector3<f64>], bearings: &[Vector3<f64>]) -> Option<Self> {
        let (mut omega, mut linear, mut total) = (Matrix9::zeros(), Matrix3x9::zeros(), Matrix3::zeros());
        for (p, b) in points.iter().zip(bearings) {
            // Q (R p + t) with Q = I - b bᵀ, and R p = A r.
            let q = Matrix3::identity() - b * b.transpose();
            for i in 0..3 {
                let scaled = q * p[i];
                let mut columns = linear.fixed_view_mut::<3, 3>(0, 3 * i);
                columns += scaled;
                for j in 0..3 {
                    let mut block = omega.fixed_view_mut::<3, 3>(3 * i, 3 * j);
                    block += scaled * p[j];
                }
            }
            total += q;
        }
        let translation = -(total.cholesky()?.inverse() * linear);
        omega += linear.transpose() * translation;
        omega.iter().all(|v| v.is_finite()).then_some(Form { omega, translation })
    }

    fn translation(&self, rotation: &Matrix3<f64>) -> Vector3<f64> {
        self.translation * Vector9::from_column_slice(rotation.as_slice())
    }

    /// Local minima over all rotations, each once.
    fn minima(&self) -> Vec<Matrix3<f64>> {
        let mut found: Vec<Matrix3<f64>> = Vec::new();
        for start in self.starts() {
            let Some(minimum) = self.descend(start) else { continue };
            if found.iter().all(|other| (other - minimum).norm() > SAME) {
                found.push(minimum);
            }
        }
        found
    }

    /// The rotations nearest to the flattest directions of Ω, then the 24 of a cube: none is farther than 63° from one.
    fn starts(&self) -> Vec<Matrix3<f64>> {
        let mut starts = Vec::new();
        if let Some(eigen) = self.omega.try_symmetric_eigen(f64::EPSILON, 200) {
            let mut order: Vec<usize> = (0..9).collect();
            order.sort_by(|&i, &j| eigen.eigenvalues[i].total_cmp(&eigen.eigenvalues[j]));
            for &k in &order[..EIGENVECTORS] {
                let matrix = Matrix3::from_column_slice(eigen.eigenvectors.column(k).as_slice());
                starts.extend([matrix, -matrix].iter().filter_map(nearest_rotation));
            }
        }
        for [i, j] in [[0, 1], [1, 2], [2, 0], [0, 2], [2, 1], [1, 0]] {
            for (s, t) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
                let (x, y) = (Vector3::ith(i, s), Vector3::ith(j, t));
                starts.push(Matrix3::from_columns(&[x, y, x.cross(&y)]));
            }
        }
        starts
    }

    /// Levenberg-Marquardt on SO(3); `None` where it does not arrive.
    fn descend(&self, mut rotation: Matrix3<f64>) -> Option<Matrix3<f64>> {
        let vector = |r: &Matrix3<f64>| Vector9::from_column_slice(r.as_slice());
        let mut gradient9 = self.omega * vector(&rotation);
        let mut cost = vector(&rotation).dot(&gradient9);
        let mut lambda = 1e-4;
        for _ in 0..ITERATIONS {
            // d vec(exp(w) R) = J dw, with eₖ × (columns of R) as the columns of J.
            let tangent = |k: usize| vector(&(so3::cross_matrix(&Vector3::ith(k, 1.0)) * rotation));
            let jacobian = SMatrix::<f64, 9, 3>::from_columns(&[tangent(0), tangent(1), tangent(2)]);
            let mut hessian = jacobian.transpose() * (self.omega * jacobian);
            let damping = lambda * hessian.trace();
            (0..3).for_each(|k| hessian[(k, k)] += damping);
            let step = -hessian.cholesky()?.solve(&(jacobian.transpose() * gradient9));
            let next = so3::renormalize(&(so3::exp(&step) * rotation));
            let next_gradient = self.omega * vector(&next);
            let next_cost = vector(&next).dot(&next_gradient);
            if next_cost < cost {
                (rotation, gradient9, cost, lambda) = (next, next_gradient, next_cost, lambda * 0.1);
            } else {
                lambda *= 10.0;
            }
            if step.norm_squared() < 1e-14 {
                return Some(rotation);
            }
        }
        Some(rotation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::ransac::tests::{Random, distance};

    pub(super) fn scene(random: &mut Random, n: usize, flat: f64) -> (Pose, Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
        let truth = Pose::new(random.vector(1.8), random.vector(0.5) + Vector3::z() * 4.0);
        let frame = Pose::new(random.vector(1.0), random.vector(1.0));
        let points: Vec<_> =
            (0..n).map(|_| frame.transform(&random.vector(1.0).component_mul(&Vector3::new(1.0, 1.0, flat)))).collect();
        let bearings = points.iter().map(|p| truth.transform(p).normalize()).collect();
        (truth, points, bearings)
    }

    #[test]
    fn exact_points_give_the_exact_pose_first() {
        for (n, flat) in [(4, 1.0), (6, 1.0), (20, 1.0), (5, 0.0), (20, 0.0)] {
            let mut right = 0;
            for seed in 0..100 {
                let (truth, points, bearings) = scene(&mut Random::new(seed), n, flat);
                let found = resect(&points, &bearings);
                right += usize::from(found.first().is_some_and(|pose| distance(pose, &truth) < 1e-9));
            }
            assert!(right >= 99, "{right} of 100 with {n} points, flat {flat}");
        }
    }

    #[test]
    fn three_points_have_the_truth_among_their_solutions() {
        let mut right = 0;
        for seed in 0..100 {
            let (truth, points, bearings) = scene(&mut Random::new(seed), 3, 1.0);
            right += usize::from(resect(&points, &bearings).iter().any(|pose| distance(pose, &truth) < 1e-6));
        }
        assert!(right >= 95, "{right} of 100");
    }

    // Seen from 30 times its size, a square tilted by 30° looks the same as one tilted the other way.
    #[test]
    fn a_small_distant_plane_has_two_poses() {
        let truth = Pose::new(Vector3::x() * (std::f64::consts::PI - 0.5), Vector3::z() * 30.0);
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| Vector3::new(x, y, 0.0));
        let bearings = corners.map(|p| truth.transform(&p).normalize());
        let found = resect(&corners, &bearings);
        assert!(found.len() >= 2 && distance(&found[0], &truth) < 1e-6);
        assert!((found[1].angle_to(&truth) - 1.0).abs() < 0.1, "{}", found[1].angle_to(&truth));
    }

    // 2 n - 6 degrees of freedom: over 100 sets of 20, χ² with 3400, standard deviation 82; 3 σ.
    #[test]
    fn errors_of_noisy_bearings_follow_chi_square() {
        let (sigma, mut sum) = (1e-3, 0.0);
        for seed in 0..100 {
            let mut random = Random::new(seed);
            let (_, points, bearings) = scene(&mut random, 20, 1.0);
            let noisy: Vec<_> = bearings.iter().map(|b| random.tilted(b, sigma)).collect();
            sum += resect_with_errors(&points, &noisy)[0].1;
        }
        assert!((sum / (sigma * sigma) - 3400.0).abs() < 3.0 * 82.5, "{}", sum / (sigma * sigma));
    }

    #[test]
    fn collinear_or_missing_points_give_nothing() {
        let (truth, points, bearings) = scene(&mut Random::new(0), 6, 1.0);
        assert!(resect(&points[..2], &bearings[..2]).is_empty());
        assert!(resect(&points, &bearings[1..]).is_empty());
        assert!(resect(&[points[0]; 6], &[bearings[0]; 6]).is_empty());
        assert!(resect(&[Vector3::repeat(f64::NAN); 6], &bearings).is_empty());
        let line: Vec<_> = (0..6).map(|i| Vector3::new(0.1, 0.2, -0.3) * f64::from(i)).collect();
        let seen: Vec<_> = line.iter().map(|p| truth.transform(p).normalize()).collect();
        assert!(resect(&line, &seen).is_empty());
    }
}
