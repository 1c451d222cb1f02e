//! A complete rig as numbers: the generative model, joints -> poses -> 3D features -> pixels.
use super::{Parent, Rig, Robot};
use crate::Error;
use crate::camera::{CameraModel, PARAMETERS};
use crate::chain::{Chain, Frames, JointChain, LINK_PARAMETERS};
use handeye_solvers::Pose;
use nalgebra::Vector3;

/// Everything needed to predict pixels. Indices of cameras and features are those of the rig it was made from.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// Convention and kinds of the joints, and the frames of the links.
    pub chain: Chain,
    /// `world_from_base`.
    pub base: Pose,
    /// offset, d, a, alpha, beta of every joint [rad, m].
    pub parameters: Vec<f64>,
    /// The cameras.
    pub cameras: Vec<ModelCamera>,
    /// The features.
    pub features: Vec<ModelFeature>,
}

/// A camera of a [`Model`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelCamera {
    /// Its lens.
    pub model: CameraModel,
    /// fx, fy, cx, cy [px] and 8 distortion coefficients; zeros for a depth camera that gives points alone.
    pub intrinsics: [f64; PARAMETERS],
    /// What it is fixed to.
    pub parent: Parent,
    /// `parent_from_camera`.
    pub pose: Pose,
}

/// A feature of a [`Model`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelFeature {
    /// What it is fixed to.
    pub parent: Parent,
    /// Its coordinates in the parent's frame [m].
    pub xyz: Vector3<f64>,
}

/// Cosine of the largest angle by which a pixel's own direction may differ from the feature's: where a distortion has
/// folded back, a feature outside the image seems to be inside, and the two differ by far more.
const SAME_DIRECTION: f64 = 1.0 - 1e-9;

impl ModelCamera {
    /// Where it sees a point of its frame [m] in images of this width and height [px]; `None` where it does not.
    pub fn pixel_inside(&self, [width, height]: [f64; 2], point: &Vector3<f64>) -> Option<[f64; 2]> {
        let [u, v] = self.model.project(&self.intrinsics, point);
        // The centre of the first pixel is 0, so the image begins half a pixel before it.
        let is_inside = (-0.5..width - 0.5).contains(&u) && (-0.5..height - 0.5).contains(&v);
        if !is_inside || !self.model.is_in_front(point) {
            return None;
        }
        // What a distortion folds back into the image is seen elsewhere.
        let ray = self.model.unproject(&self.intrinsics, [u, v])?;
        (ray.dot(point) >= SAME_DIRECTION * point.norm()).then_some([u, v])
    }

    /// How far sideways a point of its frame [m] is moved by a pixel: depth / √(fx fy), or through a fisheye, whose pixels are angles,
    /// distance / √(fx fy) [m/px]. `None` where it is not in front.
    pub fn length_per_pixel(&self, point: &Vector3<f64>) -> Option<f64> {
        let away = if self.model == CameraModel::KannalaBrandt { point.norm() } else { point.z };
        let [fx, fy, ..] = self.intrinsics;
        self.model.is_in_front(point).then(|| away / (fx * fy).abs().sqrt())
    }

    /// True where it has a lens, so that it gives pixels; false for a depth camera that gives points alone.
    pub fn has_lens(&self) -> bool {
        self.intrinsics[0] != 0.0
    }
}

impl Model {
    /// From a rig in which every value is given; a base that is left out is the identity, a `beta` 0, a distortion none, and
    /// a depth camera's intrinsics may be missing.
    /// Fails with the paths of what is missing.
    pub fn new(rig: &Rig) -> Result<Model, Error> {
        let mut missing = Vec::new();
        let mut need = |value: Option<f64>, path: &dyn Fn() -> String| {
            value.unwrap_or_else(|| {
                missing.push(path());
                0.0
            })
        };
        let mut parameters = Vec::with_capacity(LINK_PARAMETERS * rig.robot.joints.len());
        for joint in &rig.robot.joints {
            let fields = [("offset", joint.offset), ("d", joint.d), ("a", joint.a), ("alpha", joint.alpha)];
            for (name, value) in fields {
                parameters.push(need(value, &|| format!("robot.joints.{}.{name}", joint.name)));
            }
            parameters.push(joint.beta.unwrap_or(0.0));
        }
        let mut cameras = Vec::with_capacity(rig.cameras.len());
        for camera in &rig.cameras {
            let mut intrinsics = [0.0; PARAMETERS];
            let fields = [("fx", camera.fx), ("fy", camera.fy), ("cx", camera.cx), ("cy", camera.cy)];
            for (slot, (name, value)) in intrinsics.iter_mut().zip(fields).filter(|_| !camera.gives_points_alone()) {
                *slot = need(value, &|| format!("cameras.{}.{name}", camera.name));
            }
            let distortion = camera.distortion.as_deref().unwrap_or_default();
            intrinsics[4..].iter_mut().zip(distortion).for_each(|(slot, &value)| *slot = value);
            need(camera.pose.map(|_| 0.0), &|| format!("cameras.{}.pose", camera.name));
            cameras.push(ModelCamera {
                model: camera.model.unwrap_or_default(),
                intrinsics,
                parent: camera.parent,
                pose: camera.pose.unwrap_or_else(Pose::identity),
            });
        }
        let mut features = Vec::with_capacity(rig.features.len());
        for feature in &rig.features {
            need(feature.xyz.map(|_| 0.0), &|| format!("features.{}.xyz", feature.name));
            features.push(ModelFeature { parent: feature.parent, xyz: feature.xyz.unwrap_or_default().into() });
        }
        if !missing.is_empty() {
            let most = missing.iter().take(5).cloned().collect::<Vec<_>>().join("`, `");
            let others = if missing.len() > 5 { format!(" and {} more", missing.len() - 5) } else { String::new() };
            return Err(Error::Unusable(format!("the rig is not complete: it has no value for `{most}`{others}")));
        }
        let base = rig.robot.base.unwrap_or_else(Pose::identity);
        Ok(Model { chain: rig.chain(), base, parameters, cameras, features })
    }

    /// Poses in the world of every link, the base first: as many as joints and one more.
    pub fn links(&self, joints: &[f64]) -> Vec<Pose> {
        std::iter::once(self.base).chain(self.chain.links(&self.base, &self.parameters, joints)).collect()
    }

    /// The chain with the model's parameters, of which only the joints move: for loops.
    pub fn joint_chain(&self) -> JointChain {
        JointChain::new(&self.chain, &self.base, &self.parameters)
    }

    /// `world_from_tip`.
    pub fn tip(&self, joints: &[f64]) -> Pose {
        self.chain.tip(&self.base, &self.parameters, joints)
    }

    /// `world_from_parent`, given the poses that [`Model::links`] returns.
    pub fn carrier(&self, parent: Parent, links: &[Pose]) -> Pose {
        match parent {
            Parent::World => Pose::identity(),
            Parent::Link(joint) => links[joint + 1],
            Parent::Tip => links[links.len() - 1],
        }
    }

    /// A feature in a camera's frame [m], given the poses that [`Model::links`] returns.
    pub fn in_camera(&self, camera: usize, feature: usize, links: &[Pose]) -> Vector3<f64> {
        let (camera, feature) = (&self.cameras[camera], &self.features[feature]);
        let in_world = self.carrier(feature.parent, links).transform(&feature.xyz);
        let in_mount = self.carrier(camera.parent, links).inverse_transform(&in_world);
        camera.pose.inverse_transform(&in_mount)
    }

    /// Where a camera sees a feature [px], given the poses that [`Model::links`] returns. Behind the camera, where the rule
    /// of the camera model puts it.
    pub fn pixel(&self, camera: usize, feature: usize, links: &[Pose]) -> [f64; 2] {
        let point = self.in_camera(camera, feature, links);
        let camera = &self.cameras[camera];
        camera.model.project(&camera.intrinsics, &point)
    }
}

impl Rig {
    /// Convention and kinds of the joints, and the frames of the links.
    pub fn chain(&self) -> Chain {
        let Robot { convention, start, joints, .. } = &self.robot;
        let own = start.is_some() || joints.iter().any(|joint| joint.frame.is_some());
        let pose = |pose: &Option<Pose>| pose.unwrap_or_else(Pose::identity);
        let frames = || Frames { start: pose(start), links: joints.iter().map(|joint| pose(&joint.frame)).collect() };
        Chain {
            convention: *convention,
            kinds: joints.iter().map(|joint| joint.kind).collect(),
            reversed: joints.iter().map(|joint| joint.reversed).collect(),
            frames: own.then(frames),
        }
    }
}
