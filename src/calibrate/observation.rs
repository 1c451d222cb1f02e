//! What a camera says of a feature, and how far that is from what a model predicts.
use super::Distance;
use crate::rig::{Model, Noise};
use handeye_solvers::Pose;
use nalgebra::Vector3;

/// One detection; indices are those of the setup.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Observation {
    pub sample: usize,
    pub camera: usize,
    pub feature: usize,
    pub place: Place,
}

/// Where a feature was seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Place {
    /// (u, v) in the image [px].
    Pixel([f64; 2]),
    /// (x, y, z) in the camera's frame [m].
    Point([f64; 3]),
}

/// What kind of detection it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Kind {
    Pixels,
    Points,
}

impl Kind {
    pub const ALL: [Kind; 2] = [Kind::Pixels, Kind::Points];

    /// Numbers of one detection.
    pub fn coordinates(self) -> f64 {
        match self {
            Kind::Pixels => 2.0,
            Kind::Points => 3.0,
        }
    }

    /// Median of |x| for a Gaussian of that many coordinates and unit variance each.
    pub fn median_distance(self) -> f64 {
        match self {
            Kind::Pixels => 1.177_410_022_515_474_6,
            Kind::Points => 1.538_172_254_455_209_3,
        }
    }

    /// Stated standard deviation of a coordinate [px, or m]; exact detections are not weighed without bound.
    pub fn sd(self, noise: &Noise) -> f64 {
        match self {
            Kind::Pixels => noise.pixels.max(1e-3),
            Kind::Points => noise.points.max(1e-6),
        }
    }

    /// A distance with its unit.
    pub fn distance(self, value: f64) -> Distance {
        match self {
            Kind::Pixels => Distance::Pixels(value),
            Kind::Points => Distance::Metres(value),
        }
    }
}

impl Observation {
    pub fn kind(&self) -> Kind {
        match self.place {
            Place::Pixel(_) => Kind::Pixels,
            Place::Point(_) => Kind::Points,
        }
    }

    /// Where a model predicts it, the links of the sample being where they are [px, with a third coordinate of 0; m].
    pub fn predicted(&self, model: &Model, links: &[Pose]) -> Vector3<f64> {
        match self.place {
            Place::Pixel(_) => {
                let [u, v] = model.pixel(self.camera, self.feature, links);
                Vector3::new(u, v, 0.0)
            }
            Place::Point(_) => model.in_camera(self.camera, self.feature, links),
        }
    }

    /// Predicted minus seen.
    pub fn error(&self, model: &Model, links: &[Pose]) -> Vector3<f64> {
        self.predicted(model, links) - self.vector()
    }

    /// Where it was seen, as [`Observation::predicted`] has it.
    pub fn vector(&self) -> Vector3<f64> {
        match self.place {
            Place::Pixel([u, v]) => Vector3::new(u, v, 0.0),
            Place::Point(point) => point.into(),
        }
    }

    /// The point, where it is one.
    pub fn point(&self) -> Option<Vector3<f64>> {
        if let Place::Point(point) = self.place { Some(point.into()) } else { None }
    }

    /// Unit direction from the camera, in its frame; `None` where the lens has none there.
    pub fn bearing(&self, model: &Model) -> Option<Vector3<f64>> {
        let camera = &model.cameras[self.camera];
        match self.place {
            Place::Pixel(pixel) => camera.model.unproject(&camera.intrinsics, pixel),
            Place::Point(point) => Vector3::from(point).try_normalize(f64::MIN_POSITIVE),
        }
    }
}
