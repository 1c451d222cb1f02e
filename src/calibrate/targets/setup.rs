//! What is known and what was measured, side by side: who carries what, and what the robot read when a target was seen.
use super::moments::{Moment, Stream};
use crate::Error;
use crate::factors::TargetSeen;
use crate::recording::{Recording, TargetDetection};
use crate::rig::{Camera, Parent, Rig, Target};
use handeye_solvers::Pose;
use nalgebra::{Matrix3, Matrix6};
use std::collections::BTreeMap;

/// A calibration from targets before anything is estimated.
pub(super) struct Setup {
    /// The rig with every camera that saw a target and every target that was seen.
    pub rig: Rig,
    /// The samples with targets for which the robot's state is known.
    pub moments: Vec<Moment>,
    /// Every detection, moment by moment.
    pub views: Vec<View>,
    /// True where tips follow from joints.
    pub by_joints: bool,
    /// True where robot and cameras were recorded apart, so that the clock of the images may be ahead.
    pub apart: bool,
}

/// One target in one image; indices are those of [`Setup`].
#[derive(Clone, Copy)]
pub(super) struct View {
    pub moment: usize,
    pub camera: usize,
    pub target: usize,
    /// `camera_from_target` as reported.
    pub seen: Pose,
    /// What whitens its residual, where the detector says how good it is.
    pub whitening: Option<[[f64; 6]; 6]>,
    /// The view before of the same target by the same camera.
    pub before: Option<usize>,
}

/// W with WᵀW the inverse covariance of [`TargetSeen`](crate::factors::TargetSeen)'s residual, from that of a reported pose.
fn whitening(detection: &TargetDetection) -> Option<[[f64; 6]; 6]> {
    // The residual turns in the target's frame, and has the rotation first.
    let mut to_residual = Matrix6::zeros();
    to_residual.fixed_view_mut::<3, 3>(0, 3).copy_from(&detection.pose.rotation.transpose());
    to_residual.fixed_view_mut::<3, 3>(3, 0).copy_from(&Matrix3::identity());
    let covariance = to_residual * detection.covariance? * to_residual.transpose();
    let inverse = covariance.cholesky()?.l().try_inverse()?;
    Some(std::array::from_fn(|row| std::array::from_fn(|column| inverse[(row, column)])))
}

impl Setup {
    /// The factor of a view.
    pub fn seen(&self, index: usize) -> TargetSeen {
        let view = &self.views[index];
        TargetSeen { seen: view.seen, camera_stands: self.rig.cameras[view.camera].parent == Parent::World }
    }

    /// Puts rig and recording together, with the images' clock ahead by `offset` [s].
    pub fn new(rig: &Rig, recording: &Recording, offset: f64) -> Result<Setup, Error> {
        let mut rig = rig.clone();
        let stream = Stream::new(&rig, recording)?;
        let mut setup = Setup {
            by_joints: stream.by_joints,
            apart: stream.apart,
            moments: Vec::new(),
            views: Vec::new(),
            rig: Rig::default(),
        };
        let mut last = BTreeMap::<(usize, usize), usize>::new();
        for (index, sample) in recording.samples.iter().enumerate().filter(|(_, sample)| !sample.targets.is_empty()) {
            let Some(moment) = stream.moment(recording, index, offset) else { continue };
            for detection in &sample.targets {
                let camera = camera_index(&mut rig, recording, detection.camera as usize);
                let target = target_index(&mut rig, &detection.target, camera);
                let before = last.insert((camera, target), setup.views.len());
                setup.views.push(View {
                    moment: setup.moments.len(),
                    camera,
                    target,
                    seen: detection.pose,
                    whitening: whitening(detection),
                    before,
                });
            }
            setup.moments.push(moment);
        }
        if setup.moments.len() < 3 {
            return Err(Error::NotEnoughData(format!(
                "{} samples have both a target and the robot's joints or pose, and 3 are needed",
                setup.moments.len()
            )));
        }
        for camera in &rig.cameras {
            check_parent(&camera.name, camera.parent)?;
        }
        for target in &rig.targets {
            check_parent(&target.name, target.parent)?;
        }
        for view in &setup.views {
            let (camera, target) = (&rig.cameras[view.camera], &rig.targets[view.target]);
            if (camera.parent == Parent::World) == (target.parent == Parent::World) {
                return Err(Error::Unusable(format!(
                    "camera `{}` and target `{}` are both on the same side of the robot, so that no motion shows: fix one to the \
                     tip and the other to the world by their `parent`",
                    camera.name, target.name
                )));
            }
        }
        setup.rig = rig;
        Ok(setup)
    }
}

fn check_parent(name: &str, parent: Parent) -> Result<(), Error> {
    match parent {
        Parent::Link(_) => Err(Error::Unusable(format!(
            "`{name}` is on a link: from targets, cameras and targets are learned in the world or on the tip"
        ))),
        Parent::World | Parent::Tip => Ok(()),
    }
}

fn camera_index(rig: &mut Rig, recording: &Recording, recorded: usize) -> usize {
    let recorded = &recording.cameras[recorded];
    rig.cameras.iter().position(|camera| camera.name == recorded.name).unwrap_or_else(|| {
        let recorded = recorded.clone();
        rig.cameras.push(Camera {
            name: recorded.name,
            size: recorded.size,
            model: recorded.model,
            fx: recorded.fx,
            fy: recorded.fy,
            cx: recorded.cx,
            cy: recorded.cy,
            distortion: recorded.distortion,
            ..Camera::default()
        });
        rig.cameras.len() - 1
    })
}

/// A target that the rig does not list is on the other side of the robot from the camera that saw it first.
fn target_index(rig: &mut Rig, name: &str, camera: usize) -> usize {
    rig.targets.iter().position(|target| target.name == name).unwrap_or_else(|| {
        let parent = if rig.cameras[camera].parent == Parent::World { Parent::Tip } else { Parent::World };
        rig.targets.push(Target { name: name.to_owned(), parent, pose: None });
        rig.targets.len() - 1
    })
}
