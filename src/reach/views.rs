//! What the cameras of a complete rig see of its features.
use crate::Error;
use crate::recording::{Detection, PointDetection};
use crate::rig::{Camera, Model, Parent, Rig};
use handeye_solvers::Pose;
use nalgebra::Vector3;
use std::f64::consts::FRAC_PI_4;

/// The cameras, their images, and how much of the features has to be in them.
pub(crate) struct Views<'a> {
    pub model: &'a Model,
    /// Which of them give points too.
    depth: Vec<bool>,
    sizes: Vec<[f64; 2]>,
    pub need: Need,
    /// For every feature, in its parent's frame, where cameras have to be to see it; `None` where that is everywhere.
    cones: Vec<Option<Cone>>,
    /// Height in the world below which nothing of the arm is to be [m].
    pub floor: Option<f64>,
}

/// Directions about an axis.
#[derive(Clone, Copy, Debug)]
struct Cone {
    axis: Vector3<f64>,
    /// Cosine of the largest angle from the axis.
    cosine: f64,
}

/// Share of the largest angle at which a feature was seen that is counted on.
const COUNTED_ON: f64 = 0.8;

/// Steps towards the axis of a cone: it is off by the inverse root of their number at most, in radii.
const STEPS: u32 = 100;

/// An angle at which a feature is seen that is seen at all [rad].
const FACING: f64 = FRAC_PI_4;

/// How many features have to be in view.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Need {
    /// In every camera.
    pub per_camera: usize,
    /// In the camera that sees most.
    pub in_one: usize,
    /// Summed over the cameras.
    pub in_total: usize,
}

/// By how much a position misses what is asked of it; ordered, so that a walk can descend it.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub(crate) struct Shortfall {
    /// Features that are missing, and one more where the arm is too low.
    pub missing: usize,
    /// Mean angle between the optical axes and the features out of view [rad], and the depth below the floor [m]: where to go while none is seen.
    angle: f64,
}

impl<'a> Views<'a> {
    pub fn new(rig: &Rig, model: &'a Model, need: Need) -> Result<Self, Error> {
        for (count, what) in [(rig.cameras.len(), "cameras"), (rig.features.len(), "features")] {
            if count == 0 {
                return Err(Error::Unusable(format!("the rig has no {what}, so nothing would be seen")));
            }
        }
        let depth = rig.cameras.iter().map(|camera| camera.depth).collect();
        Ok(Views { model, depth, sizes: sizes(rig)?, need, cones: vec![None; rig.features.len()], floor: None })
    }

    /// The same where features are seen from the side from which they were seen before, such as the front of a board.
    /// `seen`: camera, feature and the joints of the moment.
    pub fn facing<'b>(mut self, seen: impl Iterator<Item = (usize, usize, &'b [f64])>) -> Self {
        let mut sides = vec![Vec::new(); self.cones.len()];
        seen.for_each(|(camera, feature, joints)| {
            sides[feature].push(self.side(camera, feature, &self.model.links(joints)));
        });
        self.cones = sides.iter().map(|sides| Cone::around(sides)).collect();
        self
    }

    /// The same where nothing of the arm is to be below a height in the world [m]: no link that can move up or down, nor what is on the arm.
    pub fn above(mut self, floor: Option<f64>) -> Self {
        self.floor = floor;
        self
    }

    /// How far the lowest point of the arm is below the floor [m]; 0 where none is.
    fn depth_below(&self, links: &[Pose]) -> f64 {
        let Some(floor) = self.floor else { return 0.0 };
        let Model { cameras, features, .. } = self.model;
        let cameras = cameras.iter().map(|camera| (camera.parent, camera.pose.translation));
        let carried = cameras.chain(features.iter().map(|feature| (feature.parent, feature.xyz)));
        let carried = carried.filter(|(parent, _)| *parent != Parent::World);
        let carried = carried.map(|(parent, point)| self.model.carrier(parent, links).transform(&point).z);
        // The first link turns in its place, or slides along the base.
        let heights = links.iter().skip(2).map(|link| link.translation.z).chain(carried);
        heights.map(|height| floor - height).fold(0.0, f64::max)
    }

    /// Direction of a camera from a feature, in the feature's parent's frame.
    fn side(&self, camera: usize, feature: usize, links: &[Pose]) -> Vector3<f64> {
        let (lens, point) = (&self.model.cameras[camera], &self.model.features[feature]);
        let centre = self.model.carrier(lens.parent, links).transform(&lens.pose.translation);
        (self.model.carrier(point.parent, links).inverse_transform(&centre) - point.xyz).normalize()
    }

    /// Exact pixels of all features in view, ordered by camera, then by the rig's features.
    pub fn detections(&self, joints: &[f64]) -> Vec<Detection> {
        let links = self.model.links(joints);
        let mut detections = Vec::new();
        for camera in 0..self.sizes.len() {
            for feature in 0..self.model.features.len() {
                if let Some(pixel) = self.pixel(camera, feature, &links) {
                    detections.push(Detection { camera: camera as u32, feature: feature as u32, pixel });
                }
            }
        }
        detections
    }

    /// Exact points of what depth cameras have in view, of these detections.
    pub fn points(&self, joints: &[f64], detections: &[Detection]) -> Vec<PointDetection> {
        let links = self.model.links(joints);
        let seen = detections.iter().filter(|seen| self.depth[seen.camera as usize]);
        seen.map(|&Detection { camera, feature, .. }| {
            let point = self.model.in_camera(camera as usize, feature as usize, &links).into();
            PointDetection { camera, feature, point }
        })
        .collect()
    }

    /// By how much a position misses what is asked of it. `in_view`: how many features each camera sees.
    pub fn shortfall(&self, joints: &[f64], in_view: &mut [usize]) -> Shortfall {
        let links = self.model.links(joints);
        let (mut angle, mut n_hidden) = (0.0, 0);
        for (camera, seen) in in_view.iter_mut().enumerate() {
            *seen = 0;
            for feature in 0..self.model.features.len() {
                if self.pixel(camera, feature, &links).is_some() {
                    *seen += 1;
                } else {
                    let point = self.model.in_camera(camera, feature, &links);
                    angle += point.xy().norm().atan2(point.z);
                    n_hidden += 1;
                }
            }
        }
        let need = self.need;
        let per_camera: usize = in_view.iter().map(|&seen| need.per_camera.saturating_sub(seen)).sum();
        let in_one = need.in_one.saturating_sub(in_view.iter().copied().max().unwrap_or(0));
        let in_total = need.in_total.saturating_sub(in_view.iter().sum());
        let below = self.depth_below(&links);
        Shortfall {
            missing: per_camera.max(in_one).max(in_total) + usize::from(below > 0.0),
            angle: angle / f64::from(n_hidden.max(1)) + below,
        }
    }

    /// Where a camera sees a feature, if it does.
    fn pixel(&self, camera: usize, feature: usize, links: &[Pose]) -> Option<[f64; 2]> {
        let point = self.model.in_camera(camera, feature, links);
        let pixel = self.model.cameras[camera].pixel_inside(self.sizes[camera], &point)?;
        let shows = |cone: Cone| self.side(camera, feature, links).dot(&cone.axis) >= cone.cosine;
        self.cones[feature].is_none_or(shows).then_some(pixel)
    }
}

impl Cone {
    /// The narrowest cone around directions, by steps towards the farthest (Badoiu and Clarkson 2003), and a share of its width;
    /// `None` of directions that are on no one side.
    fn around(sides: &[Vector3<f64>]) -> Option<Cone> {
        let mut axis = sides.iter().sum::<Vector3<f64>>().try_normalize(f64::EPSILON)?;
        let farthest = |axis: &Vector3<f64>| sides.iter().min_by(|a, b| a.dot(axis).total_cmp(&b.dot(axis)));
        for step in 1..=STEPS {
            let way = farthest(&axis)? - axis;
            axis = (axis + way / f64::from(1 + step)).try_normalize(f64::EPSILON)?;
        }
        let least = farthest(&axis)?.dot(&axis);
        (least > 0.0).then(|| Cone { axis, cosine: (COUNTED_ON * least.acos()).max(FACING).cos() })
    }
}

/// Width and height of every camera's images [px].
///
/// Errors: [`Error::Unusable`] where one is not known, or a depth camera has no lens.
pub(crate) fn sizes(rig: &Rig) -> Result<Vec<[f64; 2]>, Error> {
    let size = |camera: &Camera| match camera.size {
        _ if camera.gives_points_alone() => Err(Error::Unusable(format!(
            "depth camera `{}` has no intrinsics, and nothing says what is in its view: give fx, fy, cx and cy",
            camera.name
        ))),
        Some(size) => Ok(size.map(f64::from)),
        None => Err(Error::Unusable(format!(
            "the rig is not complete: it has no value for `size` of camera `{}`",
            camera.name
        ))),
    };
    rig.cameras.iter().map(size).collect()
}
