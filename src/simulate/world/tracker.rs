//! From where features are in the image to what a tracker reports.
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// How a tracker errs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Tracker {
    /// Not at all.
    #[default]
    Exact,
    /// It reports whole pixels.
    Rounded,
    /// By Gaussian noise of this standard deviation per coordinate [px].
    Gaussian(f64),
}

impl Tracker {
    /// What is reported of a feature [px].
    pub fn report(self, pixel: [f64; 2], random: &mut ChaCha8Rng) -> [f64; 2] {
        match self {
            Tracker::Exact => pixel,
            Tracker::Rounded => pixel.map(f64::round),
            Tracker::Gaussian(sd) => pixel.map(|coordinate| coordinate + sd * random.sample::<f64, _>(StandardNormal)),
        }
    }
}
