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
        for &feature in &self.features {
            let Some(sight) = arm.sight(at, &Sighting { camera: self.camera, feature, pixel: [0.0, 0.0] }) else {
                continue;
            };
            for axis in 0..2 {
                rows.push(sight.slopes(axis), self.speed * dt, self.strength);
                rows.push(sight.slopes(axis).map(|slope| -slope), self.speed * dt, self.strength);
            }
        }
    }
}
