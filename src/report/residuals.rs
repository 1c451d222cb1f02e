//! Predicted minus seen, detection by detection.
use crate::Error;
use crate::calibrate::{Correspondence, Placed};
use crate::infer::{InferOptions, Inference, Names, Prior, Sightings, TipInference};
use crate::recording::{Recording, Sample};
use crate::rig::{Model, Rig};

/// How far a detection is from what a rig predicts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Residual {
    /// Index of the sample in the recording.
    pub sample: usize,
    /// Index of the camera in the rig.
    pub camera: usize,
    /// Index of the feature in the rig.
    pub feature: usize,
    /// Where it was seen [px].
    pub seen: [f64; 2],
    /// Predicted minus seen [px].
    pub error: [f64; 2],
}

impl Residual {
    /// Its length [px].
    pub fn distance(&self) -> f64 {
        self.error[0].hypot(self.error[1])
    }
}

/// Of every pixel whose camera and feature the rig knows and whose sample's state is read, or determined by what was seen. Readings that
/// are noisy are refined by it first, as they were when the rig was learned.
///
/// Errors: [`Error::Unusable`] where the rig is not complete or has another number of joints.
pub fn residuals(rig: &Rig, recording: &Recording) -> Result<Vec<Residual>, Error> {
    of_states(rig, recording, States::new(rig, recording)?)
}

/// Those of predictions from states as they were read, as [`crate::calibrate::evaluate()`] has them: nothing is refined by what was seen.
///
/// Errors: as [`residuals`].
pub(super) fn of_predictions(rig: &Rig, recording: &Recording) -> Result<Vec<Residual>, Error> {
    of_states(rig, recording, States { is_read: true, ..States::new(rig, recording)? })
}

fn of_states(rig: &Rig, recording: &Recording, mut states: States) -> Result<Vec<Residual>, Error> {
    let model = Model::new(rig)?;
    let index = Correspondence::new(rig, recording);
    let mut residuals = Vec::new();
    for (number, sample) in recording.samples.iter().enumerate() {
        let Some(placed) = states.links(&model, sample)? else { continue };
        for detection in &sample.pixels {
            let known = (index.cameras[detection.camera as usize], index.features[detection.feature as usize]);
            let (Some(camera), Some(feature)) = known else { continue };
            let on = [model.cameras[camera].parent, model.features[feature].parent];
            if !model.cameras[camera].has_lens() || !on.iter().all(|parent| placed.knows(&model, *parent)) {
                continue;
            }
            let [u, v] = model.pixel(camera, feature, &placed.links);
            let error = [u - detection.pixel[0], v - detection.pixel[1]];
            residuals.push(Residual { sample: number, camera, feature, seen: detection.pixel, error });
        }
    }
    Ok(residuals)
}

/// Where the links are in a sample.
struct States {
    names: Names,
    /// `None` for a rig without joints.
    joints: Option<Inference>,
    tip: TipInference,
    /// Standard deviations of readings.
    joint_sd: f64,
    is_pose_exact: bool,
    /// Whether readings are taken as they are, and nothing is inferred.
    is_read: bool,
}

impl States {
    fn new(rig: &Rig, recording: &Recording) -> Result<Self, Error> {
        let n = rig.robot.joints.len();
        let has_joints = recording.samples.iter().any(|sample| sample.joints.is_some());
        if has_joints && n != recording.joints.len() {
            return Err(Error::Unusable(format!("the rig has {n} joints, the recording {}", recording.joints.len())));
        }
        let joints = if n > 0 { Some(Inference::new(rig, InferOptions::default())?) } else { None };
        Ok(States {
            names: Names::new(rig, recording),
            joints,
            tip: TipInference::new(rig)?,
            joint_sd: rig.noise.joints,
            is_pose_exact: !rig.noise.pose.is_noisy(),
            is_read: false,
        })
    }

    /// `None` where nothing determines them.
    fn links(&mut self, model: &Model, sample: &Sample) -> Result<Option<Placed>, Error> {
        if self.is_read {
            return Ok(Placed::read(model, sample));
        }
        let (pixels, points) = (self.names.sightings(sample), self.names.points(sample));
        let seen = Sightings { pixels: &pixels, points: &points };
        if let (Some(inference), Some(read)) = (&mut self.joints, &sample.joints) {
            if self.joint_sd <= 0.0 {
                return Ok(Some(Placed::by_joints(model, read)));
            }
            let refined = inference.joints_near(seen, &Prior::readings(read, self.joint_sd));
            return Ok(refined.ok().map(|branch| Placed::by_joints(model, &branch.joints)));
        }
        // Where joints were not read, the tip's pose is all that pixels of features on it need.
        let exact = sample.pose.filter(|_| self.is_pose_exact);
        let tip = exact.or_else(|| Some(self.tip.poses(seen).into_iter().next()?.pose));
        Ok(tip.map(|tip| Placed::by_tip(model, tip)))
    }
}
