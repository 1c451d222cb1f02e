//! What was seen, with the indices of a rig.
use crate::recording::{Detection, PointDetection, Recording, Sample};
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

/// A feature in the frame of a depth camera. Indices are those of the rig.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointSighting {
    /// Index into [`Rig::cameras`].
    pub camera: usize,
    /// Index into [`Rig::features`].
    pub feature: usize,
    /// (x, y, z) in the camera's frame [m].
    pub point: [f64; 3],
}

/// Everything that was seen at a moment; pixels alone are as good as this.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sightings<'a> {
    /// Features in images.
    pub pixels: &'a [Sighting],
    /// Features in the frames of depth cameras.
    pub points: &'a [PointSighting],
}

impl<'a> From<&'a [Sighting]> for Sightings<'a> {
    fn from(pixels: &'a [Sighting]) -> Self {
        Sightings { pixels, points: &[] }
    }
}

impl<'a> From<&'a Vec<Sighting>> for Sightings<'a> {
    fn from(pixels: &'a Vec<Sighting>) -> Self {
        Sightings { pixels, points: &[] }
    }
}

impl<'a, const N: usize> From<&'a [Sighting; N]> for Sightings<'a> {
    fn from(pixels: &'a [Sighting; N]) -> Self {
        Sightings { pixels, points: &[] }
    }
}

/// What of it is of the rig, ordered by camera, then feature, and how good it is.
#[derive(Clone, Debug)]
pub(super) struct Telling {
    pub pixels: Vec<Sighting>,
    pub points: Vec<PointSighting>,
    pub sd: Sd,
}

/// Standard deviations of a coordinate: of a pixel [px], of a point [m].
#[derive(Clone, Copy, Debug)]
pub(super) struct Sd {
    pub pixels: f64,
    pub points: f64,
}

/// Stand in for a rig that says its pixels or points are exact [px, m].
const EXACT: f64 = 1e-3;
const EXACT_POINTS: f64 = 1e-6;

impl Sd {
    /// As a rig has them.
    pub fn of(rig: &Rig) -> Self {
        let or = |sd: f64, exact: f64| if sd > 0.0 { sd } else { exact };
        Sd { pixels: or(rig.noise.pixels, EXACT), points: or(rig.noise.points, EXACT_POINTS) }
    }
}

impl Telling {
    pub fn is_empty(&self) -> bool {
        self.pixels.is_empty() && self.points.is_empty()
    }

    /// How many numbers were measured.
    pub fn coordinates(&self) -> f64 {
        (2 * self.pixels.len() + 3 * self.points.len()) as f64
    }
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

    /// The pixels of a sample that are finite and of cameras and features of the rig.
    pub fn sightings(&self, sample: &Sample) -> Vec<Sighting> {
        let finite = sample.pixels.iter().filter(|detection| detection.pixel.iter().all(|number| number.is_finite()));
        let sighting = |one: &Detection| {
            let (camera, feature) = self.known(one.camera, one.feature)?;
            Some(Sighting { camera, feature, pixel: one.pixel })
        };
        finite.filter_map(sighting).collect()
    }

    /// The same of points.
    pub fn points(&self, sample: &Sample) -> Vec<PointSighting> {
        let finite = sample.points.iter().filter(|detection| detection.point.iter().all(|number| number.is_finite()));
        let sighting = |one: &PointDetection| {
            let (camera, feature) = self.known(one.camera, one.feature)?;
            Some(PointSighting { camera, feature, point: one.point })
        };
        finite.filter_map(sighting).collect()
    }

    fn known(&self, camera: u32, feature: u32) -> Option<(usize, usize)> {
        let of = |indices: &[Option<usize>], index: u32| indices.get(index as usize).copied().flatten();
        Some((of(&self.cameras, camera)?, of(&self.features, feature)?))
    }
}
