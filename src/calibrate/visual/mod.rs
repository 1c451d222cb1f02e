//! Cameras and structure from images alone: where the initialisation begins, without a starting value.
//!
//! Cameras that are fixed to each other (a *mount*: the world, or the tip) watch features that are fixed to each other (an
//! *object*: on the tip, or in the world). Which of the two moves makes no difference here.
mod many;
mod one;

use handeye_solvers::Pose;
use nalgebra::Vector3;

/// What one camera saw of a feature.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sighting {
    pub camera: usize,
    pub feature: usize,
    /// Unit bearing in the camera's frame.
    pub bearing: Vector3<f64>,
    /// Where a depth camera has it, in its frame [m].
    pub point: Option<Vector3<f64>>,
}

/// What is reconstructed, up to a similarity.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scene {
    /// mount_from_camera.
    pub cameras: Vec<Option<Pose>>,
    /// In the object's frame.
    pub features: Vec<Option<Vector3<f64>>>,
    /// mount_from_object, by sample.
    pub objects: Vec<Option<Pose>>,
}

/// Sightings of every sample, and how far a good bearing may be off [rad].
pub(crate) struct Views<'a> {
    pub samples: &'a [Vec<Sighting>],
    pub cameras: usize,
    pub features: usize,
    pub threshold: f64,
    pub seed: u64,
}

/// Scenes that explain the views, the most promising first; empty where no depth camera sees enough, and no two cameras and no
/// two samples share enough.
pub(crate) fn reconstruct(views: &Views<'_>) -> Vec<Scene> {
    let scenes = many::reconstruct(views);
    if scenes.is_empty() { one::reconstruct(views) } else { scenes }
}

impl Scene {
    /// True where every camera, and every sample in which something was seen, is placed.
    fn is_whole(&self, views: &Views<'_>) -> bool {
        let mut samples = views.samples.iter().zip(&self.objects);
        self.cameras.iter().all(Option::is_some) && samples.all(|(seen, placed)| seen.is_empty() || placed.is_some())
    }

    fn empty(views: &Views<'_>) -> Scene {
        Scene {
            cameras: vec![None; views.cameras],
            features: vec![None; views.features],
            objects: vec![None; views.samples.len()],
        }
    }
}
