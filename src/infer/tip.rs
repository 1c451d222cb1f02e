//! The tip's pose alone, of rigs with or without a chain.
use super::Sighting;
use super::joints::pixel_sd;
use super::pose::{InferredPose, poses};
use super::views::Views;
use crate::Error;
use crate::rig::{Model, Rig};

/// Answers where the tip of a complete rig is; joints need not be known.
#[derive(Clone, Debug)]
pub struct TipInference {
    views: Views,
    n_joints: usize,
    /// Standard deviation of a pixel coordinate [px].
    sigma: f64,
}

impl TipInference {
    /// Errors: [`Error::Unusable`] with the paths of what is missing.
    pub fn new(rig: &Rig) -> Result<Self, Error> {
        let model = Model::new(rig)?;
        Ok(TipInference { views: Views::new(&model), n_joints: model.chain.len().max(1), sigma: pixel_sd(rig) })
    }

    /// Poses of the tip that explain the pixels, the most probable first; see [`super::Inference::poses`].
    pub fn poses(&self, sightings: &[Sighting]) -> Vec<InferredPose> {
        poses(&self.views, &self.views.known(sightings), self.n_joints, self.sigma)
    }
}
