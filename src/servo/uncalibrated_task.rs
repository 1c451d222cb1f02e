//! Carrying out a task in images without a rig.
use super::image_tasks::{ImageTask, Place, Seen};
use super::readings::Readings;
use super::target_watch::TargetWatch;
use super::uncalibrated::{Phase, Quantity, Row, Settings, Uncalibrated, stop_of};
use super::{Controller, Decision, Limit, LimitRows, Measurement, Takes};
use crate::Error;
use crate::infer::Sighting;
use crate::recording::Command;
use crate::rig::Joint;
use handeye_solvers::Pose;
use nalgebra::{Matrix3, Vector3};

/// Moves what the robot takes until the errors of an [`ImageTask`] are 0, through [`Uncalibrated`]: nothing is known of arm and cameras.
///
/// Cameras and features of measurements are those of the task, by its indices. A robot of joints is moved by its joints inside their limits,
/// apart from their ends where it gives no readings; one that takes motions of its tip is moved without turning, by three coordinates; one that
/// takes velocities of its tip by all six. What is left of a task whose trackers are lost is carried out where it still determines the motion.
/// Where a target moves that cameras beside the robot see, its rows are told so, and the motions of the arm alone teach the Jacobian.
pub struct UncalibratedTask {
    /// Cameras that move with the hand, by the task's indices, which see the target move without its moving: false for all at first.
    pub carried: Vec<bool>,
    takes: Takes,
    task: ImageTask,
    readings: Readings,
    settings: Settings,
    servo: Option<Uncalibrated>,
    limits: LimitRows,
    target: Option<TargetWatch>,
    errors: Vec<f64>,
    /// Root of the mean square of the rows, at the last decision [px].
    error_px: f64,
}

/// What the tip moves by for every unit of a controlled coordinate [m]: motions of joints and of the tip are then alike in size.
const REACH: f64 = 0.2;

impl UncalibratedTask {
    /// For a robot that takes this, with joints of which the limits are known as far as there are any.
    ///
    /// Errors: [`Error::Unusable`] where nothing is controlled, where the task has fewer rows than that, or where a setting is not what it may be.
    pub fn new(task: ImageTask, takes: Takes, joints: &[Joint], settings: Settings) -> Result<Self, Error> {
        let of_tip = |names: &[&str]| {
            names.iter().map(|name| Quantity { name: (*name).to_owned(), ..Quantity::default() }).collect()
        };
        let quantities: Vec<Quantity> = match takes {
            Takes::PoseDelta => of_tip(&["x", "y", "z"]),
            Takes::PoseVelocity => of_tip(&["turn about x", "turn about y", "turn about z", "x", "y", "z"]),
            Takes::Joints | Takes::JointDelta | Takes::JointVelocity => joints
                .iter()
                .map(|joint| Quantity { name: joint.name.clone(), limits: joint.limits, dead_band: 0.0 })
                .collect(),
        };
        // What is wrong is told at once and not at the first step.
        let rows = vec![Row { sd: task.trackers().pixels, camera: 0 }; task.rows()];
        Uncalibrated::new(quantities.clone(), rows, settings.clone())?;
        Ok(UncalibratedTask {
            carried: vec![false; task.cameras().len()],
            takes,
            task,
            readings: Readings::new(quantities),
            settings,
            servo: None,
            limits: LimitRows::default(),
            target: None,
            errors: Vec::new(),
            error_px: f64::NAN,
        })
    }

    /// Motions that are smaller than this are not carried out: of every joint [rad or m], or of every coordinate of the tip [units of 0.2 m, rad].
    ///
    /// Errors: [`Error::Unusable`] where it is less than 0.
    pub fn dead_band(&mut self, width: f64) -> Result<(), Error> {
        if !(width >= 0.0 && width.is_finite()) {
            return Err(Error::Unusable(format!("a dead band is 0 or more, found {width}")));
        }
        self.readings.set_dead_bands(std::iter::repeat(width));
        (self.servo, self.target) = (None, None);
        Ok(())
    }

    /// What is being done; `None` before the first step.
    pub fn phase(&self) -> Option<&Phase> {
        self.servo.as_ref().map(Uncalibrated::phase)
    }

    /// Errors without those of rows that exploring has dropped.
    fn believed(&self, mut errors: Vec<f64>) -> Vec<f64> {
        let dropped = self.servo.as_ref().map_or(&[][..], Uncalibrated::dropped);
        dropped.iter().for_each(|row| errors[*row] = f64::NAN);
        errors
    }

    /// Where every feature is seen.
    fn see(&self, now: &Measurement<'_>) -> Seen {
        let mut seen = Seen::new(&self.task);
        let is_tracked =
            |feature: usize| self.task.features().get(feature).is_some_and(|f| !matches!(f.place, Place::Image(_)));
        for one in now.seen.iter().filter(|one| is_tracked(one.feature)) {
            if let Some(pixel) = seen.pixels.get_mut(one.camera).and_then(|camera| camera.get_mut(one.feature)) {
                *pixel = one.pixel;
            }
        }
        for one in now.points.iter().filter(|one| is_tracked(one.feature)) {
            if let Some(point) = seen.points.get_mut(one.camera).and_then(|camera| camera.get_mut(one.feature)) {
                *point = one.point;
            }
        }
        seen
    }

    fn command(&self, motion: &[f64], dt: f64) -> Command {
        self.readings.command(self.takes, motion, dt).unwrap_or_else(|| self.command_of_tip(motion, dt))
    }

    /// For a robot that does not take joints.
    fn command_of_tip(&self, motion: &[f64], dt: f64) -> Command {
        let shift = |m: &[f64]| REACH * Vector3::new(m[0], m[1], m[2]);
        if self.takes == Takes::PoseVelocity {
            let (w, v) = (Vector3::new(motion[0], motion[1], motion[2]) / dt, shift(&motion[3..]) / dt);
            return Command::PoseVelocity([w.x, w.y, w.z, v.x, v.y, v.z]);
        }
        Command::PoseDelta(Pose { rotation: Matrix3::identity(), translation: shift(motion) })
    }
}

impl Controller for UncalibratedTask {
    /// A task has its target among its own features: what is aimed at beside is not looked at.
    fn aim(&mut self, _: &[Sighting]) {}

    /// Root of the mean square of the rows that are seen and believed.
    fn error_px(&self, now: &Measurement<'_>, _: &[Sighting], _: &[(usize, usize)]) -> Option<f64> {
        root_mean_square(&self.believed(self.task.values(&self.see(now))))
    }

    fn reads_joints(&self) -> bool {
        !matches!(self.takes, Takes::PoseDelta | Takes::PoseVelocity)
    }

    fn decide(&mut self, now: &Measurement<'_>, limits: &[&dyn Limit], dt: f64) -> Result<Decision, Error> {
        if !limits.is_empty() {
            return Err(Error::Unusable("limits beside those of the joints need a rig, and none is given".to_owned()));
        }
        let read = if self.reads_joints() { now.joints } else { &[] };
        if self.readings.take(read, self.takes == Takes::Joints)? {
            (self.servo, self.target) = (None, None);
        }
        let seen = self.see(now);
        let servo = match &mut self.servo {
            Some(servo) => servo,
            none => {
                let rows = self.task.signals(&seen)?;
                let settings = self.settings.for_rows(rows.len());
                none.insert(Uncalibrated::new(self.readings.quantities(), rows, settings)?)
            }
        };
        let target = self.target.get_or_insert_with(|| TargetWatch::new(&seen));
        if let Some(changes) = target.changes(&self.task, &self.carried, &seen) {
            servo.shift(&changes)?;
        }
        self.errors = self.task.values(&seen);
        self.limits.clear(self.readings.len());
        let told = servo.step(self.readings.now(), &self.errors, &self.limits, dt)?;
        let (phase, motion) = (told.phase.clone(), told.motion.to_vec());
        let (active, conflict) = (told.active.to_vec(), told.conflict.to_vec());
        let error_px = root_mean_square(&self.believed(self.errors.clone())).unwrap_or(f64::NAN);
        let stop = stop_of(&phase, std::mem::replace(&mut self.error_px, error_px), error_px)?;
        self.readings.moves(&motion);
        let command = if stop.is_some() { Command::Hold } else { self.command(&motion, dt) };
        let explores = phase == Phase::Exploring;
        Ok(Decision { active, conflict, explores, stop, ..Decision::free(command) })
    }
}

/// Of the errors that are numbers; `None` where none is.
fn root_mean_square(errors: &[f64]) -> Option<f64> {
    let (sum, n) =
        errors.iter().filter(|error| error.is_finite()).fold((0.0, 0.0_f64), |(sum, n), e| (sum + e * e, n + 1.0));
    (n > 0.0).then(|| (sum / n).sqrt())
}
