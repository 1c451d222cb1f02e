//! What is known before anything is learned, as standard deviations around given values.
use super::deviations::coordinate_of;
use super::graph::{Priors, row};
use super::setup::Setup;
use crate::rig::{CameraField, JointField, Parameter, Parent, Rig};

/// Where a value is given and nothing is said of how well, it is weakly known: so far off a value from a data sheet or an
/// earlier calibration may well be.
const ANGLE: f64 = 0.02; // rad
const LENGTH: f64 = 0.01; // m
const CAMERA_ANGLE: f64 = 0.1; // rad
const CAMERA_LENGTH: f64 = 0.1; // m
const FOCAL: f64 = 0.03; // share of it
const CENTRE: f64 = 0.02; // share of the longer side of the image
const DISTORTION: f64 = 0.1;
/// The same where intrinsics are guessed.
const GUESSED_FOCAL: f64 = 0.5;
const GUESSED_CENTRE: f64 = 0.1;
const GUESSED_DISTORTION: f64 = 0.3;

impl Priors {
    /// Around the values of the setup's rig; infinite where a value is unknown.
    pub fn new(setup: &Setup) -> Priors {
        let (rig, model) = (&setup.rig, &setup.model);
        let mut priors = Priors {
            mean: model.clone(),
            base: [f64::INFINITY; 6],
            parameters: vec![f64::INFINITY; model.parameters.len()],
            cameras: vec![[f64::INFINITY; 6]; model.cameras.len()],
            intrinsics: vec![[f64::INFINITY; 12]; model.cameras.len()],
            features: vec![[f64::INFINITY; 3]; model.features.len()],
        };
        // Given places on the tip or a link mean nothing against the frames of an unknown chain; their distances do.
        let floats = |parent: Parent| parent != Parent::World && !setup.chain_is_known();
        for parameter in rig.parameters() {
            let stated = rig.prior_sd(&parameter);
            // A stated prior needs a value to be around; intrinsics always have one.
            let given = rig.has_value(&parameter);
            let sd = |default: f64| if given { stated.unwrap_or(default) } else { f64::INFINITY };
            match parameter {
                Parameter::Base => priors.base = pose(sd(ANGLE), sd(LENGTH)),
                Parameter::JointField { joint, field } => {
                    let is_length = matches!(field, JointField::D | JointField::A);
                    priors.parameters[row(joint) + coordinate_of(field)] = sd(if is_length { LENGTH } else { ANGLE });
                }
                Parameter::CameraPose(camera) if !floats(rig.cameras[camera].parent) => {
                    priors.cameras[camera] = pose(sd(CAMERA_ANGLE), sd(CAMERA_LENGTH));
                }
                Parameter::CameraField { camera, field } => {
                    let known = setup.intrinsics[camera];
                    let k = &model.cameras[camera].intrinsics;
                    let side = rig.cameras[camera].size.map_or(2.0 * k[2].max(k[3]), |[w, h]| f64::from(w.max(h)));
                    let focal = if known.focal { FOCAL } else { GUESSED_FOCAL };
                    let centre = if known.centre { CENTRE } else { GUESSED_CENTRE };
                    let distortion = if known.distortion { DISTORTION } else { GUESSED_DISTORTION };
                    let sigmas = &mut priors.intrinsics[camera];
                    match field {
                        CameraField::Fx => sigmas[0] = stated.unwrap_or(focal * k[0]),
                        CameraField::Fy => sigmas[1] = stated.unwrap_or(focal * k[1]),
                        CameraField::Cx => sigmas[2] = stated.unwrap_or(centre * side),
                        CameraField::Cy => sigmas[3] = stated.unwrap_or(centre * side),
                        CameraField::Distortion => sigmas[4..].fill(stated.unwrap_or(distortion)),
                    }
                }
                Parameter::FeatureXyz(feature) if !floats(rig.features[feature].parent) => {
                    priors.features[feature] = [sd(LENGTH); 3];
                }
                Parameter::CameraPose(_) | Parameter::FeatureXyz(_) | Parameter::TargetPose(_) => {}
            }
        }
        priors
    }
}

/// What is assumed of the values that a rig gives, in words: how far off they may be, by default or as its `[estimate.prior]` says.
pub fn assumptions(rig: &Rig) -> Vec<String> {
    let mut counts = [0; 4];
    for parameter in rig.parameters() {
        let is_assumed = rig.has_value(&parameter) && !rig.is_fixed(&parameter) && rig.prior_sd(&parameter).is_none();
        let kind = match parameter {
            Parameter::JointField { field: JointField::D | JointField::A, .. } => 0,
            Parameter::JointField { .. } => 1,
            Parameter::CameraPose(_) => 2,
            Parameter::FeatureXyz(_) => 3,
            Parameter::Base | Parameter::CameraField { .. } | Parameter::TargetPose(_) => continue,
        };
        counts[kind] += usize::from(is_assumed);
    }
    let mm = |length: f64| format!("±{:.0} mm", 1e3 * length);
    let sds = [
        (mm(LENGTH), "lengths of joints"),
        (format!("±{ANGLE} rad"), "angles of joints"),
        (format!("{} and ±{CAMERA_ANGLE} rad", mm(CAMERA_LENGTH)), "poses of cameras"),
        (mm(LENGTH), "places of features"),
    ];
    let defaults = sds.into_iter().zip(counts).filter(|(_, count)| *count > 0);
    let defaults = defaults.map(|((sd, what), count)| format!("{sd} on each of the {count} {what} that the rig gives"));
    let stated = rig.estimate.prior.iter().map(|(path, sd)| format!("±{sd} on {path} as the rig states"));
    defaults.chain(stated).collect()
}

/// The standard deviations of the prior around a parameter that has a value in a rig, number by number in the order of `[fit.sd]`; `None` where
/// it has none. A lens is taken as the rig has it, so that one from a recording's header has to be filled in.
pub(crate) fn prior_sds(rig: &Rig, parameter: &Parameter) -> Option<Vec<f64>> {
    if !rig.has_value(parameter) {
        return None;
    }
    let sd = |default: f64| rig.prior_sd(parameter).unwrap_or(default);
    let pose = |length: f64, angle: f64| [[sd(length); 3], [sd(angle); 3]].concat();
    Some(match *parameter {
        Parameter::Base => pose(LENGTH, ANGLE),
        Parameter::JointField { field: JointField::D | JointField::A, .. } => vec![sd(LENGTH)],
        Parameter::JointField { .. } => vec![sd(ANGLE)],
        Parameter::CameraPose(_) => pose(CAMERA_LENGTH, CAMERA_ANGLE),
        Parameter::FeatureXyz(_) => vec![sd(LENGTH); 3],
        Parameter::CameraField { camera, field } => {
            let camera = &rig.cameras[camera];
            match field {
                CameraField::Fx => vec![sd(FOCAL * camera.fx?)],
                CameraField::Fy => vec![sd(FOCAL * camera.fy?)],
                CameraField::Cx | CameraField::Cy => {
                    let side = camera.size.map_or(2.0 * camera.cx?.max(camera.cy?), |[w, h]| f64::from(w.max(h)));
                    vec![sd(CENTRE * side)]
                }
                CameraField::Distortion => vec![sd(DISTORTION); camera.distortion.as_ref()?.len()],
            }
        }
        Parameter::TargetPose(_) => return None,
    })
}

fn pose(angle: f64, length: f64) -> [f64; 6] {
    [angle, angle, angle, length, length, length]
}
