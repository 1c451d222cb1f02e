//! The pose of a camera from known points and the directions that they are seen in.
//!
//! The minima of the error in object space are found from starts that cover all rotations, at a cost that does not depend on the
//! number of points, and then refined on the angles.
use super::object_space::{ObjectSpace, SAME};
use super::reprojection::refine;
use handeye_solvers::Pose;
use nalgebra::Vector3;

/// Most solutions: three points have up to four.
const SOLUTIONS: usize = 4;

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
    let Some(form) = ObjectSpace::new(&scaled, &[], bearings) else { return Vec::new() };
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
