//! How far a learned rig may be off in what it predicts: for the margins of limits.
use super::{Arm, Configuration};
use crate::Error;
use crate::infer::Sighting;
use crate::rig::{CameraField, JointField, Parameter, Rig};
use handeye_solvers::Pose;
use handeye_solvers::manifold::so3;
use nalgebra::Vector3;

/// Bounds of the standard deviations of pixels and tips that a learned rig predicts, from those of its numbers, `[fit.sd]`.
///
///   sd(f) ≤ Σ |f(θ + sd_k e_k) - f(θ - sd_k e_k)| / 2   over all numbers θ_k that were learned
///
/// which holds however the numbers' errors are correlated. `[fit.sd]` leaves correlations out, and numbers that were learned together
/// mostly make up for each other: a random rig learned from 50 samples of 6 features is bounded to 8 px in the median and off by 0.06 px.
/// What only a prior determines (a world frame that nothing fixes) counts with all of the prior. It is for where a margin must not be too
/// small: k sd suits [`super::limits::InImage`] in pixels, and [`super::limits::HalfSpace`], [`super::limits::TipBox`] and
/// [`super::limits::LinkDistance`] in metres.
#[derive(Clone)]
pub struct PredictionBounds {
    arm: Arm,
    /// Both ways by one standard deviation, for every number.
    moved: Vec<[Arm; 2]>,
}

impl PredictionBounds {
    /// Of a rig that was learned.
    ///
    /// Errors: [`Error::Unusable`] where the rig is not complete, or says nothing of its standard deviations.
    pub fn new(rig: &Rig) -> Result<Self, Error> {
        let arm = Arm::new(rig)?;
        let Some(fit) = rig.fit.as_ref().filter(|fit| !fit.sd.is_empty()) else {
            return Err(Error::Unusable(
                "the rig has no standard deviations (`[fit.sd]`): a rig that `calibrate` has learned has them"
                    .to_owned(),
            ));
        };
        let mut moved = Vec::new();
        for parameter in rig.parameters() {
            for (number, &sd) in fit.sd.get(&parameter.path(rig)).into_iter().flatten().enumerate() {
                let by = |step: f64| {
                    let mut rig = rig.clone();
                    shift(&mut rig, parameter, number, step);
                    Arm::new(&rig)
                };
                moved.push([by(sd)?, by(-sd)?]);
            }
        }
        Ok(PredictionBounds { arm, moved })
    }

    /// Of a predicted pixel [px], the larger of u and v; `None` where camera or feature are not of the rig. `joints`: one reading per
    /// joint [rad or m].
    pub fn pixel(&self, joints: &[f64], camera: usize, feature: usize) -> Option<f64> {
        let mut at = Configuration::default();
        let mut pixel = |arm: &Arm| {
            arm.configure(joints, &mut at);
            arm.pixel(&at, camera, feature)
        };
        pixel(&self.arm)?;
        let mut sums = [0.0; 2];
        for [up, down] in &self.moved {
            let (up, down) = (pixel(up)?, pixel(down)?);
            (0..2).for_each(|k| sums[k] += 0.5 * (up[k] - down[k]).abs());
        }
        Some(sums[0].max(sums[1]))
    }

    /// By how much each learned number, off by its standard deviation, changes the slopes of pixels by the joints, two rows per sighting.
    pub(super) fn slopes(&self, joints: &[f64], sightings: &[Sighting]) -> Vec<Vec<f64>> {
        let mut at = Configuration::default();
        let mut slopes = |arm: &Arm| {
            arm.configure(joints, &mut at);
            let sights = sightings.iter().filter_map(|sighting| arm.sight(&at, sighting));
            sights.flat_map(|sight| sight.slopes(0).chain(sight.slopes(1)).collect::<Vec<f64>>()).collect::<Vec<f64>>()
        };
        let change =
            |[up, down]: &[Arm; 2]| slopes(up).iter().zip(slopes(down)).map(|(up, down)| 0.5 * (up - down)).collect();
        self.moved.iter().map(change).collect()
    }

    /// Of the tip's position [m], along whichever direction. `joints`: one reading per joint [rad or m].
    pub fn tip(&self, joints: &[f64]) -> f64 {
        let mut at = Configuration::default();
        let mut tip = |arm: &Arm| {
            arm.configure(joints, &mut at);
            at.posture.tip().translation
        };
        self.moved.iter().map(|[up, down]| 0.5 * (tip(up) - tip(down)).norm()).sum()
    }
}

/// Moves one number of a parameter, as its standard deviations count them.
fn shift(rig: &mut Rig, parameter: Parameter, number: usize, step: f64) {
    let add = |value: &mut Option<f64>| *value = Some(value.unwrap_or(0.0) + step);
    match parameter {
        Parameter::Base => {
            rig.robot.base = rig.robot.base.or(Some(Pose::identity())).map(|base| turned(base, number, step))
        }
        Parameter::JointField { joint, field } => {
            let joint = &mut rig.robot.joints[joint];
            add(match field {
                JointField::Offset => &mut joint.offset,
                JointField::D => &mut joint.d,
                JointField::A => &mut joint.a,
                JointField::Alpha => &mut joint.alpha,
                JointField::Beta => &mut joint.beta,
            });
        }
        Parameter::CameraPose(camera) => {
            let pose = &mut rig.cameras[camera].pose;
            *pose = pose.map(|pose| turned(pose, number, step));
        }
        Parameter::CameraField { camera, field } => {
            let camera = &mut rig.cameras[camera];
            match field {
                CameraField::Fx => add(&mut camera.fx),
                CameraField::Fy => add(&mut camera.fy),
                CameraField::Cx => add(&mut camera.cx),
                CameraField::Cy => add(&mut camera.cy),
                CameraField::Distortion => {
                    let coefficient = camera.distortion.as_mut().and_then(|list| list.get_mut(number));
                    coefficient.into_iter().for_each(|coefficient| *coefficient += step);
                }
            }
        }
        Parameter::FeatureXyz(feature) => {
            let coordinate = rig.features[feature].xyz.as_mut().and_then(|xyz| xyz.get_mut(number));
            coordinate.into_iter().for_each(|coordinate| *coordinate += step);
        }
        // No pixel and no tip depends on it.
        Parameter::TargetPose(_) => {}
    }
}

/// A pose moved along an axis of its parent (0 to 2), or turned about one (3 to 5).
fn turned(pose: Pose, number: usize, step: f64) -> Pose {
    let along = Vector3::ith(number % 3, step);
    if number < 3 {
        Pose { translation: pose.translation + along, ..pose }
    } else {
        Pose { rotation: so3::exp(&along) * pose.rotation, ..pose }
    }
}
