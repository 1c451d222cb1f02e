//! Features inside the image.
use super::{Arm, Configuration, Limit, LimitRows, SHARE};
use crate::infer::Sighting;

/// Keeps features inside a camera's image by a margin; brings those back that are outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InImage {
    /// Index of the camera; one whose rig gives no size limits nothing.
    pub camera: usize,
    /// Indices of the features.
    pub features: Vec<usize>,
    /// How far inside the border [px].
    pub margin: f64,
    /// See [`LimitRows::push`].
    pub strength: f64,
}

impl Limit for InImage {
    fn rows(&self, arm: &Arm, at: &Configuration, _dt: f64, rows: &mut LimitRows) {
        let Some(size) = arm.size(self.camera) else { return };
        for &feature in &self.features {
            let Some(sight) = arm.sight(at, &Sighting { camera: self.camera, feature, pixel: [0.0, 0.0] }) else {
                continue;
            };
            for (axis, &size) in size.iter().enumerate() {
                // What no joint moves is out of a limit's hands.
                if sight.slopes(axis).all(|slope| slope == 0.0) {
                    continue;
                }
                // Pixel centres are at whole numbers.
                let (low, high) = (self.margin - 0.5, f64::from(size) - 0.5 - self.margin);
                let pixel = sight.error[axis];
                rows.push(sight.slopes(axis), SHARE * (high - pixel), self.strength);
                rows.push(sight.slopes(axis).map(|slope| -slope), SHARE * (pixel - low), self.strength);
            }
        }
    }
}
