//! How fast features may move in an image, so that trackers keep up.
use super::{Arm, Configuration, Limit, LimitRows};
use crate::infer::Sighting;

/// Keeps the speed of features along u and along v below a limit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PixelSpeed {
    /// Index of the camera.
    pub camera: usize,
    /// Indices of the features.
    pub features: Vec<usize>,
    /// Largest speed along each axis [px/s].
    pub speed: f64,
    /// See [`LimitRows::push`].
    pub strength: f64,
}

impl Limit for PixelSpeed {
    fn rows(&self, arm: &Arm, at: &Configuration, dt: f64, rows: &mut LimitRows) {
        let n = arm.joints();
        let mut slopes = vec![0.0; 2 * n];
        for &feature in &self.features {
            let (first, second) = slopes.split_at_mut(n);
            let sighting = Sighting { camera: self.camera, feature, pixel: [0.0, 0.0] };
            if arm.pixel_rows(at, &sighting, [first, second]).is_none() {
                continue;
            }
            for row in [first, second] {
                rows.push(row, self.speed * dt, self.strength);
                row.iter_mut().for_each(|slope| *slope = -*slope);
                rows.push(row, self.speed * dt, self.strength);
            }
        }
    }
}
