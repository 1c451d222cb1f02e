//! Image-based visual servoing with a known rig.
use super::interaction_matrix::InteractionMatrix;
use super::known_arm::KnownArm;
use super::{
    Arm, Configuration, Controller, Decision, Gain, Goal, Limit, Measurement, Step, Stepper, Takes, Task, TaskRows,
};
use crate::Error;
use crate::infer::Sighting;
use crate::rig::Rig;

/// Servoing on the pixels themselves: the error is what is seen minus what shall be seen, in all cameras at once.
///
///   J Δq = -λ e,   e = seen - goal [px],   J = ∂pixels/∂joints [px/rad or px/m]
///
/// J stacks, for every feature and camera, the interaction matrix times the arm's Jacobian (Chaumette and Hutchinson 2006, part I, eq. 5;
/// several cameras: part II), lens included, as the rig has them. Only joints between a camera and a feature move it, which
/// makes cameras in the world and on the arm one case, and any mix of them. Because e is measured, a rig that is off costs steps and not
/// accuracy. A [`Stepper`] makes the motion obey limits. Where joints are as they are read, memory is asked for
/// by the first step towards a goal, not by further ones.
pub struct ImageBased {
    /// How it moves; may change between steps.
    pub settings: ImageSettings,
    /// What the robot takes.
    pub takes: Takes,
    known: KnownArm,
}

/// Settings of [`ImageBased`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImageSettings {
    /// Where J is taken \[the mean\].
    pub matrix: InteractionMatrix,
    /// λ \[1\].
    pub gain: Gain,
    /// Depths of features as they are seen now, such as a depth camera measures them \[none\]: where J is that of now, they take the place
    /// of the rig's. Those of a camera on the arm may be rough.
    pub depths: Vec<Depth>,
    /// The present joints are inferred from what is seen, near the readings, and not the readings themselves \[false\]: for readings that
    /// are noisy or merely counted.
    pub infer_joints: bool,
}

/// How far a feature is in front of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Depth {
    /// Index into [`Rig::cameras`].
    pub camera: usize,
    /// Index into [`Rig::features`].
    pub feature: usize,
    /// Along the optical axis [m].
    pub depth: f64,
}

impl ImageBased {
    /// With a complete rig.
    ///
    /// Errors: [`Error::Unusable`] with the paths of what is missing, or where there is no joint.
    pub fn new(rig: &Rig, settings: ImageSettings) -> Result<Self, Error> {
        Ok(ImageBased { settings, takes: Takes::default(), known: KnownArm::new(rig, Stepper::default())? })
    }

    /// Sets where the features shall be seen; some cameras and features suffice. May change between steps.
    pub fn aim(&mut self, goal: &[Sighting]) {
        self.known.aim(goal);
    }

    /// The motion of the next `dt` seconds, from what is seen now; features that are not seen, or not aimed at, are passed over.
    /// `joints`: their readings [rad or m]; may be empty where joints are inferred.
    ///
    /// Errors: [`Error::NotEnoughData`] where nothing is seen that is aimed at, or nothing says where the joints are;
    /// [`Error::Unusable`] where `joints` is not of the rig.
    pub fn step(&mut self, seen: &[Sighting], joints: &[f64], limits: &[&dyn Limit], dt: f64) -> Result<&Step, Error> {
        self.advance(seen, (joints, self.settings.infer_joints), limits, dt)
    }

    fn advance(
        &mut self,
        seen: &[Sighting],
        joints: (&[f64], bool),
        limits: &[&dyn Limit],
        dt: f64,
    ) -> Result<&Step, Error> {
        let known = &mut self.known;
        known.reader.configure(&known.arm, seen, joints, &mut known.at)?;
        let errors = known.goal.iter().filter_map(|goal| error(seen, goal)).flatten();
        let Some(largest) = errors.map(f64::abs).reduce(f64::max) else {
            let aimed = known.goal.len();
            return Err(Error::NotEnoughData(format!("none of the {aimed} features aimed at is seen")));
        };
        known.look_ahead(self.settings.matrix)?;
        let task = Pixels { settings: &self.settings, goal: &known.goal, seen, desired: &known.desired };
        let goals = [Goal { share: self.settings.gain.share(largest), ..Goal::new(&task) }];
        let step = known.stepper.step(&known.arm, &known.at, &goals, limits, dt);
        known.at.move_at(&step.motion, dt);
        Ok(step)
    }

    /// Joints of the last step [rad or m], as read or inferred; empty before the first.
    pub fn joints(&self) -> &[f64] {
        &self.known.at.joints
    }

    /// Joints aimed at [rad or m]; empty before the first step that needed them.
    pub fn target(&self) -> &[f64] {
        &self.known.desired.joints
    }
}

impl Controller for ImageBased {
    fn aim(&mut self, goal: &[Sighting]) {
        ImageBased::aim(self, goal);
    }

    /// Where there are no readings, the joints are inferred, near where the last command should have led.
    fn decide(&mut self, now: &Measurement<'_>, limits: &[&dyn Limit], dt: f64) -> Result<Decision, Error> {
        let near = self.known.near(now.joints);
        let infer = now.joints.is_empty() || self.settings.infer_joints;
        let step = self.advance(now.seen, (&near, infer), limits, dt)?.clone();
        self.known.decide(self.takes, &step, dt)
    }

    fn held(&mut self) {
        self.known.held();
    }
}

/// Seen minus aimed at [px]; `None` where the feature is not seen, or what is is not finite.
fn error(seen: &[Sighting], goal: &Sighting) -> Option<[f64; 2]> {
    let seen = seen.iter().find(|seen| (seen.camera, seen.feature) == (goal.camera, goal.feature))?;
    let error = [seen.pixel[0] - goal.pixel[0], seen.pixel[1] - goal.pixel[1]];
    error.iter().all(|number| number.is_finite()).then_some(error)
}

/// J Δq = -e.
struct Pixels<'a> {
    settings: &'a ImageSettings,
    goal: &'a [Sighting],
    seen: &'a [Sighting],
    desired: &'a Configuration,
}

impl Task for Pixels<'_> {
    fn rows(&self, arm: &Arm, at: &Configuration, rows: &mut TaskRows) {
        for goal in self.goal {
            let Some(error) = error(self.seen, goal) else { continue };
            let seen = Sighting { pixel: [goal.pixel[0] + error[0], goal.pixel[1] + error[1]], ..*goal };
            let is_of = |depth: &&Depth| (depth.camera, depth.feature) == (goal.camera, goal.feature);
            let measured = self.settings.depths.iter().find(is_of).map(|depth| depth.depth);
            let now = (at, seen, measured);
            let sights = self.settings.matrix.places(now, (self.desired, *goal, None)).map(|(at, sighting, depth)| {
                depth.map_or_else(|| arm.sight(at, &sighting), |depth| arm.sight_at_depth(at, &sighting, depth))
            });
            let [Some(first), Some(second)] = sights else { continue };
            for (axis, error) in error.into_iter().enumerate() {
                let slopes = first.slopes(axis).zip(second.slopes(axis)).map(|(a, b)| 0.5 * (a + b));
                rows.push(slopes, -error, 1.0);
            }
        }
    }
}
