//! The paper's controller: infer the present and the target joints, command the difference, repeat.
use super::tasks::{ImagePoints, JointTarget};
use super::{
    Active, Arm, Bound, Configuration, Constraint, Controller, Decision, Goal, Limit, Measurement, Step, Stepper, Takes,
};
use crate::Error;
use crate::infer::{Branch, InferOptions, Inference, Prior, Sighting};
use crate::rig::Rig;

/// Servoing with a learned rig: for robots that take joint motions, whose joints may be unobserved.
///
/// Where the joints are is inferred from what is seen now, and where they shall be from what shall be seen; both are of one rig, so
/// what it is off by mostly cancels. The command is their difference, made to obey limits by a [`Stepper`].
pub struct ModelBased {
    /// What the robot takes.
    pub takes: Takes,
    arm: Arm,
    inference: Inference,
    stepper: Stepper,
    at: Configuration,
    target: JointTarget,
    goal: Vec<Sighting>,
    /// Standard deviation of a pixel coordinate [px].
    sigma: f64,
    /// Where the last command should have led [rad or m]; empty before the first.
    expected: Vec<f64>,
    /// What keeps the target from the pixels that are aimed at.
    held: Vec<Active>,
}

/// A branch does not explain the pixels where they are e to this power less likely than by the best.
const UNLIKELY: f64 = 3.0;

/// A target whose pixels differ from those aimed at by more standard deviations is out of reach.
const REACHED: f64 = 5.0;

/// Branches whose pixels differ from the target's by less than this more than the best are as near [px].
const AS_NEAR: f64 = 1e-3;

impl ModelBased {
    /// With a complete rig.
    ///
    /// Errors: [`Error::Unusable`] with the paths of what is missing, or where there is no joint.
    pub fn new(rig: &Rig) -> Result<Self, Error> {
        Ok(ModelBased {
            takes: Takes::default(),
            arm: Arm::new(rig)?,
            inference: Inference::new(rig, InferOptions::default())?,
            stepper: Stepper::new(0.0),
            at: Configuration::default(),
            target: JointTarget { joints: Vec::new(), sd: 1.0 },
            goal: Vec::new(),
            sigma: rig.noise.pixels.max(AS_NEAR),
            expected: Vec::new(),
            held: Vec::new(),
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
            let found = match self.best(&goal, &now.joints) {
                // Out of reach: as near as the limits allow from here.
                Err(Error::NotEnoughData(_)) => self.inference.joints_near(&goal, &Prior::start(&now.joints)),
                found => found,
            };
            self.goal = goal;
            let found = found?;
            self.held = self.out_of_reach(&found);
            self.target.joints = found.joints;
        }
        self.arm.configure(&now.joints, &mut self.at);
        let goals = [Goal::new(&self.target)];
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

    /// The ends of joints that keep a target from the pixels aimed at; none where it comes as near as pixels are told.
    fn out_of_reach(&mut self, target: &Branch) -> Vec<Active> {
        if target.rms_px < REACHED * self.sigma {
            return Vec::new();
        }
        let mut at = Configuration::default();
        self.arm.configure(&target.joints, &mut at);
        let task = ImagePoints { targets: self.goal.clone(), seen: Vec::new(), sd: self.sigma };
        let mut active = self.stepper.step(&self.arm, &at, &[Goal::new(&task)], &[], 1.0).active.clone();
        active.retain(|active| matches!(active.constraint, Constraint::Joint { bound: Bound::Position, .. }));
        active
    }

    /// Of the branches that may explain the pixels, the one nearest to some joints.
    fn nearest(&mut self, seen: &[Sighting], near: &[f64]) -> Result<Branch, Error> {
        let plausible = self.plausible(seen, near)?;
        let nearest = plausible.into_iter().min_by(|a, b| away(a, near).total_cmp(&away(b, near)));
        nearest.ok_or_else(|| Error::NotEnoughData("no joints explain what was seen".to_owned()))
    }

    /// The branch that comes nearest to the pixels; of those that come as near, the one nearest to some joints.
    fn best(&mut self, aimed_at: &[Sighting], near: &[f64]) -> Result<Branch, Error> {
        let plausible = self.plausible(aimed_at, near)?;
        let least = plausible.iter().map(|branch| branch.rms_px).fold(f64::INFINITY, f64::min);
        let as_near = plausible.into_iter().filter(|branch| branch.rms_px <= least + AS_NEAR);
        let best = as_near.min_by(|a, b| away(a, near).total_cmp(&away(b, near)));
        best.ok_or_else(|| Error::NotEnoughData("no joints lead to the pixels that are aimed at".to_owned()))
    }

    fn plausible(&mut self, seen: &[Sighting], near: &[f64]) -> Result<Vec<Branch>, Error> {
        let mut all = self.inference.joints(seen, &Prior::start(near))?;
        // By the pixels alone: that more joints near by explain them as well, as at a singularity, does not make a branch better.
        let misfit = |branch: &Branch| 0.5 * seen.len() as f64 * (branch.rms_px / self.sigma).powi(2);
        let least = all.iter().map(misfit).fold(f64::INFINITY, f64::min);
        all.retain(|branch| misfit(branch) <= least + UNLIKELY);
        Ok(all)
    }
}

impl Controller for ModelBased {
    fn aim(&mut self, goal: &[Sighting]) {
        ModelBased::aim(self, goal);
    }

    /// Where there are no readings, the joints are expected where the last command should have led; before the first, the most probable
    /// branch is taken.
    fn decide(&mut self, now: &Measurement<'_>, limits: &[&dyn Limit], dt: f64) -> Result<Decision, Error> {
        let near = if now.joints.is_empty() { self.expected.clone() } else { now.joints.to_vec() };
        let step = self.step(now.seen, &near, limits, dt)?.clone();
        self.expected.clear();
        self.expected.extend(self.at.joints.iter().zip(&step.motion).map(|(joint, motion)| joint + motion));
        let mut decision = Decision::new(self.takes, &self.arm, &self.at, &step, dt);
        decision.active.extend_from_slice(&self.held);
        Ok(decision)
    }
}

/// Squared distance of a branch's joints from others.
fn away(branch: &Branch, near: &[f64]) -> f64 {
    branch.joints.iter().zip(near).map(|(joint, near)| (joint - near).powi(2)).sum()
}
