//! The motion that takes one set of points to another.
use super::rotation::nearest_rotation_and_trace;
use handeye_solvers::Pose;
use nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Triples that are tried among wrong points, and the share of the median distance below which one is better than all points
/// together: of good points alone, all do best.
const TRIPLES: usize = 30;
const CLEARLY: f64 = 0.5;

/// A rigid motion with a scale: p ↦ s R p + t.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    /// s, positive.
    pub scale: f64,
    /// R and t.
    pub pose: Pose,
}

impl Similarity {
    /// s R p + t.
    pub fn transform(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.pose.transform(&(point * self.scale))
    }
}

/// The rigid motion `to_from_from` that minimises Σ |R fromᵢ + t - toᵢ|² (Arun, Huang and Blostein 1987).
///
/// The points correspond by index. A reflection is never returned (Umeyama 1991). `None` for fewer than 3 points, for
/// collinear ones, and where the lists differ in length.
pub fn align(from: &[Vector3<f64>], to: &[Vector3<f64>]) -> Option<Pose> {
    let moments = Moments::new(from, to)?;
    let (rotation, _) = nearest_rotation_and_trace(&moments.covariance)?;
    Some(moments.pose(rotation, 1.0))
}

/// The similarity `to_from_from` that minimises Σ |s R fromᵢ + t - toᵢ|² (Umeyama 1991, equations 40 to 43).
///
/// `None` as for [`align`].
pub fn align_similarity(from: &[Vector3<f64>], to: &[Vector3<f64>]) -> Option<Similarity> {
    let moments = Moments::new(from, to)?;
    let (rotation, trace) = nearest_rotation_and_trace(&moments.covariance)?;
    let scale = trace / moments.variance;
    (scale > 0.0 && scale.is_finite()).then(|| Similarity { scale, pose: moments.pose(rotation, scale) })
}

/// The same as [`align`] where up to a third of the points are wrong: the triple with the least median distance, then all points
/// within three times that.
pub fn align_robust(from: &[Vector3<f64>], to: &[Vector3<f64>], seed: u64) -> Option<Pose> {
    let distances = |pose: &Pose| -> Vec<f64> {
        from.iter().zip(to).map(|(from, to)| (pose.transform(from) - to).norm()).collect()
    };
    let middle = |pose: &Pose| {
        let mut sorted = distances(pose);
        sorted.sort_by(f64::total_cmp);
        0.5 * (sorted[(sorted.len() - 1) / 2] + sorted[sorted.len() / 2])
    };
    let mut best = align(from, to)?;
    if from.len() > 3 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        for _ in 0..TRIPLES {
            let three: [usize; 3] = std::array::from_fn(|_| random.random_range(0..from.len()));
            if let Some(pose) = align(&three.map(|i| from[i]), &three.map(|i| to[i]))
                && middle(&pose) < CLEARLY * middle(&best)
            {
                best = pose;
            }
        }
        let limit = 3.0 * middle(&best);
        let near: Vec<usize> =
            distances(&best).into_iter().enumerate().filter(|(_, d)| *d <= limit).map(|(i, _)| i).collect();
        let pick = |points: &[Vector3<f64>]| near.iter().map(|&i| points[i]).collect::<Vec<_>>();
        best = align(&pick(from), &pick(to)).unwrap_or(best);
    }
    Some(best)
}

/// What of two sets of points determines their alignment.
struct Moments {
    mean_from: Vector3<f64>,
    mean_to: Vector3<f64>,
    /// Σ (to - mean) (from - mean)ᵀ
    covariance: Matrix3<f64>,
    /// Σ |from - mean|²
    variance: f64,
}

impl Moments {
    fn new(from: &[Vector3<f64>], to: &[Vector3<f64>]) -> Option<Self> {
        if from.len() < 3 || from.len() != to.len() {
            return None;
        }
        let n = from.len() as f64;
        let (mean_from, mean_to) = (from.iter().sum::<Vector3<f64>>() / n, to.iter().sum::<Vector3<f64>>() / n);
        let covariance = from.iter().zip(to).map(|(p, q)| (q - mean_to) * (p - mean_from).transpose()).sum();
        let variance = from.iter().map(|p| (p - mean_from).norm_squared()).sum();
        Some(Moments { mean_from, mean_to, covariance, variance })
    }

    fn pose(&self, rotation: Matrix3<f64>, scale: f64) -> Pose {
        Pose { rotation, translation: self.mean_to - rotation * self.mean_from * scale }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::ransac::tests::{Random, distance};

    fn exact(seed: u64, n: usize) -> (Pose, Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
        let mut random = Random::new(seed);
        let truth = Pose::new(random.vector(1.5), random.vector(2.0));
        let from: Vec<_> = (0..n).map(|_| random.vector(1.0)).collect();
        let to = from.iter().map(|p| truth.transform(p)).collect();
        (truth, from, to)
    }

    #[test]
    fn exact_points_give_the_exact_motion() {
        for seed in 0..100 {
            let (truth, from, to) = exact(seed, 3 + seed as usize % 10);
            assert!(distance(&align(&from, &to).unwrap(), &truth) < 1e-9);
            let scaled: Vec<_> = to.iter().map(|p| p * 2.5).collect();
            let found = align_similarity(&from, &scaled).unwrap();
            assert!((found.scale - 2.5).abs() < 1e-9 && (found.transform(&from[0]) - scaled[0]).norm() < 1e-9);
        }
    }

    // With n points and noise σ per coordinate the residuals have 3 n - 6 degrees of freedom: over 100 sets of 20
    // points Σ r² / σ² is χ² with 5400, mean 5400 and standard deviation 104; 3 σ.
    #[test]
    fn residuals_of_noisy_points_follow_chi_square() {
        let sigma = 0.01;
        let mut sum = 0.0;
        for seed in 0..100 {
            let (_, from, mut to) = exact(seed, 20);
            let mut random = Random::new(1000 + seed);
            to.iter_mut().for_each(|p| *p += random.gaussian(sigma));
            let found = align(&from, &to).unwrap();
            sum += from.iter().zip(&to).map(|(p, q)| (found.transform(p) - q).norm_squared()).sum::<f64>();
        }
        assert!((sum / (sigma * sigma) - 5400.0).abs() < 3.0 * 104.0);
    }

    // Wrong points are anywhere in the cube; with 30 triples, none is free of them in (1 - (2/3)³)³⁰ = 3e-5 of all cases.
    #[test]
    fn a_third_of_wrong_points_does_not_spoil_the_motion() {
        for seed in 0..100 {
            let (truth, from, mut to) = exact(seed, 12);
            let mut random = Random::new(1000 + seed);
            to.iter_mut().for_each(|p| *p += random.gaussian(1e-3));
            to.iter_mut().take(4).for_each(|p| *p = random.vector(2.0));
            let found = align_robust(&from, &to, seed).unwrap();
            assert!(distance(&found, &truth) < 5e-3, "seed {seed}: {}", distance(&found, &truth));
        }
    }

    #[test]
    fn planar_points_are_not_reflected_and_collinear_ones_not_aligned() {
        let (truth, mut from, _) = exact(7, 6);
        from.iter_mut().for_each(|p| p.z = 0.5);
        let to: Vec<_> = from.iter().map(|p| truth.transform(p)).collect();
        assert!(distance(&align(&from, &to).unwrap(), &truth) < 1e-9);
        let line: Vec<_> =
            (0..5).map(|i| Vector3::new(0.1, 0.2, 0.3) + Vector3::new(1.0, -2.0, 0.5) * f64::from(i)).collect();
        assert_eq!(align(&line, &line), None);
        assert_eq!(align(&from[..2], &to[..2]), None);
        assert_eq!(align(&from, &to[1..]), None);
        assert_eq!(align_similarity(&line, &line), None);
    }
}
