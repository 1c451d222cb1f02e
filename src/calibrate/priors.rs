//! What is known before anything is learned, as standard deviations around given values.
use super::cameras::{KnownIntrinsics, with_headers};
use super::deviations::{coordinate_of, intrinsics_of};
use super::graph::{Priors, row};
use super::setup::Setup;
use crate::recording::Recording;
use crate::rig::{CameraField, JointField, Parameter, Parent, Rig, matches};
use std::collections::BTreeSet;

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
            let known = match parameter {
                Parameter::CameraField { camera, .. } => setup.intrinsics[camera],
                // A prior, stated or not, needs a value to be around; intrinsics always have one.
                _ if !rig.has_value(&parameter) => continue,
                _ => KNOWN,
            };
            let sds = sds(rig, &parameter, known);
            let [sd, ..] = sds[..] else { continue };
            match parameter {
                Parameter::Base => priors.base = rotation_first(&sds),
                Parameter::JointField { joint, field } => priors.parameters[row(joint) + coordinate_of(field)] = sd,
                Parameter::CameraPose(camera) if !floats(rig.cameras[camera].parent) => {
                    priors.cameras[camera] = rotation_first(&sds);
                }
                Parameter::CameraField { camera, field } => {
                    let coefficients = model.cameras[camera].intrinsics.len() - 4;
                    priors.intrinsics[camera][intrinsics_of(field, coefficients)].fill(sd);
                }
                Parameter::FeatureXyz(feature) if !floats(rig.features[feature].parent) => {
                    priors.features[feature] = [sd; 3];
                }
                Parameter::CameraPose(_) | Parameter::FeatureXyz(_) | Parameter::TargetPose(_) => {}
            }
        }
        priors
    }
}

/// What is assumed of the values that a rig and a recording's header give, in words: how far off they may be, by default or as `[estimate.prior]` of
/// the rig says.
pub fn assumptions(rig: &Rig, recording: &Recording) -> Vec<String> {
    let rig = &with_headers(rig, recording);
    let mm = |length: f64| format!("±{:.0} mm", 1e3 * length);
    let share = |share: f64| format!("±{:.0} %", 1e2 * share);
    // What they are called, one by one, with the default.
    let mut kinds = [
        ("pose of the base", format!("{} and ±{ANGLE} rad", mm(LENGTH)), 0),
        ("lengths of joints", mm(LENGTH), 0),
        ("angles of joints", format!("±{ANGLE} rad"), 0),
        ("poses of cameras", format!("{} and ±{CAMERA_ANGLE} rad", mm(CAMERA_LENGTH)), 0),
        ("focal lengths", share(FOCAL), 0),
        ("coordinates of image centres", format!("{} of the image", share(CENTRE)), 0),
        ("distortions of lenses", format!("±{DISTORTION} a coefficient"), 0),
        ("places of features", mm(LENGTH), 0),
        ("focal lengths that are guessed", share(GUESSED_FOCAL), 0),
        ("coordinates of image centres that are guessed", format!("{} of the image", share(GUESSED_CENTRE)), 0),
    ];
    for parameter in rig.parameters() {
        let is_given = rig.has_value(&parameter);
        let kind = match parameter {
            Parameter::CameraField { field: CameraField::Fx | CameraField::Fy, .. } if !is_given => 8,
            Parameter::CameraField { field: CameraField::Cx | CameraField::Cy, .. } if !is_given => 9,
            _ if !is_given => continue,
            Parameter::Base => 0,
            Parameter::JointField { field: JointField::D | JointField::A, .. } => 1,
            Parameter::JointField { .. } => 2,
            Parameter::CameraPose(_) => 3,
            Parameter::CameraField { field: CameraField::Fx | CameraField::Fy, .. } => 4,
            Parameter::CameraField { field: CameraField::Cx | CameraField::Cy, .. } => 5,
            Parameter::CameraField { .. } => 6,
            Parameter::FeatureXyz(_) => 7,
            Parameter::TargetPose(_) => continue,
        };
        let is_assumed = !rig.is_fixed(&parameter) && rig.prior_sd(&parameter).is_none();
        kinds[kind].2 += usize::from(is_assumed);
    }
    let defaults = kinds.into_iter().filter(|(.., count)| *count > 0).map(|(what, sd, count)| match what {
        "pose of the base" => format!("{sd} on the {what}"),
        _ => format!("{sd} on each of the {count} {what}"),
    });
    let stated =
        rig.estimate.prior.iter().map(|(path, sd)| format!("±{sd}{} on {path} as the rig states", units(rig, path)));
    defaults.chain(stated).collect()
}

/// The units of what a path covers, such as " m and rad"; nothing where it has none.
fn units(rig: &Rig, pattern: &str) -> String {
    let unit = |parameter: &Parameter| -> &[&str] {
        match parameter {
            Parameter::Base | Parameter::CameraPose(_) | Parameter::TargetPose(_) => &["m", "rad"],
            Parameter::JointField { field: JointField::D | JointField::A, .. } | Parameter::FeatureXyz(_) => &["m"],
            Parameter::JointField { .. } => &["rad"],
            Parameter::CameraField { field: CameraField::Distortion, .. } => &[],
            Parameter::CameraField { .. } => &["px"],
        }
    };
    let covered = rig.parameters().into_iter().filter(|parameter| matches(pattern, &parameter.path(rig)));
    let units: BTreeSet<&str> = covered.flat_map(|parameter| unit(&parameter).to_vec()).collect();
    let words = units.into_iter().collect::<Vec<_>>().join(" and ");
    if words.is_empty() { words } else { format!(" {words}") }
}

/// The standard deviations of the prior around a parameter that has a value in a rig, number by number in the order of `[fit.sd]`; `None` where
/// it has none. A lens is taken as the rig has it, so that one from a recording's header has to be filled in.
pub(crate) fn prior_sds(rig: &Rig, parameter: &Parameter) -> Option<Vec<f64>> {
    rig.has_value(parameter).then(|| sds(rig, parameter, KNOWN)).filter(|sds| !sds.is_empty())
}

/// Of intrinsics that somebody gave.
const KNOWN: KnownIntrinsics = KnownIntrinsics { focal: true, centre: true, distortion: true, unused: false };

/// The same around whatever value there is; of intrinsics as they are known. Of a target, nothing is said.
fn sds(rig: &Rig, parameter: &Parameter, known: KnownIntrinsics) -> Vec<f64> {
    let sd = |default: f64| rig.prior_sd(parameter).unwrap_or(default);
    let pose = |length: f64, angle: f64| [[sd(length); 3], [sd(angle); 3]].concat();
    match *parameter {
        Parameter::Base => pose(LENGTH, ANGLE),
        Parameter::JointField { field: JointField::D | JointField::A, .. } => vec![sd(LENGTH)],
        Parameter::JointField { .. } => vec![sd(ANGLE)],
        Parameter::CameraPose(_) => pose(CAMERA_LENGTH, CAMERA_ANGLE),
        Parameter::FeatureXyz(_) => vec![sd(LENGTH); 3],
        Parameter::CameraField { camera, field } => {
            let camera = &rig.cameras[camera];
            let focal = if known.focal { FOCAL } else { GUESSED_FOCAL };
            let centre = if known.centre { CENTRE } else { GUESSED_CENTRE };
            let distortion = if known.distortion { DISTORTION } else { GUESSED_DISTORTION };
            let twice_centre = 2.0 * camera.cx.unwrap_or(0.0).max(camera.cy.unwrap_or(0.0));
            let side = camera.size.map_or(twice_centre, |[w, h]| f64::from(w.max(h)));
            match field {
                CameraField::Fx => vec![sd(focal * camera.fx.unwrap_or(0.0))],
                CameraField::Fy => vec![sd(focal * camera.fy.unwrap_or(0.0))],
                CameraField::Cx | CameraField::Cy => vec![sd(centre * side)],
                CameraField::Distortion => vec![sd(distortion); camera.distortion.as_ref().map_or(1, Vec::len)],
            }
        }
        Parameter::TargetPose(_) => Vec::new(),
    }
}

/// Of a pose as [`Priors`] has it.
fn rotation_first(sds: &[f64]) -> [f64; 6] {
    std::array::from_fn(|index| sds[(index + 3) % 6])
}
