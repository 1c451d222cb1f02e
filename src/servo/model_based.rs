//! The paper's controller: infer the present and the target joints, command the difference, repeat.
use super::pixel_reader::PixelReader;
use super::tasks::{ImagePoints, JointTarget};
use super::{
    Active, Arm, Bound, Configuration, Constraint, Controller, Decision, Goal, Limit, Measurement, Step, Stepper, Takes,
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
    arm: Arm,
    reader: PixelReader,
    stepper: Stepper,
    at: Configuration,
    target: JointTarget,
    goal: Vec<Sighting>,
    /// Where the last command should have led [rad or m]; empty before the first.
    expected: Vec<f64>,
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
        let arm = Arm::new(rig)?;
        Ok(ModelBased {
            takes: Takes::default(),
            target: JointTarget { joints: Vec::new(), sd: vec![1.0; arm.joints()] },
            arm,
            reader: PixelReader::new(rig)?,
            stepper: Stepper::new(0.0),
            at: Configuration::default(),
            goal: Vec::new(),
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
        let now = self.reader.joints_seen_or_near(seen, near)?;
        if self.target.joints.is_empty() {
            let found = self.reader.joints_aimed_at(&self.goal, &now.joints)?;
            self.held = self.out_of_reach(&found);
            self.target.joints = found.joints;
        }
        self.arm.configure(&now.joints, &mut self.at);
        let goals = [Goal::new(&self.target)];
        let step = self.stepper.step(&self.arm, &self.at, &goals, limits, dt);
        self.at.move_at(&step.motion, dt);
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
        if target.rms_px < REACHED * self.reader.sigma {
            return Vec::new();
        }
        let mut at = Configuration::default();
        self.arm.configure(&target.joints, &mut at);
        let task = ImagePoints { targets: self.goal.clone(), seen: Vec::new(), sd: self.reader.sigma };
        let mut active = self.stepper.step(&self.arm, &at, &[Goal::new(&task)], &[], 1.0).active.clone();
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
        let near = if now.joints.is_empty() { self.expected.clone() } else { now.joints.to_vec() };
        let step = self.step(now.seen, &near, limits, dt)?.clone();
        self.expected.clear();
        self.expected.extend(self.at.joints.iter().zip(&step.motion).map(|(joint, motion)| joint + motion));
        let mut decision = Decision::new(self.takes, &self.arm, &self.at, &step, dt);
        decision.active.extend_from_slice(&self.held);
        Ok(decision)
    }
}
