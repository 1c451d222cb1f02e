//! Servoing joints to pixels without a rig, or with one that may be outdated.
use super::readings::Readings;
use super::rig_foresight::RigForesight;
use super::tracker_watch::TrackerWatch;
use super::uncalibrated::{Phase, Quantity, Row, Settings, Uncalibrated, stop_of};
use super::{Arm, Configuration, Controller, Decision, Limit, LimitRows, Measurement, Takes};
use crate::Error;
use crate::infer::Sighting;
use crate::recording::Command;
use crate::rig::{Joint, Rig};
use std::collections::BTreeSet;

/// Moves joints so that features are seen where they shall be, through [`Uncalibrated`]: nothing is known of arm and cameras but the
/// joints' limits.
///
/// It explores first, unless a rig is given ([`UncalibratedJoints::with_rig`]), whose slopes and curvature are followed as far as what is seen
/// bears them out: a true rig leads there at once, and one whose camera has moved gives way to what motions show. Trackers that jump,
/// freeze or drift are left out while the others determine the motion, and come back when they agree again; [`UncalibratedJoints::left_out`]
/// names them.
pub struct UncalibratedJoints {
    /// What the robot takes: joints, joint motions or joint speeds.
    pub takes: Takes,
    readings: Readings,
    sd_px: f64,
    settings: Settings,
    /// The rig that is given, and its arm.
    rig: Option<(Rig, Arm)>,
    at: Configuration,
    limits: LimitRows,
    goal: Vec<Sighting>,
    /// The features of the goal that are servoed on, in the order of the rows.
    rows: Vec<Sighting>,
    servo: Option<Uncalibrated>,
    watch: TrackerWatch,
    errors: Vec<f64>,
    /// Mean distance of the features that are believed, at the last decision [px].
    error_px: f64,
}

impl UncalibratedJoints {
    /// Of joints of which the limits are known, as far as there are any. `sd_px`: standard deviation of a tracker's pixel coordinates [px].
    ///
    /// Errors: [`Error::Unusable`] where there is no joint, or a setting or the noise is not what it may be.
    pub fn new(joints: &[Joint], sd_px: f64, settings: Settings) -> Result<Self, Error> {
        let quantity = |joint: &Joint| Quantity { name: joint.name.clone(), limits: joint.limits, dead_band: 0.0 };
        let quantities: Vec<Quantity> = joints.iter().map(quantity).collect();
        // What is wrong is told at once and not at the first step.
        let rows = vec![Row { sd: sd_px, camera: 0 }; quantities.len()];
        Uncalibrated::new(quantities.clone(), rows, settings.clone())?;
        Ok(UncalibratedJoints {
            takes: Takes::default(),
            readings: Readings::new(quantities),
            sd_px,
            settings,
            rig: None,
            at: Configuration::default(),
            limits: LimitRows::default(),
            goal: Vec::new(),
            rows: Vec::new(),
            servo: None,
            watch: TrackerWatch::default(),
            errors: Vec::new(),
            error_px: f64::NAN,
        })
    }

    /// Of a complete rig that may be outdated: a camera may have been moved, a tool exchanged. `settings`: [`Settings::with_rig`] suits it.
    ///
    /// Errors: [`Error::Unusable`] with the paths of what is missing, or as [`UncalibratedJoints::new`].
    pub fn with_rig(rig: &Rig, sd_px: f64, settings: Settings) -> Result<Self, Error> {
        let mut servo = Self::new(&rig.robot.joints, sd_px, settings)?;
        servo.rig = Some((rig.clone(), Arm::new(rig)?));
        Ok(servo)
    }

    /// Dead bands of the joints [rad or m], one each: smaller motions are not carried out. None at first.
    ///
    /// Errors: [`Error::Unusable`] where they are not as many as the joints, or less than 0.
    pub fn dead_bands(&mut self, widths: &[f64]) -> Result<(), Error> {
        if widths.len() != self.readings.len() || widths.iter().any(|width| !(*width >= 0.0 && width.is_finite())) {
            let n = self.readings.len();
            return Err(Error::Unusable(format!("dead bands are {n} numbers of 0 or more, found {widths:?}")));
        }
        self.readings.set_dead_bands(widths.iter().copied());
        self.servo = None;
        Ok(())
    }

    /// What is being done; `None` before the first step.
    pub fn phase(&self) -> Option<&Phase> {
        self.servo.as_ref().map(Uncalibrated::phase)
    }

    /// Features whose trackers are not believed now, as camera and feature.
    pub fn left_out(&self) -> impl Iterator<Item = (usize, usize)> {
        self.watch.left_out().map(|tracker| (self.rows[tracker].camera, self.rows[tracker].feature))
    }

    /// Begins with the features of the goal that are seen.
    fn begin(&mut self, seen: &[Sighting]) -> Result<(), Error> {
        self.rows = self.goal.iter().filter(|goal| find(seen, goal).is_some()).copied().collect();
        let (n, m) = (self.readings.len(), 2 * self.rows.len());
        if m < n {
            let [seen, all] = [self.rows.len(), self.goal.len()];
            return Err(Error::NotEnoughData(format!(
                "{seen} of the {all} features aimed at are seen, which do not determine {n} joints"
            )));
        }
        let row = |goal: &Sighting| [Row { sd: self.sd_px, camera: goal.camera }; 2];
        let rows: Vec<Row> = self.rows.iter().flat_map(row).collect();
        let mut servo = Uncalibrated::new(self.readings.quantities(), rows, self.settings.for_rows(m))?;
        if let Some((rig, _)) = &self.rig {
            servo.begin_with_model(Box::new(RigForesight::new(rig, &self.rows)?));
        }
        self.watch = TrackerWatch::new(self.rows.iter().map(|row| row.camera).collect());
        self.servo = Some(servo);
        Ok(())
    }

    /// The rows of the limits, which need a rig.
    fn limit(&mut self, limits: &[&dyn Limit], dt: f64) -> Result<(), Error> {
        self.limits.clear(self.readings.len());
        let Some((_, arm)) = &self.rig else {
            return if limits.is_empty() {
                Ok(())
            } else {
                Err(Error::Unusable("limits beside those of the joints need a rig, and none is given".to_owned()))
            };
        };
        arm.configure(self.readings.now(), &mut self.at);
        for (index, limit) in limits.iter().enumerate() {
            self.limits.begin(index);
            limit.rows(arm, &self.at, dt, &mut self.limits);
        }
        Ok(())
    }

    fn command(&self, motion: &[f64], dt: f64) -> Result<Command, Error> {
        self.readings.command(self.takes, motion, dt).ok_or_else(|| {
            Error::Unusable(format!(
                "without a rig that is right, a joint motion cannot be told to a robot that takes {}: it needs joints, joint-deltas or \
                 joint-velocities",
                self.takes.name()
            ))
        })
    }
}

fn find<'a>(seen: &'a [Sighting], goal: &Sighting) -> Option<&'a Sighting> {
    seen.iter().find(|seen| (seen.camera, seen.feature) == (goal.camera, goal.feature))
}

impl Controller for UncalibratedJoints {
    /// A goal of the same features elsewhere keeps what was learned; another one begins anew, and so does any after giving up.
    fn aim(&mut self, goal: &[Sighting]) {
        self.goal = goal.to_vec();
        let changes: Option<Vec<f64>> = self
            .rows
            .iter()
            .map(|row| find(goal, row).map(|now| [0, 1].map(|axis| row.pixel[axis] - now.pixel[axis])))
            .collect::<Option<Vec<_>>>()
            .map(|changes| changes.concat());
        let kept = match (&mut self.servo, changes) {
            (Some(servo), Some(changes)) if !matches!(servo.phase(), Phase::Stopped(_)) => {
                servo.shift(&changes).is_ok()
            }
            _ => false,
        };
        if kept {
            let now = |row: &Sighting| find(goal, row).copied().unwrap_or(*row);
            self.rows.iter_mut().for_each(|row| *row = now(row));
        } else {
            (self.servo, self.rows) = (None, Vec::new());
        }
    }

    fn reads_joints(&self) -> bool {
        true
    }

    fn decide(&mut self, now: &Measurement<'_>, limits: &[&dyn Limit], dt: f64) -> Result<Decision, Error> {
        let must_read = self.takes == Takes::Joints || self.rig.is_some();
        if self.readings.take(now.joints, must_read)? {
            self.servo = None;
        }
        if self.servo.is_none() {
            self.begin(now.seen)?;
        }
        if self.readings.now().len() == self.readings.len() {
            self.limit(limits, dt)?;
        }
        let rows = &self.rows;
        self.errors.clear();
        self.errors.extend(rows.iter().flat_map(|goal| match find(now.seen, goal) {
            Some(seen) => [seen.pixel[0] - goal.pixel[0], seen.pixel[1] - goal.pixel[1]],
            None => [f64::NAN; 2],
        }));
        let Some(servo) = &mut self.servo else { return Ok(Decision::free(Command::Hold)) };
        let joints = self.readings.now();
        self.watch.judge(servo.estimate(), joints, &mut self.errors);
        let told = servo.step(joints, &self.errors, &self.limits, dt)?;
        let (phase, motion) = (told.phase.clone(), told.motion.to_vec());
        let (active, conflict) = (told.active.to_vec(), told.conflict.to_vec());
        // A tracker goes with either of its rows.
        for tracker in servo.dropped().iter().map(|row| row / 2).collect::<BTreeSet<usize>>() {
            self.watch.give_up(tracker);
            (2 * tracker..2 * tracker + 2).for_each(|row| servo.give_up(row));
        }
        self.watch.moves_from(joints);
        let mut sizes: Vec<f64> = self.errors.chunks(2).map(|error| error[0].hypot(error[1])).collect();
        sizes.retain(|size| size.is_finite());
        let error_px = sizes.iter().sum::<f64>() / sizes.len() as f64;
        let stop = stop_of(&phase, std::mem::replace(&mut self.error_px, error_px), error_px)?;
        let explores = self.phase() == Some(&Phase::Exploring);
        self.readings.moves(&motion);
        let command = if stop.is_some() { Command::Hold } else { self.command(&motion, dt)? };
        Ok(Decision { command, active, conflict, left_out: self.left_out().collect(), explores, stop })
    }
}
