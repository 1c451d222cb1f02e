//! What trackers see at a moment.
use super::{ImageTask, Place};

/// Where every camera sees every feature; NaN where it does not.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Seen {
    /// By camera, then by feature [px].
    pub pixels: Vec<Vec<[f64; 2]>>,
    /// The same of points in the camera's frame [m], from depth cameras or triangulation.
    pub points: Vec<Vec<[f64; 3]>>,
}

impl Seen {
    /// Nothing yet but the features that are fixed in the images.
    pub fn new(task: &ImageTask) -> Self {
        let n = task.features().len();
        let cameras = 0..task.cameras().len();
        let pixel = |camera: usize| {
            let features = task.features().iter();
            features
                .map(|feature| match &feature.place {
                    Place::Image(pixels) => pixels.get(camera).copied().unwrap_or([f64::NAN; 2]),
                    Place::Hand(_) | Place::Target(_) => [f64::NAN; 2],
                })
                .collect()
        };
        Seen { points: vec![vec![[f64::NAN; 3]; n]; cameras.len()], pixels: cameras.map(pixel).collect() }
    }
}
