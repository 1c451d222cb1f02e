//! From where features are in the image to what a tracker reports.
use crate::Error;
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
    /// By Gaussian noise in proportion to the distance of what is tracked: of patches that cover fewer pixels the farther they are, and
    /// are placed by the root of their number.
    ByDistance {
        /// Standard deviation per coordinate at that distance [px].
        sd: f64,
        /// The distance from the camera [m].
        at: f64,
    },
}

impl Tracker {
    /// What is reported of a feature at this distance from the camera [px, m].
    pub fn report(self, pixel: [f64; 2], distance: f64, random: &mut ChaCha8Rng) -> [f64; 2] {
        match self {
            Tracker::Exact => pixel,
            Tracker::Rounded => pixel.map(f64::round),
            Tracker::Gaussian(_) | Tracker::ByDistance { .. } => {
                let sd = self.sd(distance);
                pixel.map(|coordinate| coordinate + sd * random.sample::<f64, _>(StandardNormal))
            }
        }
    }

    /// Standard deviation of a coordinate of a feature at this distance from the camera [px, m]; of whole pixels, that of rounding.
    pub fn sd(self, distance: f64) -> f64 {
        match self {
            Tracker::Exact => 0.0,
            Tracker::Rounded => 12.0_f64.sqrt().recip(),
            Tracker::Gaussian(sd) => sd,
            Tracker::ByDistance { sd, at } => sd * distance / at,
        }
    }

    pub(super) fn check(self) -> Result<(), Error> {
        let is_fine = match self {
            Tracker::Exact | Tracker::Rounded => true,
            Tracker::Gaussian(sd) => (0.0..f64::INFINITY).contains(&sd),
            Tracker::ByDistance { sd, at } => (0.0..f64::INFINITY).contains(&sd) && at > 0.0 && at.is_finite(),
        };
        let problem =
            || Error::Unusable(format!("trackers are {self:?}; noise has to be 0 or more, and its distance above 0"));
        is_fine.then_some(()).ok_or_else(problem)
    }
}
