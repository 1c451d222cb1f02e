//! The pose of a camera from known points, with wrong correspondences among them.
use super::perspective_n_point::resect_with_errors;
use super::ransac::{draw, enough, subset};
use super::reprojection::{refine, squared_distance};
use handeye_solvers::Pose;
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Samples that are drawn at least and at most.
const SAMPLES: [usize; 2] = [20, 150];

/// Points on which hypotheses are scored; the solution is refined and judged on all.
const SCORED: usize = 300;

/// The pose of a camera among known points.
#[derive(Clone, Debug, PartialEq)]
pub struct Resection {
    /// Maps the points into the camera's frame.
    pub camera_from_points: Pose,
    /// Indices of the points that are seen within the threshold; ascending.
    pub inliers: Vec<usize>,
    /// Σ min(angle² / threshold², 1): between 0 and the number of points.
    pub cost: f64,
}

/// The pose `camera_from_points` that explains most of the unit `bearings` of known `points` (by index).
///
/// Samples of four inside RANSAC with truncated squared angles (MSAC), then all inliers. `threshold`: largest angle of
/// an inlier [rad], about 3 σ of a bearing. The same `seed` gives the same result. `None` for fewer than 4 points or
/// inliers, and where those leave the pose open.
pub fn resect_robust(
    points: &[Vector3<f64>],
    bearings: &[Vector3<f64>],
    threshold: f64,
    seed: u64,
) -> Option<Resection> {
    if points.len() < 4 || points.len() != bearings.len() || threshold.is_nan() || threshold <= 0.0 {
        return None;
    }
    let problem = Problem { points, bearings, limit: threshold * threshold };
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let scored = subset(&mut random, points.len(), SCORED);
    let mut best: Option<(Pose, f64)> = None;
    let (mut drawn, mut wanted) = (0, SAMPLES[1]);
    while drawn < wanted {
        drawn += 1;
        let sample = draw::<4>(&mut random, points.len());
        for (pose, _) in resect_with_errors(&sample.map(|i| points[i]), &sample.map(|i| bearings[i])) {
            let cost = problem.cost(&pose, &scored);
            if best.is_some_and(|(_, least)| cost >= least) {
                continue;
            }
            best = Some(problem.refined(&pose, &scored).filter(|refined| refined.1 < cost).unwrap_or((pose, cost)));
            let inliers = best.map_or(0, |(pose, _)| problem.inliers(&pose, &scored).len());
            wanted = enough(inliers as f64 / scored.len() as f64, 4).clamp(SAMPLES[0], SAMPLES[1]);
        }
    }
    let all: Vec<usize> = (0..points.len()).collect();
    let inliers = problem.inliers(&best?.0, &all);
    // All minima of the inliers, of which a plane has two, besides the one that was found.
    let chosen = |of: &[Vector3<f64>]| inliers.iter().map(|&i| of[i]).collect::<Vec<_>>();
    let mut starts = vec![best?.0];
    starts.extend(resect_with_errors(&chosen(points), &chosen(bearings)).into_iter().map(|(pose, _)| pose));
    let refined = starts.iter().filter_map(|start| problem.refined(start, &all));
    let (camera_from_points, cost) = refined.min_by(|p, q| p.1.total_cmp(&q.1))?;
    let inliers = problem.inliers(&camera_from_points, &all);
    (inliers.len() >= 4).then_some(Resection { camera_from_points, inliers, cost })
}

struct Problem<'a> {
    points: &'a [Vector3<f64>],
    bearings: &'a [Vector3<f64>],
    /// Squared threshold [rad²].
    limit: f64,
}

impl Problem<'_> {
    fn squared(&self, pose: &Pose, i: usize) -> f64 {
        squared_distance(pose, &self.points[i], &self.bearings[i])
    }

    fn cost(&self, pose: &Pose, chosen: &[usize]) -> f64 {
        chosen.iter().map(|&i| (self.squared(pose, i) / self.limit).min(1.0)).sum()
    }

    fn inliers(&self, pose: &Pose, chosen: &[usize]) -> Vec<usize> {
        chosen.iter().copied().filter(|&i| self.squared(pose, i) < self.limit).collect()
    }

    /// Refined on its inliers until that no longer lowers the cost.
    fn refined(&self, start: &Pose, chosen: &[usize]) -> Option<(Pose, f64)> {
        let mut best: Option<(Pose, f64)> = None;
        let mut pose = *start;
        for _ in 0..4 {
            let inliers = self.inliers(&pose, chosen);
            if inliers.len() < 4 {
                break;
            }
            let Some((next, _)) = refine(&pose, self.points, self.bearings, &inliers) else { break };
            pose = next;
            let cost = self.cost(&pose, chosen);
            if best.is_some_and(|(_, least)| cost > least * (1.0 - 1e-9)) {
                break;
            }
            best = Some((pose, cost));
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::ransac::tests::Random;

    type Scene = (Pose, Vec<Vector3<f64>>, Vec<Vector3<f64>>);

    /// Points 4 m away, seen with noise sigma [rad]; the first `outliers` bearings are random.
    fn scene(seed: u64, n: usize, sigma: f64, outliers: usize, flat: f64) -> Scene {
        let mut random = Random::new(seed);
        let truth = Pose::new(random.vector(1.8), random.vector(0.5) + Vector3::z() * 4.0);
        let mut points = Vec::new();
        let mut bearings = Vec::new();
        for i in 0..n {
            let point = random.vector(1.0).component_mul(&Vector3::new(1.0, 1.0, flat));
            let wrong = random.vector(1.0) + Vector3::z() * 4.0;
            let seen = if i < outliers { wrong } else { truth.transform(&point) };
            points.push(point);
            bearings.push(random.tilted(&seen.normalize(), sigma));
        }
        (truth, points, bearings)
    }

    // 0.5 px at a focal length of 600 px: 4 m away, 3.3 mm across.
    #[test]
    fn wrong_correspondences_are_survived_and_named() {
        let sigma = 0.5 / 600.0;
        for (n, outliers, flat) in [(300, 120, 1.0), (30, 9, 1.0), (30, 6, 0.0), (10, 2, 1.0)] {
            let mut right = 0;
            for seed in 0..50 {
                let (truth, points, bearings) = scene(seed, n, sigma, outliers, flat);
                let Some(found) = resect_robust(&points, &bearings, 3.5 * sigma, seed) else { continue };
                let pose = found.camera_from_points;
                let caught = found.inliers.iter().filter(|&&i| i < outliers).count();
                let near = pose.angle_to(&truth) < 0.02 && (pose.translation - truth.translation).norm() < 0.04;
                right += usize::from(near && caught <= outliers / 10);
            }
            assert!(right >= 49, "{right} of 50 with {n} points, {outliers} wrong, flat {flat}");
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_pose_and_too_few_points_none() {
        let (_, points, bearings) = scene(1, 40, 1e-3, 10, 1.0);
        let run = || resect_robust(&points, &bearings, 3e-3, 5);
        assert_eq!(run(), run());
        assert_eq!(resect_robust(&points[..3], &bearings[..3], 3e-3, 5), None);
        assert_eq!(resect_robust(&points, &bearings[1..], 3e-3, 5), None);
        assert_eq!(resect_robust(&points, &bearings, f64::NAN, 5), None);
        assert_eq!(resect_robust(&[Vector3::x(); 9], &bearings[..9], 3e-3, 5), None);
        let line: Vec<_> = (0..9).map(|i| Vector3::new(0.1, 0.2, -0.3) * f64::from(i)).collect();
        let seen: Vec<_> = line.iter().map(|p| (p + Vector3::z() * 4.0).normalize()).collect();
        assert_eq!(resect_robust(&line, &seen, 3e-3, 5), None);
    }
}
