//! The tip's pose alone, of rigs with or without a chain.
use super::Sightings;
use super::pose::{InferredPose, poses};
use super::sighting::Sd;
use super::views::Views;
use crate::Error;
use crate::rig::{Model, Rig};

/// Answers where the tip of a complete rig is; joints need not be known.
#[derive(Clone, Debug)]
pub struct TipInference {
    views: Views,
    n_joints: usize,
    sd: Sd,
}

impl TipInference {
    /// Errors: [`Error::Unusable`] with the paths of what is missing.
    pub fn new(rig: &Rig) -> Result<Self, Error> {
        let model = Model::new(rig)?;
        Ok(TipInference { views: Views::new(&model), n_joints: model.chain.len().max(1), sd: Sd::of(rig) })
    }

    /// Poses of the tip that explain what was seen, the most probable first; see [`super::Inference::poses`].
    pub fn poses<'a>(&self, sightings: impl Into<Sightings<'a>>) -> Vec<InferredPose> {
        poses(&self.views, &self.views.known(sightings.into(), self.sd), self.n_joints)
    }
}
