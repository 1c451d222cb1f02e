//! What a closed loop asks of a controller.
use super::{Active, Arm, Configuration, Constraint, Limit, Step, Stop, Takes};
use crate::Error;
use crate::infer::{PointSighting, Sighting};
use crate::recording::Command;

/// What was read and seen at a moment.
#[derive(Clone, Copy, Debug)]
pub struct Measurement<'a> {
    /// When [s].
    pub time: f64,
    /// Joint readings [rad or m]; empty where the robot gives none.
    pub joints: &'a [f64],
    /// Features in images.
    pub seen: &'a [Sighting],
    /// Features in the frames of depth cameras.
    pub points: &'a [PointSighting],
}

/// A command, and what holds it back.
#[derive(Clone, Debug, PartialEq)]
pub struct Decision {
    /// What the robot shall do.
    pub command: Command,
    /// What holds it back.
    pub active: Vec<Active>,
    /// Constraints that cannot all hold, where a limit gave way; see [`Step::conflict`].
    pub conflict: Vec<Constraint>,
    /// Features whose trackers are not believed, as camera and feature: their errors are not those of the loop.
    pub left_out: Vec<(usize, usize)>,
    /// True where the motion is to learn from and not to arrive: errors need not fall.
    pub explores: bool,
    /// Why the controller gives up, where it does.
    pub stop: Option<Stop>,
}

impl Decision {
    /// A command that nothing holds back.
    pub fn free(command: Command) -> Self {
        let (active, conflict, left_out) = (Vec::new(), Vec::new(), Vec::new());
        Decision { command, active, conflict, left_out, explores: false, stop: None }
    }

    /// A joint motion, as what the robot takes.
    ///
    /// Errors: [`Error::NotEnoughData`] for a step that failed, whose motion is worth nothing.
    pub fn new(takes: Takes, arm: &Arm, at: &Configuration, step: &Step, dt: f64) -> Result<Self, Error> {
        if step.failed {
            return Err(Error::NotEnoughData(
                "the numbers of a step were not finite, or its program broke down".to_owned(),
            ));
        }
        let command = takes.command(arm, at, &step.motion, dt);
        Ok(Decision { active: step.active.clone(), conflict: step.conflict.clone(), ..Decision::free(command) })
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

    /// The error that the loop judges [px]: the mean distance of the features that are seen and believed from where they shall be, unless
    /// the controller aims at something else; `None` where nothing of it is seen.
    fn error_px(&self, now: &Measurement<'_>, goal: &[Sighting], left_out: &[(usize, usize)]) -> Option<f64> {
        mean_distance(now.seen, goal, left_out)
    }

    /// Whether readings of joints that are no numbers hold the robot; where not, they are as good as none.
    fn reads_joints(&self) -> bool {
        false
    }

    /// Told when the robot is held in place of a command: it stands still from now on.
    fn held(&mut self) {}
}

/// Mean distance of features from where they shall be, over those that are seen and not left out [px]; `None` where there is none.
pub(super) fn mean_distance(seen: &[Sighting], goal: &[Sighting], left_out: &[(usize, usize)]) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0);
    for target in goal.iter().filter(|target| !left_out.contains(&(target.camera, target.feature))) {
        let same = |seen: &&Sighting| (seen.camera, seen.feature) == (target.camera, target.feature);
        if let Some(seen) = seen.iter().find(same) {
            sum += (seen.pixel[0] - target.pixel[0]).hypot(seen.pixel[1] - target.pixel[1]);
            count += 1;
        }
    }
    (count > 0).then(|| sum / f64::from(count))
}

impl<C: Controller + ?Sized> Controller for Box<C> {
    fn aim(&mut self, goal: &[Sighting]) {
        (**self).aim(goal);
    }

    fn decide(&mut self, now: &Measurement<'_>, limits: &[&dyn Limit], dt: f64) -> Result<Decision, Error> {
        (**self).decide(now, limits, dt)
    }

    fn error_px(&self, now: &Measurement<'_>, goal: &[Sighting], left_out: &[(usize, usize)]) -> Option<f64> {
        (**self).error_px(now, goal, left_out)
    }

    fn reads_joints(&self) -> bool {
        (**self).reads_joints()
    }

    fn held(&mut self) {
        (**self).held();
    }
}
