//! What controllers of an arm with a chain carry from step to step.
use super::interaction_matrix::InteractionMatrix;
use super::pixel_reader::PixelReader;
use super::{Arm, Configuration, Decision, Step, Stepper, Takes};
use crate::Error;
use crate::infer::Sighting;
use crate::rig::Rig;

/// The arm, what reads its pixels, where it is, where it was sent, and what it is aimed at.
pub(super) struct KnownArm {
    pub arm: Arm,
    pub reader: PixelReader,
    pub stepper: Stepper,
    pub at: Configuration,
    pub goal: Vec<Sighting>,
    /// Where the joints are that are aimed at; without any until they are asked for.
    pub desired: Configuration,
    /// Where the last command should have led [rad or m]; empty before the first.
    expected: Vec<f64>,
}

impl KnownArm {
    /// Of a complete rig.
    ///
    /// Errors: [`Error::Unusable`] with the paths of what is missing, or where there is no joint.
    pub fn new(rig: &Rig, stepper: Stepper) -> Result<Self, Error> {
        Ok(KnownArm {
            arm: Arm::new(rig)?,
            reader: PixelReader::new(rig)?,
            stepper,
            at: Configuration::default(),
            goal: Vec::new(),
            desired: Configuration::default(),
            expected: Vec::new(),
        })
    }

    /// Sets where the features shall be seen.
    pub fn aim(&mut self, goal: &[Sighting]) {
        self.goal.clear();
        self.goal.extend_from_slice(goal);
        self.desired.joints.clear();
    }

    /// Infers the joints aimed at, once for a goal, where a matrix needs them.
    pub fn look_ahead(&mut self, matrix: InteractionMatrix) -> Result<(), Error> {
        if matrix.looks_ahead() && self.desired.joints.is_empty() {
            let target = self.reader.joints_on_the_way(&self.goal, &self.at.joints)?;
            self.arm.configure(&target, &mut self.desired);
        }
        Ok(())
    }

    /// Where the joints are expected [rad or m]: as they are read, or, unread, where the last command should have led.
    pub fn near(&self, read: &[f64]) -> Vec<f64> {
        if read.is_empty() { self.expected.clone() } else { read.to_vec() }
    }

    /// What a robot is told of the last step, which from now on is where the joints are expected.
    ///
    /// Errors: those of [`Decision::new`].
    pub fn decide(&mut self, takes: Takes, step: &Step, dt: f64) -> Result<Decision, Error> {
        self.expected.clear();
        self.expected.extend(self.at.joints.iter().zip(&step.motion).map(|(joint, motion)| joint + motion));
        Decision::new(takes, &self.arm, &self.at, step, dt)
    }

    /// The arm stands still.
    pub fn held(&mut self) {
        self.at.velocity.fill(0.0);
    }
}
