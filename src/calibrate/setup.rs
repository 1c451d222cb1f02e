//! What is known and what was measured, side by side: the rig completed by the recording's header, and its observations.
use super::evaluate::Correspondence;
use super::states::States;
use crate::Error;
use crate::camera::{CameraModel, PARAMETERS};
use crate::chain::LINK_PARAMETERS;
use crate::recording::{RecordedCamera, Recording, Sample};
use crate::rig::{Camera, Feature, Joint, Model, ModelCamera, ModelFeature, Parameter, Parent, Rig};
use handeye_solvers::Pose;
use nalgebra::Vector3;
use std::collections::BTreeSet;

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
    /// Every detection of a sample that takes part, sample by sample.
    pub observations: Vec<Observation>,
    /// Names of cameras that are left out: their poses are unknown, and no sample with joints has a detection of theirs.
    pub unseen: Vec<String>,
}

/// One detection; indices are those of [`Setup`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Observation {
    pub sample: usize,
    pub camera: usize,
    pub feature: usize,
    pub pixel: [f64; 2],
}

/// Which intrinsics somebody gave, in the rig or in the recording's header.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct KnownIntrinsics {
    pub focal: bool,
    pub centre: bool,
    pub distortion: bool,
}

/// Focal length [longer side of the image] where nobody gives one.
const FOCAL_GUESS: f64 = 1.2;

impl Setup {
    /// Puts rig and recording together; fails where they contradict each other.
    pub fn new(rig: &Rig, recording: &Recording) -> Result<Setup, Error> {
        let mut rig = rig.clone();
        name_joints(&mut rig, recording)?;
        let mut intrinsics = Vec::new();
        for recorded in &recording.cameras {
            if !rig.cameras.iter().any(|camera| camera.name == recorded.name) {
                rig.cameras.push(Camera { name: recorded.name.clone(), ..Camera::default() });
            }
        }
        for camera in &mut rig.cameras {
            let recorded = recording.cameras.iter().find(|recorded| recorded.name == camera.name);
            intrinsics.push(complete_camera(camera, recorded, recording)?);
        }
        let unseen = leave_out_unseen_cameras(&mut rig, &mut intrinsics, recording);
        for name in &recording.features {
            if !rig.features.iter().any(|feature| feature.name == *name) {
                rig.features.push(Feature { name: name.clone(), parent: Parent::Tip, xyz: None });
            }
        }
        check_held(&rig)?;
        let model = placeholder_model(&rig);
        let index = Correspondence::new(&rig, recording);
        let (samples, states) = States::new(&rig, recording)?;
        let mut observations = Vec::new();
        for (state, &number) in samples.iter().enumerate() {
            for detection in &recording.samples[number].pixels {
                let camera = index.cameras[detection.camera as usize];
                let feature = index.features[detection.feature as usize];
                let (Some(camera), Some(feature)) = (camera, feature) else { continue };
                observations.push(Observation { sample: state, camera, feature, pixel: detection.pixel });
            }
        }
        if observations.is_empty() {
            return Err(Error::NotEnoughData("no sample has a detected feature".into()));
        }
        Ok(Setup { rig, model, intrinsics, states, samples, observations, unseen })
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

    /// Standard deviation of a pixel coordinate [px].
    pub fn sigma(&self) -> f64 {
        self.rig.noise.pixels.max(1e-3)
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

/// Fills in what the header says, and guesses the rest.
fn complete_camera(
    camera: &mut Camera,
    recorded: Option<&RecordedCamera>,
    recording: &Recording,
) -> Result<KnownIntrinsics, Error> {
    let header = recorded.cloned().unwrap_or_default();
    if recorded.is_some() {
        camera.size = camera.size.or(header.size);
        camera.model = camera.model.or(header.model);
        let same_model = camera.model == header.model || header.model.is_none();
        camera.fx = camera.fx.or(header.fx);
        camera.fy = camera.fy.or(header.fy);
        camera.cx = camera.cx.or(header.cx);
        camera.cy = camera.cy.or(header.cy);
        if same_model && camera.distortion.is_none() {
            camera.distortion = header.distortion;
        }
    }
    let known = KnownIntrinsics {
        focal: camera.fx.is_some() && camera.fy.is_some(),
        centre: camera.cx.is_some() && camera.cy.is_some(),
        distortion: camera.distortion.is_some(),
    };
    let model = camera.model.unwrap_or_default();
    camera.model = Some(model);
    let coefficients = camera.distortion.get_or_insert_default();
    if coefficients.len() > model.distortion().len() {
        return Err(Error::Unusable(format!(
            "camera `{}` has {} distortion coefficients, its model `{}` takes {}",
            camera.name,
            coefficients.len(),
            model.name(),
            model.distortion().len()
        )));
    }
    coefficients.resize(model.distortion().len(), 0.0);
    let [width, height] = match camera.size {
        Some(size) => size.map(f64::from),
        None if known.focal && known.centre => [2.0 * camera.cx.unwrap_or(0.0), 2.0 * camera.cy.unwrap_or(0.0)],
        None => seen_size(camera, recording).ok_or_else(|| {
            Error::Unusable(format!("camera `{}` has neither a size nor intrinsics nor detections", camera.name))
        })?,
    };
    let focal = FOCAL_GUESS * width.max(height);
    camera.fx = Some(camera.fx.or(camera.fy).unwrap_or(focal));
    camera.fy = Some(camera.fy.or(camera.fx).unwrap_or(focal));
    camera.cx = Some(camera.cx.unwrap_or(0.5 * (width - 1.0)));
    camera.cy = Some(camera.cy.unwrap_or(0.5 * (height - 1.0)));
    Ok(known)
}

/// Takes out cameras that nothing could place, and returns their names.
fn leave_out_unseen_cameras(
    rig: &mut Rig,
    intrinsics: &mut Vec<KnownIntrinsics>,
    recording: &Recording,
) -> Vec<String> {
    let seen = recording.samples.iter().flat_map(|sample| &sample.pixels);
    let seeing: BTreeSet<&str> = seen.map(|seen| recording.cameras[seen.camera as usize].name.as_str()).collect();
    let unseen = |camera: &Camera| camera.pose.is_none() && !seeing.contains(camera.name.as_str());
    let names = rig.cameras.iter().filter(|camera| unseen(camera)).map(|camera| camera.name.clone()).collect();
    let mut stays = rig.cameras.iter().map(|camera| !unseen(camera)).collect::<Vec<_>>().into_iter();
    intrinsics.retain(|_| stays.next().unwrap_or(true));
    rig.cameras.retain(|camera| !unseen(camera));
    names
}

/// Size of the smallest image that holds all detections, where nobody gives one.
fn seen_size(camera: &Camera, recording: &Recording) -> Option<[f64; 2]> {
    let index = recording.cameras.iter().position(|recorded| recorded.name == camera.name)? as u32;
    let seen = recording.samples.iter().flat_map(|sample| &sample.pixels).filter(|seen| seen.camera == index);
    seen.map(|seen| seen.pixel)
        .reduce(|a, b| [a[0].max(b[0]), a[1].max(b[1])])
        .map(|most| most.map(|x| x.max(1.0) + 1.0))
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
