//! A complete rig prepared for control loops, and where it is at a moment.
use crate::Error;
use crate::chain::{Axis, JointChain, Posture};
use crate::infer::{Glance, Sighting, Views};
use crate::rig::{Limits, Model, Rig};
use handeye_solvers::Pose;
use nalgebra::Vector3;

/// Arm, cameras and features with fixed parameters.
#[derive(Clone, Debug)]
pub struct Arm {
    chain: JointChain,
    views: Views,
    limits: Vec<Limits>,
    sizes: Vec<Option<[u32; 2]>>,
}

/// Where an arm is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Configuration {
    /// One reading per joint [rad or m].
    pub joints: Vec<f64>,
    /// How fast they move now [rad/s or m/s].
    pub velocity: Vec<f64>,
    /// Links and axes in the world.
    pub posture: Posture,
    /// `world_from_camera` of every camera.
    pub cameras: Vec<Pose>,
}

/// A feature in an image.
#[derive(Clone, Copy, Debug)]
pub struct Sight<'a> {
    /// Its predicted pixel minus that of the sighting [px].
    pub error: [f64; 2],
    axes: &'a [Axis],
    /// Slopes of the pixel by the feature's position in the world [px/m].
    rows: [Vector3<f64>; 2],
    /// The feature in the world [m].
    point: Vector3<f64>,
    /// Joints that move it in the image: from, to before.
    from: usize,
    to: usize,
}

impl Arm {
    /// Of a complete rig.
    ///
    /// Errors: [`Error::Unusable`] with the paths of what is missing, or where there is no joint.
    pub fn new(rig: &Rig) -> Result<Self, Error> {
        let model = Model::new(rig)?;
        if model.chain.is_empty() {
            return Err(Error::Unusable("a rig without joints cannot be moved: give [[robot.joints]]".to_owned()));
        }
        Ok(Arm {
            chain: model.joint_chain(),
            views: Views::new(&model),
            limits: rig.robot.joints.iter().map(|joint| joint.limits).collect(),
            sizes: rig.cameras.iter().map(|camera| camera.size).collect(),
        })
    }

    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.chain.len()
    }

    /// `world_from_tip` at these joints, one reading each [rad or m].
    pub fn tip(&self, joints: &[f64]) -> Pose {
        self.chain.tip(joints)
    }

    /// Limits of every joint, as the rig has them.
    pub fn limits(&self) -> &[Limits] {
        &self.limits
    }

    /// Width and height of a camera's images [px], where the rig says so.
    pub fn size(&self, camera: usize) -> Option<[u32; 2]> {
        self.sizes.get(camera).copied().flatten()
    }

    /// Fails where readings are not of this arm or not finite.
    pub(super) fn check(&self, joints: &[f64]) -> Result<(), Error> {
        let (found, n) = (joints.len(), self.joints());
        if found != n {
            return Err(Error::Unusable(format!("{found} joint readings; the rig has {n} joints")));
        }
        let odd = joints.iter().position(|joint| !joint.is_finite());
        odd.map_or(Ok(()), |i| {
            Err(Error::Unusable(format!("joint reading {} is {}, not a finite number", i + 1, joints[i])))
        })
    }

    /// Moves a configuration to these joints, one reading each [rad or m]; its velocity stays, and is 0 at first.
    pub fn configure(&self, joints: &[f64], at: &mut Configuration) {
        at.joints.clear();
        at.joints.extend_from_slice(joints);
        at.velocity.resize(joints.len(), 0.0);
        self.chain.posture(joints, &mut at.posture);
        at.cameras.clear();
        let links = &at.posture.links;
        at.cameras.extend(self.views.cameras.iter().map(|view| match view.depth {
            0 => view.pose,
            depth => links[depth] * view.pose,
        }));
    }

    /// Where a camera sees a feature, and how that changes with the joints. `None` where camera or feature are not of the rig.
    pub fn sight<'a>(&self, at: &'a Configuration, sighting: &Sighting) -> Option<Sight<'a>> {
        self.views.knows(sighting).then(|| {
            let depth = self.views.features[sighting.feature].depth;
            let frame = (depth > 0).then(|| &at.posture.links[depth]);
            self.follow(at, sighting, self.views.glance(sighting, frame, &at.cameras[sighting.camera]))
        })
    }

    /// The same for a feature that is where its pixel says, `depth` in front of the camera [m], and not where the rig has it. `None` also
    /// where nothing in front of the camera is seen at that pixel.
    pub fn sight_at_depth<'a>(&self, at: &'a Configuration, seen: &Sighting, depth: f64) -> Option<Sight<'a>> {
        if !self.views.knows(seen) {
            return None;
        }
        let world_from_camera = &at.cameras[seen.camera];
        let point = world_from_camera.transform(&self.views.at_depth(seen, depth)?);
        Some(self.follow(at, seen, self.views.glance_at(seen, point, world_from_camera)))
    }

    fn follow<'a>(&self, at: &'a Configuration, sighting: &Sighting, glance: Glance) -> Sight<'a> {
        let (from, to) = self.views.between(sighting.camera, sighting.feature);
        let sign = if self.views.features[sighting.feature].depth == to { 1.0 } else { -1.0 };
        let rows = glance.rows.map(|row| row * sign);
        Sight { error: glance.error, axes: &at.posture.axes, rows, point: glance.point, from, to }
    }

    /// Predicted pixel of a feature [px]; `None` where camera or feature are not of the rig.
    pub fn pixel(&self, at: &Configuration, camera: usize, feature: usize) -> Option<[f64; 2]> {
        Some(self.sight(at, &Sighting { camera, feature, pixel: [0.0, 0.0] })?.error)
    }
}

impl Configuration {
    /// Takes over the velocity of a motion of `dt` seconds.
    pub(super) fn move_at(&mut self, motion: &[f64], dt: f64) {
        if dt > 0.0 {
            self.velocity.iter_mut().zip(motion).for_each(|(velocity, motion)| *velocity = motion / dt);
        }
    }
}

impl Sight<'_> {
    /// Slopes of u (`axis` 0) or v (1) by each joint [px/rad or px/m].
    pub fn slopes(&self, axis: usize) -> impl Iterator<Item = f64> {
        // Only joints between camera and feature move the pixel, as if the camera stood still.
        self.axes.iter().enumerate().map(move |(i, joint)| {
            let moves = (self.from..self.to).contains(&i);
            if moves { self.rows[axis].dot(&joint.twist(&self.point).1) } else { 0.0 }
        })
    }
}
