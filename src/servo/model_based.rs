//! The paper's controller: infer the present and the target joints, command the difference, repeat.
use super::tasks::JointTarget;
use super::{Arm, Configuration, Goal, Limit, Step, Stepper};
use crate::Error;
use crate::infer::{Branch, InferOptions, Inference, Prior, Sighting};
use crate::rig::Rig;

/// Servoing with a learned rig: for robots that take joint motions, whose joints may be unobserved.
///
/// Where the joints are is inferred from what is seen now, and where they shall be from what shall be seen; both are of one rig, so
/// what it is off by mostly cancels. The command is their difference, made to obey limits by a [`Stepper`].
pub struct ModelBased {
    arm: Arm,
    inference: Inference,
    stepper: Stepper,
    at: Configuration,
    target: JointTarget,
    goal: Vec<Sighting>,
}

/// A branch this much less probable than the best does not explain the pixels.
const IMPROBABLE: f64 = 0.05;

/// A branch up to this many times as far away as the nearest is as near.
const AS_NEAR: f64 = 2.0;

impl ModelBased {
    /// With a complete rig.
    ///
    /// Errors: [`Error::Unusable`] with the paths of what is missing, or where there is no joint.
    pub fn new(rig: &Rig) -> Result<Self, Error> {
        Ok(ModelBased {
            arm: Arm::new(rig)?,
            inference: Inference::new(rig, InferOptions::default())?,
            stepper: Stepper::new(0.0),
            at: Configuration::default(),
            target: JointTarget { joints: Vec::new(), sd: 1.0 },
            goal: Vec::new(),
        })
    }

    /// Sets where the features shall be seen; some cameras and features suffice. May change between steps.
    pub fn aim(&mut self, goal: &[Sighting]) {
        self.goal.clear();
        self.goal.extend_from_slice(goal);
        self.target.joints.clear();
    }

    /// The motion of the next `dt` seconds, from what is seen now. `near`: where the joints are expected, such as noisy readings or
    /// where the last command should have led [rad or m]; it chooses among branches and says nothing else.
    ///
    /// Errors: [`Error::NotEnoughData`] where the pixels seen or aimed at lead to no joints; [`Error::Unusable`] where `near` is not of
    /// the rig.
    pub fn step(&mut self, seen: &[Sighting], near: &[f64], limits: &[&dyn Limit], dt: f64) -> Result<&Step, Error> {
        let now = self.nearest(seen, near)?;
        if self.target.joints.is_empty() {
            let goal = std::mem::take(&mut self.goal);
            let found = self.nearest(&goal, &now.joints);
            self.goal = goal;
            self.target.joints = found?.joints;
        }
        self.arm.configure(&now.joints, &mut self.at);
        let goals = [Goal { task: &self.target, priority: 0 }];
        let step = self.stepper.step(&self.arm, &self.at, &goals, limits, dt);
        for (velocity, motion) in self.at.velocity.iter_mut().zip(&step.motion) {
            *velocity = motion / dt;
        }
        Ok(step)
    }

    /// Joints that were inferred last [rad or m]; empty before the first step.
    pub fn joints(&self) -> &[f64] {
        &self.at.joints
    }

    /// Joints aimed at [rad or m]; empty before the first step towards them.
    pub fn target(&self) -> &[f64] {
        &self.target.joints
    }

    /// Of the branches that may explain the pixels and are near some joints, the one that explains them best.
    fn nearest(&mut self, seen: &[Sighting], near: &[f64]) -> Result<Branch, Error> {
        let away = |branch: &Branch| -> f64 {
            branch.joints.iter().zip(near).map(|(joint, near)| (joint - near).powi(2)).sum()
        };
        let all = self.inference.joints(seen, &Prior::start(near))?;
        let most = all.iter().map(|branch| branch.probability).fold(0.0, f64::max);
        let explains = |branch: &Branch| branch.probability >= IMPROBABLE * most;
        let nearest = all.iter().filter(|branch| explains(branch)).map(away).fold(f64::INFINITY, f64::min);
        let as_near = |branch: &Branch| explains(branch) && away(branch) <= AS_NEAR * AS_NEAR * nearest;
        let found = all.into_iter().filter(as_near).min_by(|a, b| a.rms_px.total_cmp(&b.rms_px));
        found.ok_or_else(|| Error::NotEnoughData("no joints explain what was seen".to_owned()))
    }
}
