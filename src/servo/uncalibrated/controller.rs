//! The controller: what goes in, what comes out, and which phase follows.
use super::checks::check;
use super::dither::Dither;
use super::estimate::{Estimate, dot};
use super::exploration::Explorer;
use super::foresight::{Ahead, Foresight};
use super::learning::{Lesson, learn};
use super::settings::Settings;
use super::signals::{Command, Phase, Quantity, Row, Stop};
use super::stall::Stall;
use super::trust::Aim;
use super::whole_pixels::WholePixels;
use crate::Error;
use crate::rig::Limits;
use crate::servo::{Active, Constraint, JointBounds, LimitRows, MotionSolver, TaskRows};

/// Servoing without a rig: quantities are moved so that rows of errors become 0. Kept from step to step.
pub struct Uncalibrated {
    pub(super) settings: Settings,
    pub(super) quantities: Vec<Quantity>,
    pub(super) limits: Vec<Limits>,
    pub(super) rows: Vec<Row>,
    pub(super) phase: Phase,
    /// What a model says, which then takes the place of exploring.
    pub(super) ahead: Option<Ahead>,
    /// While exploring.
    pub(super) explorer: Option<Explorer>,
    pub(super) estimate: Option<Estimate>,
    /// The last estimate whose condition was good, and how often it was needed.
    pub(super) good: Option<Estimate>,
    pub(super) losses: usize,
    /// Rows of an estimate that was handed in whose errors were not measured yet.
    pub(super) unmeasured: Vec<usize>,
    /// Readings and errors of the step before; empty before the first, NaN where a row was not seen.
    pub(super) readings: Vec<f64>,
    pub(super) errors: Vec<f64>,
    /// Motion since then.
    pub(super) moved: Vec<f64>,
    pub(super) velocity: Vec<f64>,
    pub(super) stall: Stall,
    /// Rows of whole pixels; while they are dithered, and whether they were.
    pub(super) whole: WholePixels,
    pub(super) dither: Option<Dither>,
    pub(super) has_dithered: bool,
    /// Whether something held the last motion back.
    pub(super) is_held: bool,
    /// Whether things moved since as they were told to.
    pub(super) moved_as_told: bool,
    /// Mean square of what the last motion changed otherwise than expected, over the variance of a difference.
    pub(super) noise: f64,
    /// Rows that are seen now.
    pub(super) seen: Vec<usize>,
    /// Rows of which the exploration found out nothing, and those of which the one before had not.
    pub(super) dropped: Vec<usize>,
    pub(super) dropped_before: Vec<usize>,
    pub(super) aim: Aim,
    pub(super) bounds: JointBounds,
    pub(super) tasks: [TaskRows; 1],
    pub(super) solver: MotionSolver,
    pub(super) motion: Vec<f64>,
    /// The motion before.
    pub(super) told: Vec<f64>,
    pub(super) active: Vec<Active>,
    pub(super) conflict: Vec<Constraint>,
}

impl Uncalibrated {
    /// Errors: [`Error::Unusable`] where there is no quantity, where there are fewer rows than quantities, or where a setting or a
    /// standard deviation is not what it may be.
    pub fn new(quantities: Vec<Quantity>, rows: Vec<Row>, settings: Settings) -> Result<Self, Error> {
        check(&quantities, &rows, &settings).map_err(Error::Unusable)?;
        let n = quantities.len();
        Ok(Uncalibrated {
            limits: quantities.iter().map(|quantity| quantity.limits).collect(),
            phase: Phase::default(),
            ahead: None,
            explorer: None,
            estimate: None,
            good: None,
            losses: 0,
            stall: Stall::default(),
            whole: WholePixels::new(rows.len()),
            dither: None,
            has_dithered: false,
            is_held: false,
            moved_as_told: false,
            noise: 1.0,
            unmeasured: Vec::new(),
            readings: Vec::new(),
            errors: Vec::new(),
            moved: vec![0.0; n],
            velocity: vec![0.0; n],
            seen: Vec::new(),
            dropped: Vec::new(),
            dropped_before: Vec::new(),
            aim: Aim::default(),
            bounds: JointBounds::default(),
            tasks: [TaskRows::default()],
            solver: MotionSolver::new(0.0),
            motion: vec![0.0; n],
            told: vec![0.0; n],
            active: Vec::new(),
            conflict: Vec::new(),
            settings,
            quantities,
            rows,
        })
    }

    /// Begins with what is known already instead of exploring, such as the slopes of a rig that may have changed since.
    ///
    /// Errors: [`Error::Unusable`] where it is not of these rows and quantities.
    pub fn begin_with(&mut self, estimate: Estimate) -> Result<(), Error> {
        let [m, n] = [self.rows.len(), self.quantities.len()];
        if estimate.len() != m || estimate.n() != n {
            return Err(Error::Unusable(format!("an estimate of other rows than these {m} with {n} slopes each")));
        }
        (self.estimate, self.explorer, self.phase) = (Some(estimate), None, Phase::Servoing);
        (self.ahead, self.good, self.losses) = (None, None, 0);
        self.stall = Stall::default();
        (self.dither, self.has_dithered) = (None, false);
        self.unmeasured = (0..m).collect();
        self.dropped.clear();
        self.readings.clear();
        self.errors.clear();
        Ok(())
    }

    /// Begins with what a model says instead of exploring, and follows it as far as it is right: what is measured corrects its slopes, and
    /// those of a camera of which it turns out to be wrong are learned anew on the way.
    pub fn begin_with_model(&mut self, model: Box<dyn Foresight>) {
        (self.ahead, self.explorer, self.estimate) = (Some(Ahead::new(model)), None, None);
        (self.good, self.losses) = (None, 0);
        self.stall = Stall::default();
        (self.dither, self.has_dithered) = (None, false);
        self.unmeasured.clear();
        self.dropped.clear();
        self.readings.clear();
        self.errors.clear();
    }

    /// What shall be seen has moved: errors change by this much [px] without any motion, one number per row.
    ///
    /// Errors: [`Error::Unusable`] where there are not as many numbers as rows, or one is not finite.
    pub fn shift(&mut self, changes: &[f64]) -> Result<(), Error> {
        if changes.len() != self.rows.len() || changes.iter().any(|change| !change.is_finite()) {
            let (found, m) = (changes.len(), self.rows.len());
            return Err(Error::Unusable(format!("{found} changes of errors, where {m} finite ones are wanted")));
        }
        self.errors.iter_mut().zip(changes).for_each(|(error, change)| *error += change);
        self.stall.shifts();
        (self.dither, self.has_dithered) = (None, false);
        if let Some(explorer) = &mut self.explorer {
            explorer.shift(changes);
        }
        for estimate in [&mut self.estimate, &mut self.good].into_iter().flatten() {
            changes.iter().enumerate().for_each(|(row, change)| estimate.shift(row, *change));
        }
        Ok(())
    }

    /// What is known of the errors and their slopes; `None` while exploring for the first time.
    pub fn estimate(&self) -> Option<&Estimate> {
        self.estimate.as_ref()
    }

    /// Rows that are not used, as trackers were lost or drifted while exploring.
    pub fn dropped(&self) -> &[usize] {
        &self.dropped
    }

    /// Uses a row no more: it goes with one that was dropped.
    pub(in crate::servo) fn give_up(&mut self, row: usize) {
        if !self.dropped.contains(&row) {
            self.dropped.push(row);
        }
    }

    /// What is being done.
    pub fn phase(&self) -> &Phase {
        &self.phase
    }

    /// The motion of the next `dt` seconds.
    ///
    /// `readings`: where each quantity is, in its unit; where a robot reads nothing, the sum of the motions so far. `errors`: what is seen
    /// minus what shall be seen [px], NaN where it is not seen or too old. `limits`: rows that the motion obeys beside the quantities' own
    /// limits.
    ///
    /// Errors: [`Error::Unusable`] where there are not as many readings and errors as quantities and rows.
    pub fn step(
        &mut self,
        readings: &[f64],
        errors: &[f64],
        limits: &LimitRows,
        dt: f64,
    ) -> Result<Command<'_>, Error> {
        let [n, m] = [self.quantities.len(), self.rows.len()];
        if [readings.len(), errors.len()] != [n, m] {
            let found = [readings.len(), errors.len()];
            return Err(Error::Unusable(format!(
                "{} readings and {} errors, where {n} and {m} are wanted",
                found[0], found[1]
            )));
        }
        self.told.copy_from_slice(&self.motion);
        self.motion.fill(0.0);
        self.active.clear();
        self.conflict.clear();
        if matches!(self.phase, Phase::Stopped(_)) {
            return Ok(self.command());
        }
        self.phase = match self.readable(readings, dt) {
            Err(reason) => Phase::Waiting(reason),
            Ok(()) => {
                self.take_in(readings, errors, dt);
                let phase = self.decide(readings, errors, limits);
                self.readings.clear();
                self.readings.extend_from_slice(readings);
                self.errors.clear();
                self.errors.extend_from_slice(errors);
                phase
            }
        };
        if matches!(self.phase, Phase::Waiting(_) | Phase::Stopped(_)) {
            self.motion.fill(0.0);
        }
        Ok(self.command())
    }

    fn command(&self) -> Command<'_> {
        Command { motion: &self.motion, phase: &self.phase, active: &self.active, conflict: &self.conflict }
    }

    fn readable(&self, readings: &[f64], dt: f64) -> Result<(), String> {
        if let Some(i) = readings.iter().position(|reading| !reading.is_finite()) {
            return Err(format!("the reading of `{}` is {}", self.quantities[i].name, readings[i]));
        }
        if dt > 0.0 && dt.is_finite() { Ok(()) } else { Err(format!("a time step of {dt} s")) }
    }

    fn take_in(&mut self, readings: &[f64], errors: &[f64], dt: f64) {
        for (i, reading) in readings.iter().enumerate() {
            self.moved[i] = self.readings.get(i).map_or(0.0, |before| reading - before);
            self.velocity[i] = self.moved[i] / dt;
        }
        let told = dot(&self.told, &self.told);
        self.moved_as_told = told > 0.0 && dot(&self.told, &self.moved) > 0.5 * told;
        self.bounds.update(&self.limits, readings, &self.velocity, dt);
        self.whole.take_in(&self.errors, errors);
        self.seen.clear();
        self.seen.extend((0..errors.len()).filter(|row| errors[*row].is_finite() && !self.dropped.contains(row)));
    }

    fn decide(&mut self, readings: &[f64], errors: &[f64], limits: &LimitRows) -> Phase {
        if let (Some(ahead), None) = (&mut self.ahead, &self.estimate) {
            let sds: Vec<f64> = self.rows.iter().map(|row| row.sd).collect();
            self.estimate = ahead.begin(&sds, (readings, errors), self.settings.curvature);
            if self.estimate.is_some() {
                self.unmeasured = (0..errors.len()).collect();
            } else {
                // A model that says nothing is none.
                self.ahead = None;
            }
        } else if let (Some(ahead), Some(estimate)) = (&mut self.ahead, &mut self.estimate) {
            ahead.arrive(readings, estimate);
        }
        let (Some(estimate), None) = (&mut self.estimate, &self.explorer) else {
            return self.explore(readings, errors, limits);
        };
        (0..errors.len()).for_each(|row| estimate.see_whole(row, self.whole.are_of(row)));
        let changes =
            self.seen.iter().map(|&row| errors[row].abs() - self.errors.get(row).map_or(f64::NAN, |error| error.abs()));
        let growth: f64 = changes.filter(|change| change.is_finite()).sum();
        if growth > self.settings.divergence {
            return Phase::Stopped(Stop::Diverged { growth });
        }
        let unmeasured = &mut self.unmeasured;
        let of_known: Vec<usize>;
        let seen = if unmeasured.is_empty() {
            &self.seen
        } else {
            of_known = self.seen.iter().copied().filter(|row| !unmeasured.contains(row)).collect();
            &of_known
        };
        self.noise = estimate.noise(seen, &self.moved, &self.errors, errors);
        let modelled = self.ahead.is_some().then_some(&self.rows[..]);
        let lesson = Lesson { motion: &self.moved, before: &self.errors, now: errors, seen, modelled };
        learn(self.settings.update, self.settings.curvature, estimate, &lesson);
        if let (Some(ahead), false) = (&self.ahead, self.readings.is_empty()) {
            ahead.carry_half(estimate);
        }
        // The first error of a row is no surprise to its slopes.
        unmeasured.retain(|&row| {
            let is_seen = errors[row].is_finite();
            if is_seen {
                estimate.reset(row, errors[row]);
            }
            !is_seen
        });
        if self.dither.is_some() {
            return self.dither(readings, errors, limits);
        }
        self.servo(self.settings.gain, readings, errors, limits)
    }
}
