//! How far from the prediction images of an unchanged rig are, and how improbable one that is farther.
//!
//! The measure of an image is the median pixel distance m of its n detections, which a few wrong ones do not move. With
//! Gaussian pixel noise σ, distances have Rayleigh's distribution: m is about σ √(2 ln 2), and ln m scatters by
//! 1/(2 ln 2 √n). A learned rig errs itself, by more at some positions than at others, which scales m and adds to the scatter; both
//! are estimated from the first samples, robustly. p values are Chernoff's bound on the Gaussian tail of ln m.
//! One bad sample is no change: two of the last [`WINDOW`] have to be improbable.
use crate::calibrate::median;

/// Samples within which two have to be improbable.
pub(super) const WINDOW: usize = 3;

/// Fewest detections of an image that can be told from wrong ones.
const FEWEST: usize = 3;

/// Least scatter of ln m by the rig's own errors.
const LEAST_SCATTER: f64 = 0.2;

/// The distribution of images of an unchanged rig.
#[derive(Clone, Debug)]
pub(super) struct Null {
    /// ln m, in the middle, and the standard deviation that the rig's own errors add.
    location: f64,
    scatter: f64,
    /// What the estimates come from, until there is enough: ln m and number of detections of an image.
    burn_in: Vec<(f64, usize)>,
    samples: usize,
}

impl Null {
    /// `sigma`: standard deviation of a pixel coordinate about the prediction [px].
    pub fn new(sigma: f64) -> Null {
        let location = (sigma * (2.0 * 2.0_f64.ln()).sqrt()).ln();
        Null { location, scatter: LEAST_SCATTER, burn_in: Vec::new(), samples: 0 }
    }

    /// Standard deviation of a pixel coordinate about the prediction [px].
    pub fn sigma(&self) -> f64 {
        self.location.exp() / (2.0 * 2.0_f64.ln()).sqrt()
    }

    /// Median pixel distance of an image, in the middle [px].
    pub fn median(&self) -> f64 {
        self.location.exp()
    }

    /// Whether any image has enough detections to be judged.
    pub fn can_judge(images: &[Vec<f64>]) -> bool {
        measures(images).next().is_some()
    }

    /// Bound on the probability of a sample whose images are this bad or worse; one of them can be judged. `images`: pixel
    /// distances, per camera.
    pub fn p_value(&self, images: &[Vec<f64>]) -> f64 {
        let measured: Vec<(f64, usize)> = measures(images).collect();
        let p = |&(measure, n): &(f64, usize)| {
            let z = (measure - self.location) / noise_scatter(n).hypot(self.scatter);
            if z > 0.0 { 0.5 * (-0.5 * z * z).exp() } else { 1.0 }
        };
        (measured.len() as f64 * measured.iter().map(p).fold(1.0, f64::min)).min(1.0)
    }

    /// Learns from a sample of the unchanged rig, among the first so many.
    pub fn learn(&mut self, images: &[Vec<f64>], burn_in: usize) {
        if self.samples >= burn_in {
            return;
        }
        self.samples += 1;
        self.burn_in.extend(measures(images));
        if self.samples == burn_in && !self.burn_in.is_empty() {
            let mut values: Vec<f64> = self.burn_in.iter().map(|(measure, _)| *measure).collect();
            self.location = self.location.max(median(&mut values));
            let standard = |&(measure, n): &(f64, usize)| {
                let total = 1.4826 * (measure - self.location).abs();
                total * total - noise_scatter(n).powi(2)
            };
            let mut excess: Vec<f64> = self.burn_in.iter().map(standard).collect();
            self.scatter = self.scatter.max(median(&mut excess).max(0.0).sqrt());
            self.burn_in = Vec::new();
        }
    }
}

/// Probability of two of [`WINDOW`] samples as improbable as the second least probable of these.
pub(super) fn window_p_value(recent: &[f64]) -> f64 {
    let mut sorted = recent.to_vec();
    sorted.sort_by(f64::total_cmp);
    let pairs = (WINDOW * (WINDOW - 1) / 2) as f64;
    sorted.get(1).map_or(1.0, |second| (pairs * second * second).min(1.0))
}

/// ln m and number of detections of each image that has enough.
fn measures(images: &[Vec<f64>]) -> impl Iterator<Item = (f64, usize)> {
    let enough = images.iter().filter(|distances| distances.len() >= FEWEST);
    enough.map(|distances| (median(&mut distances.clone()).max(f64::MIN_POSITIVE).ln(), distances.len()))
}

/// Standard deviation of the logarithm of the median of n distances.
fn noise_scatter(n: usize) -> f64 {
    0.5 / (2.0_f64.ln() * (n as f64).sqrt())
}
