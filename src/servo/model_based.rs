//! The paper's controller: infer the present and the target joints, command the difference, repeat.
use super::known_arm::KnownArm;
use super::tasks::{ImagePoints, JointTarget};
use super::{
    Active, Bound, Configuration, Constraint, Controller, Decision, Goal, Limit, Measurement, Step, Stepper, Takes,
};
use crate::Error;
use crate::infer::{Branch, Sighting};
use crate::rig::Rig;

/// Servoing with a learned rig: for robots that take joint motions, whose joints may be unobserved.
///
/// Where the joints are is inferred from what is seen now, and where they shall be from what shall be seen; both are of one rig, so
/// what it is off by mostly cancels. The command is their difference, made to obey limits by a [`Stepper`].
pub struct ModelBased {
    /// What the robot takes.
    pub takes: Takes,
    known: KnownArm,
    target: JointTarget,
    /// What keeps the target from the pixels that are aimed at.
    held: Vec<Active>,
}

/// A target whose pixels differ from those aimed at by more standard deviations is out of reach.
const REACHED: f64 = 5.0;

impl ModelBased {
    /// With a complete rig.
    ///
    /// Errors: [`Error::Unusable`] with the paths of what is missing, or where there is no joint.
    pub fn new(rig: &Rig) -> Result<Self, Error> {
        let known = KnownArm::new(rig, Stepper::new(0.0))?;
        let target = JointTarget { joints: Vec::new(), sd: vec![1.0; known.arm.joints()] };
        Ok(ModelBased { takes: Takes::default(), known, target, held: Vec::new() })
    }

    /// Sets where the features shall be seen; some cameras and features suffice. May change between steps.
    pub fn aim(&mut self, goal: &[Sighting]) {
        self.known.aim(goal);
        self.target.joints.clear();
    }

    /// The motion of the next `dt` seconds, from what is seen now. `near`: where the joints are expected, such as noisy readings or
    /// where the last command should have led [rad or m]; it chooses among branches and says nothing else.
    ///
    /// Errors: [`Error::NotEnoughData`] where the pixels seen or aimed at lead to no joints; [`Error::Unusable`] where `near` is not of
    /// the rig.
    pub fn step(&mut self, seen: &[Sighting], near: &[f64], limits: &[&dyn Limit], dt: f64) -> Result<&Step, Error> {
        let now = self.known.reader.joints_seen_or_near(seen, near)?;
        if self.target.joints.is_empty() {
            let found = self.known.reader.joints_aimed_at(&self.known.goal, &now.joints)?;
            self.held = self.out_of_reach(&found);
            self.target.joints = found.joints;
        }
        self.known.arm.configure(&now.joints, &mut self.known.at);
        let goals = [Goal::new(&self.target)];
        let step = self.known.stepper.step(&self.known.arm, &self.known.at, &goals, limits, dt);
        self.known.at.move_at(&step.motion, dt);
        Ok(step)
    }

    /// Joints that were inferred last [rad or m]; empty before the first step.
    pub fn joints(&self) -> &[f64] {
        &self.known.at.joints
    }

    /// Joints aimed at [rad or m]; empty before the first step towards them.
    pub fn target(&self) -> &[f64] {
        &self.target.joints
    }

    /// The ends of joints that keep a target from the pixels aimed at; none where it comes as near as pixels are told.
    fn out_of_reach(&mut self, target: &Branch) -> Vec<Active> {
        if target.rms_px < REACHED * self.known.reader.sigma {
            return Vec::new();
        }
        let mut at = Configuration::default();
        self.known.arm.configure(&target.joints, &mut at);
        let task = ImagePoints { targets: self.known.goal.clone(), seen: Vec::new(), sd: self.known.reader.sigma };
        let mut active = self.known.stepper.step(&self.known.arm, &at, &[Goal::new(&task)], &[], 1.0).active.clone();
        active.retain(|active| matches!(active.constraint, Constraint::Joint { bound: Bound::Position, .. }));
        active
    }
}

impl Controller for ModelBased {
    fn aim(&mut self, goal: &[Sighting]) {
        ModelBased::aim(self, goal);
    }

    /// Where there are no readings, the joints are expected where the last command should have led; before the first, the most probable
    /// branch is taken.
    fn decide(&mut self, now: &Measurement<'_>, limits: &[&dyn Limit], dt: f64) -> Result<Decision, Error> {
        let near = self.known.near(now.joints);
        let step = self.step(now.seen, &near, limits, dt)?.clone();
        let mut decision = self.known.decide(self.takes, &step, dt)?;
        decision.active.extend_from_slice(&self.held);
        Ok(decision)
    }

    fn held(&mut self) {
        self.known.held();
    }
}
