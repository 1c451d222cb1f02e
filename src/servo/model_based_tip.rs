//! The paper's controller for robots that move their tip, whose joints nobody knows: infer where the tip is and where it shall be,
//! command the motion between.
use super::{Controller, Decision, Limit, Measurement, Takes};
use crate::Error;
use crate::infer::{InferredPose, Sighting, TipInference};
use crate::recording::Command;
use crate::rig::Rig;
use handeye_solvers::Pose;
use handeye_solvers::manifold::so3;

/// Servoing with a rig that may have no chain, such as one learned from pose actions (eqs. 12 and 13 of the paper). Limits are those of
/// the tip's own speed; others need a chain.
pub struct ModelBasedTip {
    /// What the robot takes: [`Takes::PoseVelocity`], or else motions.
    pub takes: Takes,
    /// Largest speed of the tip's origin [m/s] and of its turning [rad/s]; infinite where there is none.
    pub speed: [f64; 2],
    inference: TipInference,
    goal: Vec<Sighting>,
    target: Option<Pose>,
    /// Where the last command should have led.
    expected: Option<Pose>,
}

impl ModelBasedTip {
    /// With a complete rig.
    ///
    /// Errors: [`Error::Unusable`] with the paths of what is missing.
    pub fn new(rig: &Rig) -> Result<Self, Error> {
        Ok(ModelBasedTip {
            takes: Takes::PoseDelta,
            speed: [f64::INFINITY; 2],
            inference: TipInference::new(rig)?,
            goal: Vec::new(),
            target: None,
            expected: None,
        })
    }

    /// Of the poses that explain pixels, the most probable, or the one nearest to where the tip is expected of those as probable.
    fn pose(&self, seen: &[Sighting], near: Option<&Pose>, what: &str) -> Result<Pose, Error> {
        let poses = self.inference.poses(seen);
        let most = poses.first().map_or(0.0, |pose| pose.probability);
        let plausible = poses.into_iter().filter(|pose| pose.probability >= PLAUSIBLE * most);
        let away = |pose: &InferredPose| near.map_or(0.0, |near| pose.pose.angle_to(near));
        let nearest = plausible.min_by(|a, b| away(a).total_cmp(&away(b)));
        nearest
            .map(|found| found.pose)
            .ok_or_else(|| Error::NotEnoughData(format!("the pixels {what} leave the tip's pose open")))
    }
}

/// A pose that is less probable by this factor than the most probable is not taken for being near.
const PLAUSIBLE: f64 = 0.05;

impl Controller for ModelBasedTip {
    fn aim(&mut self, goal: &[Sighting]) {
        self.goal.clear();
        self.goal.extend_from_slice(goal);
        self.target = None;
    }

    fn decide(&mut self, now: &Measurement<'_>, limits: &[&dyn Limit], dt: f64) -> Result<Decision, Error> {
        if !limits.is_empty() {
            return Err(Error::Unusable("limits need the chain of the arm, and this controller knows none".to_owned()));
        }
        let tip = self.pose(now.seen, self.expected.as_ref(), "seen")?;
        let target = match self.target {
            Some(target) => target,
            None => *self.target.insert(self.pose(&self.goal, Some(&tip), "aimed at")?),
        };
        let turn = so3::log(&(target.rotation * tip.rotation.transpose()));
        let shift = target.translation - tip.translation;
        // The same share of both, so that the tip moves straight.
        let share = (self.speed[0] * dt / shift.norm()).min(self.speed[1] * dt / turn.norm()).clamp(0.0, 1.0);
        let (turn, shift) = (turn * share, shift * share);
        let after = Pose { rotation: so3::exp(&turn) * tip.rotation, translation: tip.translation + shift };
        self.expected = Some(after);
        let command = if self.takes == Takes::PoseVelocity {
            let (w, v) = (turn / dt, shift / dt);
            Command::PoseVelocity([w.x, w.y, w.z, v.x, v.y, v.z])
        } else {
            Command::PoseDelta(after * tip.inverse())
        };
        Ok(Decision::free(command))
    }
}
