//! The pose of one camera in another from what both see, with wrong correspondences among it.
//!
//! Samples of five correspondences give hypotheses (Nistér's five-point method inside RANSAC), scored by truncated
//! squared Sampson distances (MSAC, Torr and Zisserman 2000); a new best one is refined at once (LO-RANSAC, Chum et
//! al. 2003). A correspondence whose point would lie behind a camera counts as wrong.
use super::essential::{decompose, essential, in_front_of_both};
use super::five_point::five_point;
use super::ransac::{draw, enough, subset};
use super::rotation::nearest_rotation;
use super::sampson::{refine, squared_distance};
use handeye_solvers::Pose;
use nalgebra::{Matrix3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Samples that are drawn at least, so that noisy minimal solutions do not decide alone, and at most.
const SAMPLES: [usize; 2] = [100, 1_500];

/// Correspondences on which hypotheses are scored; the solutions are refined and judged on all.
const SCORED: usize = 300;

/// Hypotheses that are kept for refinement.
const KEPT: usize = 8;

/// An alternative is reported where its cost is below this share of all correspondences plus twice the least cost.
const NEARLY_AS_GOOD: f64 = 0.02;

/// Two poses closer than this, in rotation and in direction of the baseline [rad], are one solution.
const SAME: f64 = 0.02;

/// The pose of one camera in another, its scale unknown.
#[derive(Clone, Debug, PartialEq)]
pub struct RelativePose {
    /// p_b = R p_a + t with |t| = 1.
    pub b_from_a: Pose,
    /// Indices of the correspondences that fit within the threshold, in front of both cameras; ascending.
    pub inliers: Vec<usize>,
    /// Σ min(r² / threshold², 1): between 0 and the number of correspondences.
    pub cost: f64,
}

/// The pose `b_from_a` of which the unit bearings `a` and `b` of the same points (by index) tell most.
///
/// `threshold`: largest Sampson distance of an inlier [rad], about 3 σ of a bearing. The same `seed` gives the same
/// result. Points in a plane will do. `None` for fewer than 5 correspondences or inliers, and where they leave the
/// pose open: a baseline too short for the threshold, collinear points.
pub fn relative_pose(a: &[Vector3<f64>], b: &[Vector3<f64>], threshold: f64, seed: u64) -> Option<RelativePose> {
    relative_pose_candidates(a, b, threshold, seed).into_iter().next()
}

/// All poses that fit nearly as well as the best, which is the first: small or planar sets of points may leave two.
///
/// Arguments as of [`relative_pose`]; empty where that is `None`.
pub fn relative_pose_candidates(
    a: &[Vector3<f64>],
    b: &[Vector3<f64>],
    threshold: f64,
    seed: u64,
) -> Vec<RelativePose> {
    if a.len() < 5 || a.len() != b.len() || threshold.is_nan() || threshold <= 0.0 {
        return Vec::new();
    }
    let problem = Problem { a, b, threshold };
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let scored = subset(&mut random, a.len(), SCORED);
    let all: Vec<usize> = (0..a.len()).collect();
    let hypotheses = problem.search(&scored, &mut random);
    let refined = distinct(hypotheses.iter().filter_map(|h| problem.refined(&h.pose, &scored)).collect());
    let Some(least) = refined.first().map(|best| best.cost) else { return Vec::new() };
    let nearly = |cost: f64, least: f64, n: usize| cost <= 2.0 * least + NEARLY_AS_GOOD * n as f64;
    let promising = refined.iter().filter(|h| nearly(h.cost, least, scored.len()));
    let judged = distinct(promising.filter_map(|h| problem.refined(&h.pose, &all)).collect());
    let Some(least) = judged.first().map(|best| best.cost) else { return Vec::new() };
    let mut candidates = Vec::new();
    for Hypothesis { pose, cost } in judged.into_iter().filter(|h| nearly(h.cost, least, a.len())) {
        let inliers = problem.inliers(&pose, &all);
        if inliers.len() >= 5 && !problem.is_rotation_alone(&inliers) {
            candidates.push(RelativePose { b_from_a: pose, inliers, cost });
        }
    }
    candidates
}

struct Problem<'a> {
    a: &'a [Vector3<f64>],
    b: &'a [Vector3<f64>],
    threshold: f64,
}

#[derive(Clone, Copy)]
struct Hypothesis {
    pose: Pose,
    cost: f64,
}

impl Problem<'_> {
    /// The best hypotheses of random samples, each unlike the others.
    fn search(&self, scored: &[usize], random: &mut ChaCha8Rng) -> Vec<Hypothesis> {
        let mut kept: Vec<Hypothesis> = Vec::new();
        let (mut drawn, mut wanted) = (0, SAMPLES[1]);
        while drawn < wanted {
            drawn += 1;
            let sample = draw::<5>(random, self.a.len());
            for e in five_point(&sample.map(|i| self.a[i]), &sample.map(|i| self.b[i])) {
                let bound = if kept.len() < KEPT { f64::INFINITY } else { kept[kept.len() - 1].cost };
                let Some(hypothesis) = self.epipolar_cost(&e, scored, bound).and_then(|_| self.best_pose(&e, scored))
                else {
                    continue;
                };
                let is_best = kept.first().is_none_or(|best| hypothesis.cost < best.cost);
                insert(&mut kept, hypothesis);
                if is_best {
                    let better = self.refined(&hypothesis.pose, scored);
                    better.into_iter().for_each(|better| insert(&mut kept, better));
                    let inlier_share = self.inliers(&kept[0].pose, scored).len() as f64 / scored.len() as f64;
                    wanted = enough(inlier_share, 5).clamp(SAMPLES[0], SAMPLES[1]);
                }
            }
        }
        kept
    }

    /// Σ min(r² / threshold², 1), or `None` once it exceeds a bound.
    fn epipolar_cost(&self, e: &Matrix3<f64>, chosen: &[usize], bound: f64) -> Option<f64> {
        let inverse = 1.0 / (self.threshold * self.threshold);
        let mut cost = 0.0;
        for &i in chosen {
            cost += (squared_distance(e, &self.a[i], &self.b[i]) * inverse).min(1.0);
            if cost > bound {
                return None;
            }
        }
        Some(cost)
    }

    /// The pose of an essential matrix that puts most inliers in front of both cameras.
    fn best_pose(&self, e: &Matrix3<f64>, chosen: &[usize]) -> Option<Hypothesis> {
        let hypotheses = decompose(e)?.map(|pose| Hypothesis { pose, cost: self.cost(&pose, chosen) });
        hypotheses.into_iter().min_by(|p, q| p.cost.total_cmp(&q.cost))
    }

    /// Σ min(r² / threshold², 1) with 1 for a point behind a camera.
    fn cost(&self, pose: &Pose, chosen: &[usize]) -> f64 {
        let e = essential(pose);
        let inverse = 1.0 / (self.threshold * self.threshold);
        chosen.iter().map(|&i| self.in_front_squared(&e, pose, i).map_or(1.0, |r2| (r2 * inverse).min(1.0))).sum()
    }

    /// Squared Sampson distance; `None` for a point behind a camera.
    fn in_front_squared(&self, e: &Matrix3<f64>, pose: &Pose, i: usize) -> Option<f64> {
        let squared = squared_distance(e, &self.a[i], &self.b[i]);
        let wrong = squared < self.threshold * self.threshold
            && in_front_of_both(pose, &self.a[i], &self.b[i], 2.0 * self.threshold) == Some(false);
        (!wrong).then_some(squared)
    }

    fn inliers(&self, pose: &Pose, chosen: &[usize]) -> Vec<usize> {
        let (e, limit) = (essential(pose), self.threshold * self.threshold);
        chosen.iter().copied().filter(|&i| self.in_front_squared(&e, pose, i).is_some_and(|r2| r2 < limit)).collect()
    }

    /// Refined on its inliers until they no longer change.
    fn refined(&self, start: &Pose, chosen: &[usize]) -> Option<Hypothesis> {
        let mut best: Option<Hypothesis> = None;
        let mut pose = *start;
        for _ in 0..4 {
            let inliers = self.inliers(&pose, chosen);
            if inliers.len() < 5 {
                break;
            }
            let Some(next) = refine(&pose, self.a, self.b, &inliers) else { break };
            pose = next;
            let cost = self.cost(&pose, chosen);
            if best.is_some_and(|best| cost > best.cost * (1.0 - 1e-9)) {
                break;
            }
            best = Some(Hypothesis { pose, cost });
        }
        best
    }

    /// True where a turn of the camera on the spot explains all of these: the baseline is then undetermined.
    fn is_rotation_alone(&self, chosen: &[usize]) -> bool {
        let moment = chosen.iter().map(|&i| self.b[i] * self.a[i].transpose()).sum::<Matrix3<f64>>();
        nearest_rotation(&moment).is_some_and(|rotation| {
            chosen.iter().all(|&i| (rotation * self.a[i] - self.b[i]).norm_squared() < self.threshold * self.threshold)
        })
    }
}

/// Adds a hypothesis in order of cost, in place of a worse one that is the same; drops the last one beyond the limit.
fn insert(kept: &mut Vec<Hypothesis>, hypothesis: Hypothesis) {
    if kept.iter().any(|other| is_same(&other.pose, &hypothesis.pose) && other.cost <= hypothesis.cost) {
        return;
    }
    kept.retain(|other| !is_same(&other.pose, &hypothesis.pose));
    let place = kept.partition_point(|other| other.cost <= hypothesis.cost);
    kept.insert(place, hypothesis);
    kept.truncate(KEPT);
}

/// Sorted by cost, and each solution once.
fn distinct(hypotheses: Vec<Hypothesis>) -> Vec<Hypothesis> {
    let mut kept = Vec::new();
    hypotheses.into_iter().for_each(|hypothesis| insert(&mut kept, hypothesis));
    kept
}

fn is_same(p: &Pose, q: &Pose) -> bool {
    (p.rotation - q.rotation).norm() < SAME * std::f64::consts::SQRT_2 && (p.translation - q.translation).norm() < SAME
}

#[cfg(test)]
#[path = "relative_pose_tests.rs"]
mod tests;
