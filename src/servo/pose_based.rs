//! Position-based visual servoing with a known rig.
use super::interaction_matrix::InteractionMatrix;
use super::known_arm::KnownArm;
use super::{
    Arm, Configuration, Controller, Decision, Gain, Goal, Limit, Measurement, Step, Stepper, Takes, Task, TaskRows,
};
use crate::Error;
use crate::infer::Sighting;
use crate::rig::Rig;
use handeye_solvers::Pose;
use handeye_solvers::manifold::so3;
use nalgebra::Vector3;

/// Servoing on the tip's pose, which is inferred from the pixels of all cameras in one problem: from features on the tip seen by cameras
/// in the world, and from features in the world seen by cameras on the tip (then it is the camera's pose against the object that counts).
///
///   J Δq = -λ e,   e = (t - t*, log(R R*ᵀ)),   J: geometric Jacobian of the tip
///
/// (t, R) is seen and (t*, R*) what the goal's pixels stand for, in the world (Chaumette and Hutchinson 2006, part I, PBVS). The tip goes
/// straight to its goal and turns about one axis, whatever the features do in the images: keep them there by a limit. What is seen and
/// what is aimed at need no feature in common. A [`Stepper`] makes the motion obey limits.
pub struct PoseBased {
    /// How it moves; may change between steps.
    pub settings: PoseSettings,
    /// What the robot takes.
    pub takes: Takes,
    known: KnownArm,
    target: Option<Pose>,
}

/// Settings of [`PoseBased`].
#[derive(Clone, Debug, PartialEq)]
pub struct PoseSettings {
    /// Where J is taken \[the mean\].
    pub matrix: InteractionMatrix,
    /// λ \[1\].
    pub gain: Gain,
    /// The present joints are inferred from what is seen, near the readings, and not the readings themselves \[false\]: for readings that
    /// are noisy or merely counted.
    pub infer_joints: bool,
    /// Standard deviation of each coordinate of the position [1e-3 m]: the weight where the arm cannot reach position and orientation.
    pub xyz_sd: f64,
    /// Standard deviation of the orientation about each axis [5e-3 rad].
    pub rot_sd: f64,
}

impl Default for PoseSettings {
    fn default() -> Self {
        PoseSettings {
            matrix: InteractionMatrix::default(),
            gain: Gain::default(),
            infer_joints: false,
            xyz_sd: 1e-3,
            rot_sd: 5e-3,
        }
    }
}

impl PoseBased {
    /// With a complete rig.
    ///
    /// Errors: [`Error::Unusable`] with the paths of what is missing, or where there is no joint.
    pub fn new(rig: &Rig, settings: PoseSettings) -> Result<Self, Error> {
        let known = KnownArm::new(rig, Stepper::default())?;
        Ok(PoseBased { settings, takes: Takes::default(), known, target: None })
    }

    /// Sets where the features shall be seen; some cameras and features suffice. May change between steps.
    pub fn aim(&mut self, goal: &[Sighting]) {
        self.known.aim(goal);
        self.target = None;
    }

    /// The motion of the next `dt` seconds, from what is seen now. `joints`: their readings [rad or m]; may be empty where joints are
    /// inferred.
    ///
    /// Errors: [`Error::NotEnoughData`] where the pixels seen or aimed at leave the tip's pose open, or nothing says where the joints are;
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
        let unknown = |what: &str| Error::NotEnoughData(format!("the pixels {what} leave the tip's pose open"));
        let now = known.reader.tip(seen, &known.at.posture.tip()).ok_or_else(|| unknown("seen"))?;
        let target = match self.target {
            Some(target) => target,
            None => *self.target.insert(known.reader.tip(&known.goal, &now).ok_or_else(|| unknown("aimed at"))?),
        };
        known.look_ahead(self.settings.matrix)?;
        let task = Approach {
            settings: &self.settings,
            away: target.translation - now.translation,
            turn: so3::log(&(target.rotation * now.rotation.transpose())),
            desired: &known.desired,
        };
        let largest = task.away.amax().max(task.turn.amax());
        let goals = [Goal { share: self.settings.gain.share(largest), ..Goal::new(&task) }];
        let step = known.stepper.step(&known.arm, &known.at, &goals, limits, dt);
        known.at.move_at(&step.motion, dt);
        Ok(step)
    }

    /// `world_from_tip` aimed at; `None` before the first step towards it.
    pub fn target(&self) -> Option<&Pose> {
        self.target.as_ref()
    }
}

impl Controller for PoseBased {
    fn aim(&mut self, goal: &[Sighting]) {
        PoseBased::aim(self, goal);
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

/// J Δq = -e.
struct Approach<'a> {
    settings: &'a PoseSettings,
    /// What is left to go [m] and to turn [rad], in the world.
    away: Vector3<f64>,
    turn: Vector3<f64>,
    desired: &'a Configuration,
}

impl Task for Approach<'_> {
    fn rows(&self, _arm: &Arm, at: &Configuration, rows: &mut TaskRows) {
        let [first, second] = self.settings.matrix.places(at, self.desired).map(|at| {
            let tip = at.posture.tip().translation;
            move || at.posture.axes.iter().map(move |axis| axis.twist(&tip))
        });
        let mean =
            || first().zip(second()).map(|((w, v), (other_w, other_v))| ((w + other_w) * 0.5, (v + other_v) * 0.5));
        for k in 0..3 {
            rows.push(mean().map(|(_, v)| v[k]), self.away[k], self.settings.xyz_sd);
            rows.push(mean().map(|(w, _)| w[k]), self.turn[k], self.settings.rot_sd);
        }
    }
}
