//! What was seen, with the indices of a rig.
use crate::recording::{Recording, Sample};
use crate::rig::Rig;
use std::collections::BTreeMap;

/// A feature in an image. Indices are those of the rig.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// Index into [`Rig::cameras`].
    pub camera: usize,
    /// Index into [`Rig::features`].
    pub feature: usize,
    /// (u, v) [px].
    pub pixel: [f64; 2],
}

/// Which camera and feature of a rig each of a recording's is, by name.
#[derive(Clone, Debug, PartialEq)]
pub struct Names {
    cameras: Vec<Option<usize>>,
    features: Vec<Option<usize>>,
}

impl Names {
    /// Of a recording of a rig, whose samples are not looked at: a header will do.
    pub fn new(rig: &Rig, header: &Recording) -> Self {
        let cameras: BTreeMap<&str, usize> =
            rig.cameras.iter().enumerate().map(|(index, camera)| (camera.name.as_str(), index)).collect();
        let features: BTreeMap<&str, usize> =
            rig.features.iter().enumerate().map(|(index, feature)| (feature.name.as_str(), index)).collect();
        Names {
            cameras: header.cameras.iter().map(|camera| cameras.get(camera.name.as_str()).copied()).collect(),
            features: header.features.iter().map(|name| features.get(name.as_str()).copied()).collect(),
        }
    }

    /// The detections of a sample that are finite and of cameras and features of the rig.
    pub fn sightings(&self, sample: &Sample) -> Vec<Sighting> {
        let known = |indices: &[Option<usize>], index: u32| indices.get(index as usize).copied().flatten();
        let finite = sample.pixels.iter().filter(|detection| detection.pixel.iter().all(|number| number.is_finite()));
        let sighting = |detection: &crate::recording::Detection| {
            Some(Sighting {
                camera: known(&self.cameras, detection.camera)?,
                feature: known(&self.features, detection.feature)?,
                pixel: detection.pixel,
            })
        };
        finite.filter_map(sighting).collect()
    }
}
