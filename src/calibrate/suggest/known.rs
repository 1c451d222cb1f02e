//! What was known before a rig was learned, and where its fit ended.
use super::super::graph::{Freedom, State, row};
use super::super::numbers::{Numbers, Part};
use super::super::outliers::Verdict;
use super::super::setup::Setup;
use crate::Error;
use crate::rig::{Camera, CameraField, Fit, JointField, Model, Parameter, Rig};
use std::collections::BTreeSet;

/// The rig without what it learned: names, limits, parents and models stay, and the values that `[estimate]` speaks of.
pub(super) fn held_alone(learned: &Rig) -> Rig {
    let mut known = Rig { fit: None, ..learned.clone() };
    for parameter in learned.parameters() {
        if !learned.is_fixed(&parameter) && learned.prior_sd(&parameter).is_none() {
            known.forget(&parameter);
        }
    }
    known
}

/// The state in which the fit ended, at the learned values.
pub(super) fn start(setup: &Setup, learned: &Rig) -> Result<State, Error> {
    let mut rig = setup.rig.clone();
    let names = |rig: &Rig| rig.robot.joints.iter().map(|joint| (joint.name.clone(), joint.kind)).collect::<Vec<_>>();
    if names(&rig) != names(learned) || rig.robot.convention != learned.robot.convention {
        return Err(Error::Unusable("the learned rig and what was known of it have other joints".into()));
    }
    rig.robot = learned.robot.clone();
    let lacks = |what: &str, name: &str| {
        Error::Unusable(format!(
            "the learned rig has no {what} `{name}`, which the recording has: it was learned from another one"
        ))
    };
    let moved = |what: &str, name: &str| {
        Error::Unusable(format!("{what} `{name}` of what was known is fixed to something else than in the learned rig"))
    };
    for camera in &mut rig.cameras {
        let found = learned.cameras.iter().find(|learned| learned.name == camera.name);
        let found = found.ok_or_else(|| lacks("camera", &camera.name))?;
        if found.parent != camera.parent {
            return Err(moved("camera", &camera.name));
        }
        *camera = found.clone();
    }
    for feature in &mut rig.features {
        let found = learned.features.iter().find(|learned| learned.name == feature.name);
        let found = found.ok_or_else(|| lacks("feature", &feature.name))?;
        if found.parent != feature.parent {
            return Err(moved("feature", &feature.name));
        }
        *feature = found.clone();
    }
    let mut state = State::new(setup);
    state.model = Model::new(&rig)?;
    Ok(state)
}

/// Leaves out cameras that the fit left out: neither placed beforehand nor learned, they saw too little or were found to have been moved.
pub(super) fn leave_out_unused(setup: &Setup, freedom: &mut Freedom, verdict: &mut Verdict, fit: &Fit) {
    let is_unused = |camera: &Camera| {
        let number = format!("cameras.{}.", camera.name);
        camera.pose.is_none() && !fit.sd.keys().any(|path| path.starts_with(&number))
    };
    for (index, _) in setup.rig.cameras.iter().enumerate().filter(|(_, camera)| is_unused(camera)) {
        freedom.cameras[index] = [true; 6];
        freedom.intrinsics[index] = [true; 12];
        let seen = setup.observations.iter().zip(&mut verdict.active).filter(|(seen, _)| seen.camera == index);
        seen.for_each(|(_, active)| *active = false);
    }
}

/// What is free now must be what was free when the rig was learned, which is what has a standard deviation. `is_given`: what was known is
/// a rig that the user named.
pub(super) fn check_freedom(setup: &Setup, freedom: &Freedom, fit: &Fit, is_given: bool) -> Result<(), Error> {
    if fit.sd.is_empty() {
        return Err(Error::NotEnoughData(
            "the rig has no standard deviations in [fit.sd]: what it was learned from leaves something open, which `gauge` names"
                .into(),
        ));
    }
    let path = |(part, k): (Part, usize)| {
        let parameter = match part {
            Part::Base => Parameter::Base,
            Part::Chain => Parameter::JointField { joint: k / row(1), field: JointField::ALL[k % row(1)] },
            Part::Camera(camera) => Parameter::CameraPose(camera),
            Part::Lens(camera) => Parameter::CameraField { camera, field: CameraField::ALL[k.min(4)] },
            Part::Feature(feature) => Parameter::FeatureXyz(feature),
        };
        parameter.path(&setup.rig)
    };
    let now: BTreeSet<String> = Numbers::new(freedom).iter().map(path).collect();
    let then: BTreeSet<String> = fit.sd.keys().cloned().collect();
    match now.symmetric_difference(&then).next() {
        None => Ok(()),
        Some(path) => {
            let problem = match (is_given, then.contains(path)) {
                (true, true) => {
                    "was learned, and is held in the given rig: that is not the rig that learning started from"
                }
                (true, false) => {
                    "is free in the given rig, and has no standard deviation in the learned one: either that is not the rig that learning \
                     started from, or it has moved since (`--relearn`, `monitor`); then calibrate all of it again"
                }
                (false, true) => {
                    "was free when the rig was learned, and is held where nothing is known beforehand: give the rig that calibration \
                     started from, as `--rig RIG`"
                }
                (false, false) => {
                    "has no standard deviation in the learned rig: it was held, and the rig that calibration started from, as `--rig RIG`, \
                     says so; or it has moved since (`--relearn`, `monitor`), and all of it is to be calibrated again"
                }
            };
            Err(Error::Unusable(format!("`{path}` {problem}")))
        }
    }
}
