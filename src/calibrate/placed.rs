//! Where a sample's readings put the links, and which of its detections follow from that.
use super::Correspondence;
use super::observation::{Observation, Place};
use crate::recording::Sample;
use crate::rig::{Model, Parent};
use handeye_solvers::Pose;

/// Links in the world, from the base on.
#[derive(Clone, Debug)]
pub(crate) struct Placed {
    pub links: Vec<Pose>,
    /// True where the links between base and tip stand at the tip: nobody knows them.
    is_tip_alone: bool,
}

impl Placed {
    /// From joints, one per joint of the model.
    pub fn by_joints(model: &Model, joints: &[f64]) -> Self {
        Placed { links: model.links(joints), is_tip_alone: false }
    }

    /// From the tip's pose alone.
    pub fn by_tip(model: &Model, tip: Pose) -> Self {
        let links = std::iter::once(model.base).chain(vec![tip; model.chain.len().max(1)]).collect();
        Placed { links, is_tip_alone: true }
    }

    /// From the joints as they were read, or else the tip's pose; `None` where neither was.
    pub fn read(model: &Model, sample: &Sample) -> Option<Self> {
        let joints = sample.joints.as_ref().map(|read| Placed::by_joints(model, read));
        joints.or_else(|| sample.pose.map(|pose| Placed::by_tip(model, pose)))
    }

    /// False for what hangs on a link of which nothing is known.
    pub fn knows(&self, model: &Model, parent: Parent) -> bool {
        let is_inner = matches!(parent, Parent::Link(joint) if joint + 1 < model.chain.len());
        !(self.is_tip_alone && is_inner)
    }

    /// The detections of a sample that can be predicted; those of a number of sample 0.
    pub fn predictable(&self, model: &Model, index: &Correspondence, sample: &Sample) -> Vec<Observation> {
        let known = |camera: u32, feature: u32, place: Place| {
            let (camera, feature) = (index.cameras[camera as usize]?, index.features[feature as usize]?);
            let parents = [model.cameras[camera].parent, model.features[feature].parent];
            let is_placed = parents.iter().all(|parent| self.knows(model, *parent));
            is_placed.then_some(Observation { sample: 0, camera, feature, place })
        };
        let pixels = sample.pixels.iter().filter_map(|seen| known(seen.camera, seen.feature, Place::Pixel(seen.pixel)));
        let points = sample.points.iter().filter_map(|seen| known(seen.camera, seen.feature, Place::Point(seen.point)));
        pixels.filter(|seen| model.cameras[seen.camera].has_lens()).chain(points).collect()
    }
}
