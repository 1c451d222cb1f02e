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
        let n = arm.joints();
        let mut slopes = vec![0.0; 3 * n];
        for &feature in &self.features {
            let (first, rest) = slopes.split_at_mut(n);
            let (second, negative) = rest.split_at_mut(n);
            let sighting = Sighting { camera: self.camera, feature, pixel: [0.0, 0.0] };
            let Some(pixel) = arm.pixel_rows(at, &sighting, [first, second]) else { continue };
            for (axis, row) in [&*first, &*second].into_iter().enumerate() {
                // Pixel centres are at whole numbers.
                let (low, high) = (self.margin - 0.5, f64::from(size[axis]) - 0.5 - self.margin);
                rows.push(row, SHARE * (high - pixel[axis]), self.strength);
                negative.iter_mut().zip(row).for_each(|(negative, slope)| *negative = -slope);
                rows.push(negative, SHARE * (pixel[axis] - low), self.strength);
            }
        }
    }
}
