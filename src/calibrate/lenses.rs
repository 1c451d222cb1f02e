//! Whether lenses that were given came out of a calibration as they were: what tells whether to hold them.
use super::cameras::with_headers;
use super::report::Calibration;
use crate::recording::Recording;
use crate::rig::{CameraField, Parameter, Rig};

/// Beyond so many standard deviations a number is not what was given.
const ELSEWHERE: f64 = 3.0;

/// A number of a lens as it was given and as it was learned.
#[derive(Clone, Debug, PartialEq)]
pub struct LensNumber {
    /// The camera's name.
    pub camera: String,
    /// Its key in a rig file, such as "fx".
    pub number: &'static str,
    /// What the rig or the recording's header said [px].
    pub given: f64,
    /// What was learned [px].
    pub learned: f64,
    /// Standard deviations of what was learned between the two.
    pub deviations: f64,
}

/// Of every camera whose focal lengths and image centre were given and learned all the same, the one that came out furthest from what was given.
pub fn lenses_against_given(before: &Rig, recording: &Recording, calibration: &Calibration) -> Vec<LensNumber> {
    let (given, learned) = (with_headers(before, recording), &calibration.rig);
    let of_camera = |camera: &crate::rig::Camera| {
        let was = given.cameras.iter().find(|given| given.name == camera.name)?;
        let index = learned.cameras.iter().position(|learned| learned.name == camera.name)?;
        let number = |field: CameraField, given: Option<f64>, learned_is: Option<f64>| {
            let path = Parameter::CameraField { camera: index, field }.path(learned);
            let sd = *learned.fit.as_ref()?.sd.get(&path)?.first()?;
            let (given, learned) = given.zip(learned_is)?;
            let deviations = (learned - given).abs() / sd;
            let (camera, number) = (camera.name.clone(), field.name());
            deviations.is_finite().then_some(LensNumber { camera, number, given, learned, deviations })
        };
        let all = [
            number(CameraField::Fx, was.fx, camera.fx),
            number(CameraField::Fy, was.fy, camera.fy),
            number(CameraField::Cx, was.cx, camera.cx),
            number(CameraField::Cy, was.cy, camera.cy),
        ];
        all.into_iter().flatten().max_by(|one, other| one.deviations.total_cmp(&other.deviations))
    };
    learned.cameras.iter().filter_map(of_camera).collect()
}

/// The same in words: one line where all came out as given, and one for each that did not.
pub fn lenses_in_words(before: &Rig, recording: &Recording, calibration: &Calibration) -> Vec<String> {
    let all = lenses_against_given(before, recording, calibration);
    let elsewhere: Vec<&LensNumber> = all.iter().filter(|lens| lens.deviations > ELSEWHERE).collect();
    let furthest = all.iter().max_by(|one, other| one.deviations.total_cmp(&other.deviations));
    if let (true, Some(furthest)) = (elsewhere.is_empty(), furthest) {
        return vec![format!(
            "lenses came out as they were given (the furthest: {furthest}): held, with `--hold 'cameras.*.intrinsics'`, they leave less to learn"
        )];
    }
    let line = |lens: &&LensNumber| {
        format!(
            "the lens of camera `{}` did not come out as it was given: {lens}; it was calibrated for another resolution or focus, or what else was \
             given is wrong",
            lens.camera
        )
    };
    elsewhere.iter().map(line).collect()
}

impl std::fmt::Display for LensNumber {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let LensNumber { camera, number, given, learned, deviations } = self;
        write!(f, "{number} of `{camera}` is {learned:.1} px for {given:.1} px, {deviations:.1} standard deviations")
    }
}
