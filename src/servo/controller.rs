//! What a closed loop asks of a controller.
use super::{Active, Arm, Configuration, Limit, Step, Takes};
use crate::Error;
use crate::infer::Sighting;
use crate::simulate::world::Command;

/// What was read and seen at a moment.
#[derive(Clone, Copy, Debug)]
pub struct Measurement<'a> {
    /// When [s].
    pub time: f64,
    /// Joint readings [rad or m]; empty where the robot gives none.
    pub joints: &'a [f64],
    /// Features in images.
    pub seen: &'a [Sighting],
}

/// A command, and what holds it back.
#[derive(Clone, Debug, PartialEq)]
pub struct Decision {
    /// What the robot shall do.
    pub command: Command,
    /// What holds it back.
    pub active: Vec<Active>,
}

impl Decision {
    /// A joint motion, as what the robot takes; a step that failed holds the robot.
    pub fn new(takes: Takes, arm: &Arm, at: &Configuration, step: &Step, dt: f64) -> Self {
        let command = if step.failed { Command::Hold } else { takes.command(arm, at, &step.motion, dt) };
        Decision { command, active: step.active.clone() }
    }
}

/// From what is seen to what the robot shall do.
pub trait Controller {
    /// Sets where features shall be seen; may change between steps.
    fn aim(&mut self, goal: &[Sighting]);

    /// The command for the next `dt` seconds.
    ///
    /// Errors: [`Error::NotEnoughData`] where what is seen determines no motion, after which the loop waits for the next measurement;
    /// any other error ends it.
    fn decide(&mut self, now: &Measurement<'_>, limits: &[&dyn Limit], dt: f64) -> Result<Decision, Error>;
}
