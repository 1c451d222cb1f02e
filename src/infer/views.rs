//! A detection as a linear function of where its feature is.
use super::sighting::{Sd, Telling};
use super::{PointSighting, Sighting, Sightings};
use crate::camera::{CameraModel, PARAMETERS};
use crate::rig::{Model, Parent};
use handeye_solvers::Pose;
use handeye_solvers::manifold::so3;
use nalgebra::Vector3;

/// Cameras and features of a model, each with the number of joints that move it.
#[derive(Clone, Debug)]
pub(crate) struct Views {
    pub cameras: Vec<View>,
    pub features: Vec<Spot>,
}

/// A camera.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    pub model: CameraModel,
    pub intrinsics: [f64; PARAMETERS],
    /// `parent_from_camera`.
    pub pose: Pose,
    /// Joints that move it, from the base: 0 in the world.
    pub depth: usize,
}

/// A feature.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spot {
    pub xyz: Vector3<f64>,
    pub depth: usize,
}

/// Prediction of a detection, and how it follows the feature.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Glance {
    /// Predicted minus seen [px].
    pub error: [f64; 2],
    /// The pixel's rows by the feature's position in the world [px/m].
    pub rows: [Vector3<f64>; 2],
    /// The feature in the world [m].
    pub point: Vector3<f64>,
}

impl Views {
    pub fn new(model: &Model) -> Self {
        let depth = |parent: Parent| match parent {
            Parent::World => 0,
            Parent::Link(joint) => joint + 1,
            // A tip whose joints nobody knows moves all the same.
            Parent::Tip => model.chain.len().max(1),
        };
        let view = |camera: &crate::rig::ModelCamera| View {
            model: camera.model,
            intrinsics: camera.intrinsics,
            pose: camera.pose,
            depth: depth(camera.parent),
        };
        let spot = |feature: &crate::rig::ModelFeature| Spot { xyz: feature.xyz, depth: depth(feature.parent) };
        Views { cameras: model.cameras.iter().map(view).collect(), features: model.features.iter().map(spot).collect() }
    }

    /// True where both are of the rig, the camera gives pixels and this one is finite.
    pub fn knows(&self, sighting: &Sighting) -> bool {
        sighting.camera < self.cameras.len()
            && sighting.feature < self.features.len()
            && self.cameras[sighting.camera].intrinsics[0] != 0.0
            && sighting.pixel.iter().all(|number| number.is_finite())
    }

    /// True where both are of the rig and the point is finite.
    pub fn knows_point(&self, sighting: &PointSighting) -> bool {
        sighting.camera < self.cameras.len()
            && sighting.feature < self.features.len()
            && sighting.point.iter().all(|number| number.is_finite())
    }

    /// What is of the rig and finite, in order. `sd`: how good it is.
    pub(super) fn known(&self, seen: Sightings<'_>, sd: Sd) -> Telling {
        let mut pixels: Vec<_> = seen.pixels.iter().filter(|sighting| self.knows(sighting)).copied().collect();
        let mut points: Vec<_> = seen.points.iter().filter(|point| self.knows_point(point)).copied().collect();
        pixels.sort_by_key(|sighting| (sighting.camera, sighting.feature));
        points.sort_by_key(|sighting| (sighting.camera, sighting.feature));
        Telling { pixels, points, sd }
    }

    /// Joints between a camera and a feature, which are those that move what the camera sees of it: from the first to before the
    /// second.
    pub fn between(&self, camera: usize, feature: usize) -> (usize, usize) {
        let (camera, feature) = (self.cameras[camera].depth, self.features[feature].depth);
        (camera.min(feature), camera.max(feature))
    }

    /// The point in the camera frame that is seen at a pixel, `depth` in front of the camera [m]; `None` where none is.
    pub fn at_depth(&self, sighting: &Sighting, depth: f64) -> Option<Vector3<f64>> {
        let camera = &self.cameras[sighting.camera];
        let ray = camera.model.unproject(&camera.intrinsics, sighting.pixel)?;
        (ray.z > 0.0).then(|| ray * (depth / ray.z))
    }

    /// Predicted minus seen point, along the world's axes, and the feature in the world [m]. Arguments as of [`Views::glance`].
    #[inline]
    pub fn glance_at_point(
        &self,
        sighting: &PointSighting,
        feature_frame: Option<&Pose>,
        world_from_camera: &Pose,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let xyz = &self.features[sighting.feature].xyz;
        let point = feature_frame.map_or(*xyz, |frame| frame.transform(xyz));
        (point - world_from_camera.transform(&sighting.point.into()), point)
    }

    /// `feature_frame`, `world_from_camera`: where the feature's parent and the camera are in the world.
    #[inline]
    pub fn glance(&self, sighting: &Sighting, feature_frame: Option<&Pose>, world_from_camera: &Pose) -> Glance {
        let xyz = &self.features[sighting.feature].xyz;
        self.glance_at(sighting, feature_frame.map_or(*xyz, |frame| frame.transform(xyz)), world_from_camera)
    }

    /// The same where the feature is at `point` in the world [m].
    #[inline]
    pub fn glance_at(&self, sighting: &Sighting, point: Vector3<f64>, world_from_camera: &Pose) -> Glance {
        let camera = &self.cameras[sighting.camera];
        let in_camera = so3::apply_transposed(&world_from_camera.rotation, &(point - world_from_camera.translation));
        let (pixel, slopes) = camera.model.linearize(&camera.intrinsics, &in_camera);
        Glance {
            error: [pixel[0] - sighting.pixel[0], pixel[1] - sighting.pixel[1]],
            rows: slopes.map(|slope| so3::apply(&world_from_camera.rotation, &slope)),
            point,
        }
    }
}
