//! What is known and what was measured, side by side: the rig completed by the recording's header, and its observations.
use super::cameras::{KnownIntrinsics, complete_camera, leave_out_unseen_cameras};
use super::evaluate::Correspondence;
use super::lengths::{self, Found};
use super::observation::{Kind, Observation, Place};
use super::states::States;
use super::unlisted;
use crate::Error;
use crate::camera::{CameraModel, PARAMETERS};
use crate::chain::LINK_PARAMETERS;
use crate::recording::{Recording, Sample};
use crate::rig::{Camera, Feature, Joint, Length, Model, ModelCamera, ModelFeature, Parameter, Parent, Rig};
use handeye_solvers::Pose;
use nalgebra::Vector3;

/// A calibration problem before anything is estimated.
#[derive(Clone, Debug)]
pub(crate) struct Setup {
    /// The rig with every joint, camera and feature listed, as far as their values are known.
    pub rig: Rig,
    /// The same as numbers; what is unknown is a placeholder until it is initialised.
    pub model: Model,
    /// Where each camera's numbers come from.
    pub intrinsics: Vec<KnownIntrinsics>,
    /// What is known of the robot's state in every sample.
    pub states: States,
    /// Index of every sample in the recording.
    pub samples: Vec<usize>,
    /// Every detection of a sample that takes part, sample by sample; pixels before points.
    pub observations: Vec<Observation>,
    /// What was measured of the rig, with its ends.
    pub lengths: Vec<(Length, Found)>,
    /// Names of cameras that are left out: their poses are unknown, and no sample with joints has a detection of theirs.
    pub unseen: Vec<String>,
}

impl Setup {
    /// Puts rig and recording together; fails where they contradict each other.
    pub fn new(rig: &Rig, recording: &Recording) -> Result<Setup, Error> {
        let mut rig = rig.clone();
        name_joints(&mut rig, recording)?;
        let mut intrinsics = Vec::new();
        unlisted::list_cameras(&mut rig, recording);
        let unseen = leave_out_unseen_cameras(&mut rig, recording);
        for camera in &mut rig.cameras {
            let recorded = recording.cameras.iter().find(|recorded| recorded.name == camera.name);
            intrinsics.push(complete_camera(camera, recorded, recording)?);
        }
        unlisted::list_features(&mut rig, recording);
        check_held(&rig)?;
        let model = placeholder_model(&rig);
        let index = Correspondence::new(&rig, recording);
        let (samples, states) = States::new(&rig, recording)?;
        let mut observations = Vec::new();
        for (state, &number) in samples.iter().enumerate() {
            let Sample { pixels, points, .. } = &recording.samples[number];
            let pixels = pixels.iter().map(|one| (one.camera, one.feature, Place::Pixel(one.pixel)));
            let points = points.iter().map(|one| (one.camera, one.feature, Place::Point(one.point)));
            for (camera, feature, place) in pixels.chain(points) {
                let known = (index.cameras[camera as usize], index.features[feature as usize]);
                let (Some(camera), Some(feature)) = known else { continue };
                observations.push(Observation { sample: state, camera, feature, place });
            }
        }
        if observations.is_empty() {
            return Err(Error::NotEnoughData("no sample has a detected feature".into()));
        }
        let lengths = lengths::find(&rig)?;
        Ok(Setup { rig, model, intrinsics, states, samples, observations, lengths, unseen })
    }

    /// True where every row of the chain is given.
    pub fn chain_is_known(&self) -> bool {
        is_chain_known(&self.rig)
    }

    /// How many samples take part.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// True where the tip's motion is known before anything is learned: its poses, or joints of a known chain.
    pub fn motion_is_known(&self) -> bool {
        !self.states.chain || self.chain_is_known()
    }

    /// True where poses were recorded beside a chain that is learned, whose tip is in a frame of its own.
    pub fn tool_is_open(&self) -> bool {
        self.states.poses_beside_joints() && !self.chain_is_known()
    }

    /// About how far a first value of a state turns the tip wrongly [rad].
    pub fn state_angle(&self) -> f64 {
        let (states, noise) = (&self.states, &self.rig.noise);
        let steps = 0.5 * self.len() as f64;
        let variance = if !states.chain {
            let walked = if states.poses.iter().all(Option::is_none) { steps } else { 0.0 };
            noise.pose.rot.powi(2) + walked * noise.pose_action.rot.powi(2)
        } else if states.readings.iter().all(Option::is_none) {
            steps * noise.joint_action.powi(2) * self.model.chain.len() as f64
        } else {
            noise.joints.powi(2) * self.model.chain.len() as f64
        };
        variance.sqrt()
    }

    /// Standard deviation of a coordinate of a detection [px, or m].
    pub fn sd(&self, kind: Kind) -> f64 {
        kind.sd(&self.rig.noise)
    }

    /// The detections of one sample.
    pub fn of_sample(&self, sample: usize) -> &[Observation] {
        let first = self.observations.partition_point(|seen| seen.sample < sample);
        let end = self.observations.partition_point(|seen| seen.sample <= sample);
        &self.observations[first..end]
    }

    /// True where some detections are of that kind.
    pub fn has(&self, kind: Kind) -> bool {
        self.observations.iter().any(|seen| seen.kind() == kind)
    }
}

fn name_joints(rig: &mut Rig, recording: &Recording) -> Result<(), Error> {
    let joints = &mut rig.robot.joints;
    let moves = |sample: &Sample| sample.joints.is_some() || sample.joint_action.is_some();
    if !recording.samples.iter().any(moves) {
        return if is_chain_known(rig) {
            Ok(())
        } else {
            Err(Error::Unusable(
                "the recording has no joints, and so tells nothing of the chain, of which rows are unknown: give them, or take \
                 [[robot.joints]] out of the rig"
                    .into(),
            ))
        };
    }
    if joints.is_empty() {
        joints.extend(recording.joints.iter().map(|name| Joint { name: name.clone(), ..Joint::default() }));
    }
    if recording.joints.is_empty() {
        return Err(Error::Unusable("the recording's header names no joint, and a chain needs one".into()));
    }
    if joints.len() != recording.joints.len() {
        return Err(Error::Unusable(format!(
            "the rig has {} joints, the recording's header names {}",
            joints.len(),
            recording.joints.len()
        )));
    }
    Ok(())
}

fn is_chain_known(rig: &Rig) -> bool {
    let known = |joint: &Joint| [joint.offset, joint.d, joint.a, joint.alpha].iter().all(Option::is_some);
    rig.robot.joints.iter().all(known)
}

/// Every parameter that is held must have a value (a base that is left out is the identity).
fn check_held(rig: &Rig) -> Result<(), Error> {
    for parameter in rig.parameters() {
        let base = parameter == Parameter::Base;
        if rig.is_fixed(&parameter) && !base && !rig.has_value(&parameter) {
            return Err(Error::Unusable(format!(
                "`{}` is held by [estimate] fixed but has no value: give it one, or leave it free",
                parameter.path(rig)
            )));
        }
        let parent = match parameter {
            Parameter::CameraPose(camera) => rig.cameras[camera].parent,
            Parameter::FeatureXyz(feature) => rig.features[feature].parent,
            Parameter::TargetPose(target) => rig.targets[target].parent,
            _ => Parent::World,
        };
        if rig.is_fixed(&parameter) && parent != Parent::World && !is_chain_known(rig) {
            return Err(Error::Unusable(format!(
                "`{}` is held in the frame of a chain that is not known: give every row of [[robot.joints]], or leave it free \
                 (what is given still sets the scale)",
                parameter.path(rig)
            )));
        }
    }
    Ok(())
}

fn placeholder_model(rig: &Rig) -> Model {
    let mut parameters = Vec::with_capacity(LINK_PARAMETERS * rig.robot.joints.len());
    for joint in &rig.robot.joints {
        let row = [joint.offset, joint.d, joint.a, joint.alpha, joint.beta];
        parameters.extend(row.map(|value| value.unwrap_or(0.0)));
    }
    let camera = |camera: &Camera| {
        let mut intrinsics = [0.0; PARAMETERS];
        let focal_and_centre = [camera.fx, camera.fy, camera.cx, camera.cy];
        intrinsics.iter_mut().zip(focal_and_centre).for_each(|(slot, value)| *slot = value.unwrap_or(0.0));
        let distortion = camera.distortion.as_deref().unwrap_or_default();
        intrinsics[4..].iter_mut().zip(distortion).for_each(|(slot, value)| *slot = *value);
        ModelCamera {
            model: camera.model.unwrap_or(CameraModel::Pinhole),
            intrinsics,
            parent: camera.parent,
            pose: camera.pose.unwrap_or_else(Pose::identity),
        }
    };
    let feature = |feature: &Feature| ModelFeature {
        parent: feature.parent,
        xyz: feature.xyz.map_or_else(Vector3::zeros, Vector3::from),
    };
    Model {
        chain: rig.chain(),
        base: rig.robot.base.unwrap_or_else(Pose::identity),
        parameters,
        cameras: rig.cameras.iter().map(camera).collect(),
        features: rig.features.iter().map(feature).collect(),
    }
}
