//! Carrying out a task in images without a rig.
use super::image_tasks::{ImageTask, Place, Seen};
use super::target_watch::TargetWatch;
use super::uncalibrated::{Phase, Quantity, Row, Settings, Uncalibrated, not_read, stop_of};
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
    quantities: Vec<Quantity>,
    settings: Settings,
    servo: Option<Uncalibrated>,
    limits: LimitRows,
    target: Option<TargetWatch>,
    /// Whether the robot gave readings when the servoing began.
    is_read: bool,
    readings: Vec<f64>,
    commanded: Vec<f64>,
    errors: Vec<f64>,
}

/// What the tip moves by for every unit of a controlled coordinate [m]: motions of joints and of the tip are then alike in size.
const REACH: f64 = 0.2;

/// Rows of the thesis's tasks, to which [`Settings::divergence`] refers here.
const ROWS: f64 = 12.0;

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
        let n = quantities.len();
        // What is wrong is told at once and not at the first step.
        let rows = vec![Row { sd: task.trackers().pixels, camera: 0 }; task.rows()];
        Uncalibrated::new(quantities.clone(), rows, settings.clone())?;
        Ok(UncalibratedTask {
            carried: vec![false; task.cameras().len()],
            takes,
            task,
            quantities,
            settings,
            servo: None,
            limits: LimitRows::default(),
            target: None,
            is_read: false,
            readings: vec![0.0; n],
            commanded: vec![0.0; n],
            errors: Vec::new(),
        })
    }

    /// Motions that are smaller than this are not carried out: of every joint [rad or m], or of every coordinate of the tip [units of 0.2 m, rad].
    ///
    /// Errors: [`Error::Unusable`] where it is less than 0.
    pub fn dead_band(&mut self, width: f64) -> Result<(), Error> {
        if !(width >= 0.0 && width.is_finite()) {
            return Err(Error::Unusable(format!("a dead band is 0 or more, found {width}")));
        }
        self.quantities.iter_mut().for_each(|quantity| quantity.dead_band = width);
        (self.servo, self.target) = (None, None);
        Ok(())
    }

    /// What is being done; `None` before the first step.
    pub fn phase(&self) -> Option<&Phase> {
        self.servo.as_ref().map(Uncalibrated::phase)
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
        let shift = |m: &[f64]| REACH * Vector3::new(m[0], m[1], m[2]);
        match self.takes {
            Takes::Joints => Command::Joints(self.readings.iter().zip(motion).map(|(at, by)| at + by).collect()),
            Takes::JointDelta => Command::JointDelta(motion.to_vec()),
            Takes::JointVelocity => Command::JointVelocity(motion.iter().map(|motion| motion / dt).collect()),
            Takes::PoseDelta => Command::PoseDelta(Pose { rotation: Matrix3::identity(), translation: shift(motion) }),
            Takes::PoseVelocity => {
                let (w, v) = (Vector3::new(motion[0], motion[1], motion[2]) / dt, shift(&motion[3..]) / dt);
                Command::PoseVelocity([w.x, w.y, w.z, v.x, v.y, v.z])
            }
        }
    }
}

impl Controller for UncalibratedTask {
    /// A task has its target among its own features: what is aimed at beside is not looked at.
    fn aim(&mut self, _: &[Sighting]) {}

    /// Root of the mean square of the rows that are seen.
    fn error_px(&self, now: &Measurement<'_>, _: &[Sighting], _: &[(usize, usize)]) -> Option<f64> {
        let mut squares = self.task.values(&self.see(now));
        squares.retain(|error| error.is_finite());
        squares.iter_mut().for_each(|error| *error *= *error);
        (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
    }

    fn decide(&mut self, now: &Measurement<'_>, limits: &[&dyn Limit], dt: f64) -> Result<Decision, Error> {
        if !limits.is_empty() {
            return Err(Error::Unusable("limits beside those of the joints need a rig, and none is given".to_owned()));
        }
        let moves_joints = !matches!(self.takes, Takes::PoseDelta | Takes::PoseVelocity);
        let is_read = moves_joints && !now.joints.is_empty();
        if !is_read && (self.is_read || self.takes == Takes::Joints) {
            return Err(not_read());
        }
        self.readings.clear();
        self.readings.extend(if is_read { now.joints } else { &self.commanded });
        let seen = self.see(now);
        let servo = match &mut self.servo {
            Some(servo) => servo,
            none => {
                let rows = self.task.signals(&seen)?;
                // The divergence of the thesis is one of 12 rows.
                let divergence = self.settings.divergence * f64::max(1.0, rows.len() as f64 / ROWS);
                let settings = Settings { divergence, ..self.settings.clone() };
                self.is_read = is_read;
                let mut quantities = self.quantities.clone();
                if !is_read {
                    // Nobody knows how far it is to the ends of joints that are not read; the robot stops at them.
                    quantities.iter_mut().for_each(|one| (one.limits.lower, one.limits.upper) = (None, None));
                }
                none.insert(Uncalibrated::new(quantities, rows, settings)?)
            }
        };
        let target = self.target.get_or_insert_with(|| TargetWatch::new(&seen));
        if let Some(changes) = target.changes(&self.task, &self.carried, &seen) {
            servo.shift(&changes)?;
        }
        self.errors = self.task.values(&seen);
        self.limits.clear(self.quantities.len());
        let told = servo.step(&self.readings, &self.errors, &self.limits, dt)?;
        let (phase, motion) = (told.phase.clone(), told.motion.to_vec());
        let (active, conflict) = (told.active.to_vec(), told.conflict.to_vec());
        let mut seen: Vec<f64> = self.errors.iter().map(|error| error.abs()).collect();
        seen.retain(|error| error.is_finite());
        let stop = stop_of(&phase, seen.iter().sum::<f64>() / seen.len().max(1) as f64, seen.len())?;
        self.commanded.iter_mut().zip(&motion).for_each(|(at, by)| *at += by);
        let command = if stop.is_some() { Command::Hold } else { self.command(&motion, dt) };
        let explores = phase == Phase::Exploring;
        Ok(Decision { active, conflict, explores, stop, ..Decision::free(command) })
    }
}
