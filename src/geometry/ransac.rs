//! What every random consensus needs: samples without repetition, and when to stop.
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Chance of never having drawn a sample without an outlier at which drawing stops.
const MISSED: f64 = 1e-4;

/// `N` distinct indices below `n`, which must be at least `N`.
pub(super) fn draw<const N: usize>(random: &mut ChaCha8Rng, n: usize) -> [usize; N] {
    let mut drawn = [usize::MAX; N];
    for k in 0..N {
        drawn[k] = loop {
            let index = random.random_range(0..n);
            if !drawn[..k].contains(&index) {
                break index;
            }
        };
    }
    drawn
}

/// At most `limit` of the indices below `n`, in random order.
pub(super) fn subset(random: &mut ChaCha8Rng, n: usize, limit: usize) -> Vec<usize> {
    let mut indices: Vec<usize> = (0..n).collect();
    let kept = n.min(limit);
    for k in 0..kept {
        let other = random.random_range(k..n);
        indices.swap(k, other);
    }
    indices.truncate(kept);
    indices
}

/// How many samples of `size` are enough where a share of the data are inliers (Fischler and Bolles 1981).
pub(super) fn enough(inlier_share: f64, size: i32) -> usize {
    let clean = inlier_share.powi(size).clamp(1e-9, 1.0 - 1e-9);
    (MISSED.ln() / (-clean).ln_1p()).ceil() as usize
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use handeye_solvers::Pose;
    use nalgebra::Vector3;
    use rand::SeedableRng;

    /// Random scenes for the tests of this folder.
    pub(in crate::geometry) struct Random(pub ChaCha8Rng);

    impl Random {
        pub fn new(seed: u64) -> Self {
            Random(ChaCha8Rng::seed_from_u64(seed))
        }

        /// Uniform in [-size, size]³.
        pub fn vector(&mut self, size: f64) -> Vector3<f64> {
            Vector3::from_fn(|_, _| self.0.random_range(-size..size))
        }

        /// Three independent normal numbers (Box and Muller).
        pub fn gaussian(&mut self, sigma: f64) -> Vector3<f64> {
            Vector3::from_fn(|_, _| {
                let (u, v) = (self.0.random_range(1e-300..1.0_f64), self.0.random_range(0.0..std::f64::consts::TAU));
                sigma * (-2.0 * u.ln()).sqrt() * v.cos()
            })
        }

        /// A unit direction, moved by normal noise of sigma [rad] in each of its two tangents.
        pub fn tilted(&mut self, direction: &Vector3<f64>, sigma: f64) -> Vector3<f64> {
            let noise = self.gaussian(sigma);
            (direction + noise - direction * direction.dot(&noise)).normalize()
        }
    }

    pub(in crate::geometry) fn distance(a: &Pose, b: &Pose) -> f64 {
        (a.rotation - b.rotation).norm() + (a.translation - b.translation).norm()
    }

    #[test]
    fn samples_have_no_repetitions() {
        let mut random = Random::new(1).0;
        for n in 5..12 {
            let mut sample = draw::<5>(&mut random, n);
            sample.sort_unstable();
            assert!(sample.windows(2).all(|pair| pair[0] < pair[1]) && sample[4] < n);
            let mut kept = subset(&mut random, n, 7);
            kept.sort_unstable();
            kept.dedup();
            assert_eq!(kept.len(), n.min(7));
        }
    }

    // ln 1e-4 / ln (1 - 0.5⁵) = 290.1
    #[test]
    fn half_outliers_need_291_samples_of_five() {
        assert_eq!(enough(0.5, 5), 291);
        assert_eq!(enough(1.0, 5), 1);
    }
}
