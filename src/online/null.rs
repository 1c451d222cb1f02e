//! How far from the prediction images of an unchanged rig are, and how improbable one that is farther.
//!
//! The measure of an image is the median pixel distance m of its n detections, which a few wrong ones do not move. With
//! Gaussian pixel noise σ, distances have Rayleigh's distribution: m is about σ √(2 ln 2), and ln m scatters by
//! 1/(2 ln 2 √n). A learned rig errs itself, by more at some positions than at others, which scales m and adds to the scatter; both
//! are estimated from the first samples, robustly. Noise of the joint readings, where the rig states it, shifts an image as a
//! whole: it widens m by what it adds to σ, and ln m by as much as a single distance scatters where it is all of it. p values
//! are Chernoff's bound on the Gaussian tail of ln m.
//! One bad sample is no change: two of the last [`WINDOW`] have to be improbable.
use crate::calibrate::median;

/// Samples within which two have to be improbable.
pub(super) const WINDOW: usize = 3;

/// Fewest detections of an image that can be told from wrong ones.
const FEWEST: usize = 3;

/// Least scatter of ln m by the rig's own errors.
const LEAST_SCATTER: f64 = 0.2;

/// Standard deviation of the logarithm of one distance, π/(2√6): of an image that noise of readings shifts as a whole.
const SHIFTED_SCATTER: f64 = 0.641;

/// Pixel distances of one camera's detections, and by how much noise of readings shifts them together: the standard deviation of a coordinate [px].
#[derive(Clone, Debug, Default)]
pub(super) struct Image {
    pub distances: Vec<f64>,
    pub shift: f64,
}

/// An image's ln m without what noise of readings adds to it in the middle, and the standard deviation that chance gives it.
#[derive(Clone, Copy, Debug)]
struct Measure {
    value: f64,
    scatter: f64,
}

/// The distribution of images of an unchanged rig.
#[derive(Clone, Debug)]
pub(super) struct Null {
    /// ln m, in the middle, and the standard deviation that the rig's own errors add.
    location: f64,
    scatter: f64,
    /// What the estimates come from, until there is enough.
    burn_in: Vec<Measure>,
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
    pub fn can_judge(images: &[Image]) -> bool {
        judged(images).next().is_some()
    }

    /// Bound on the probability of a sample whose images, per camera, are this bad or worse; one of them can be judged.
    pub fn p_value(&self, images: &[Image]) -> f64 {
        let measured: Vec<Measure> = judged(images).map(|image| self.measure(image)).collect();
        let p = |measure: &Measure| {
            let z = (measure.value - self.location) / measure.scatter.hypot(self.scatter);
            if z > 0.0 { 0.5 * (-0.5 * z * z).exp() } else { 1.0 }
        };
        (measured.len() as f64 * measured.iter().map(p).fold(1.0, f64::min)).min(1.0)
    }

    /// Learns from a sample of the unchanged rig, among the first so many.
    pub fn learn(&mut self, images: &[Image], burn_in: usize) {
        if self.samples >= burn_in {
            return;
        }
        self.samples += 1;
        let measured: Vec<Measure> = judged(images).map(|image| self.measure(image)).collect();
        self.burn_in.extend(measured);
        if self.samples == burn_in && !self.burn_in.is_empty() {
            let mut values: Vec<f64> = self.burn_in.iter().map(|measure| measure.value).collect();
            self.location = self.location.max(median(&mut values));
            let standard = |measure: &Measure| {
                let total = 1.4826 * (measure.value - self.location).abs();
                total * total - measure.scatter.powi(2)
            };
            let mut excess: Vec<f64> = self.burn_in.iter().map(standard).collect();
            self.scatter = self.scatter.max(median(&mut excess).max(0.0).sqrt());
            self.burn_in = Vec::new();
        }
    }

    fn measure(&self, image: &Image) -> Measure {
        let m = median(&mut image.distances.clone()).max(f64::MIN_POSITIVE);
        // What readings add, and their share of the whole variance.
        let (own, added) = (self.sigma(), image.shift);
        let share = added * added / (own * own + added * added);
        let scatter = noise_scatter(image.distances.len()).hypot(share * SHIFTED_SCATTER);
        Measure { value: m.ln() - (own.hypot(added) / own).ln(), scatter }
    }
}

/// Probability of two of [`WINDOW`] samples as improbable as the second least probable of these.
pub(super) fn window_p_value(recent: &[f64]) -> f64 {
    let mut sorted = recent.to_vec();
    sorted.sort_by(f64::total_cmp);
    let pairs = (WINDOW * (WINDOW - 1) / 2) as f64;
    sorted.get(1).map_or(1.0, |second| (pairs * second * second).min(1.0))
}

/// Images that show enough.
fn judged(images: &[Image]) -> impl Iterator<Item = &Image> {
    images.iter().filter(|image| image.distances.len() >= FEWEST)
}

/// Standard deviation of the logarithm of the median of n distances.
fn noise_scatter(n: usize) -> f64 {
    0.5 / (2.0_f64.ln() * (n as f64).sqrt())
}
