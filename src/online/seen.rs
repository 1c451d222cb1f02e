//! A sample as a rig sees it: its joints, and detections with the rig's own indices.
use crate::recording::{Recording, Sample};
use crate::rig::{Camera, Rig};
use std::collections::BTreeMap;

/// A sample that can be compared.
#[derive(Clone, Debug)]
pub(super) struct Seen {
    /// One per joint [rad or m].
    pub joints: Vec<f64>,
    /// Finite, of cameras and features of the rig.
    pub detections: Vec<Spot>,
}

/// A detection.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    pub camera: usize,
    pub feature: usize,
    pub pixel: [f64; 2],
}

/// Which camera and feature of a rig each of a recording's is, by name.
#[derive(Clone, Debug)]
pub(super) struct Names {
    cameras: Vec<Option<usize>>,
    features: Vec<Option<usize>>,
}

impl Names {
    pub fn new(rig: &Rig, header: &Recording) -> Names {
        let camera = |name: &str| {
            let is_it = |camera: &Camera| camera.name == name && !camera.gives_points_alone();
            rig.cameras.iter().position(is_it)
        };
        let features: BTreeMap<&str, usize> =
            rig.features.iter().enumerate().map(|(index, feature)| (feature.name.as_str(), index)).collect();
        Names {
            cameras: header.cameras.iter().map(|recorded| camera(&recorded.name)).collect(),
            features: header.features.iter().map(|name| features.get(name.as_str()).copied()).collect(),
        }
    }

    /// `None` where there is nothing to compare.
    pub fn look(&self, sample: &Sample, n_joints: usize) -> Option<Seen> {
        let joints = sample.joints.as_ref().filter(|joints| joints.len() == n_joints)?;
        if !joints.iter().all(|joint| joint.is_finite()) {
            return None;
        }
        let known = |indices: &[Option<usize>], index: u32| indices.get(index as usize).copied().flatten();
        let spots = sample.pixels.iter().filter(|detection| detection.pixel.iter().all(|number| number.is_finite()));
        let detections: Vec<Spot> = spots
            .filter_map(|detection| {
                let camera = known(&self.cameras, detection.camera)?;
                let feature = known(&self.features, detection.feature)?;
                Some(Spot { camera, feature, pixel: detection.pixel })
            })
            .collect();
        (!detections.is_empty()).then(|| Seen { joints: joints.clone(), detections })
    }
}
