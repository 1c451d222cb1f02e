//! The controller: explores, servoes, and stops where it must.
use super::checks::check;
use super::estimate::Estimate;
use super::exploration::{Explorer, Next};
use super::learning::{Lesson, learn};
use super::settings::Settings;
use super::signals::{Command, Phase, Quantity, Row, Stop};
use super::trust::Aim;
use super::views::coinciding;
use crate::Error;
use crate::rig::Limits;
use crate::servo::{JointBounds, LimitRows, MotionSolver, TaskRows};

/// Servoing without a rig: quantities are moved so that rows of errors become 0. Kept from step to step.
pub struct Uncalibrated {
    settings: Settings,
    quantities: Vec<Quantity>,
    limits: Vec<Limits>,
    rows: Vec<Row>,
    phase: Phase,
    /// While exploring.
    explorer: Option<Explorer>,
    estimate: Option<Estimate>,
    /// The last estimate whose condition was good, and how often it was needed.
    good: Option<Estimate>,
    losses: usize,
    /// Rows of an estimate that was handed in whose errors were not measured yet.
    unmeasured: Vec<usize>,
    /// Readings and errors of the step before; empty before the first, NaN where a row was not seen.
    readings: Vec<f64>,
    errors: Vec<f64>,
    /// Motion since then.
    moved: Vec<f64>,
    velocity: Vec<f64>,
    /// Rows that are seen now.
    seen: Vec<usize>,
    aim: Aim,
    bounds: JointBounds,
    tasks: [TaskRows; 1],
    solver: MotionSolver,
    motion: Vec<f64>,
}

/// Times that a lost Jacobian is replaced, by the last good one and by a fresh exploration in turns, before it is given up.
const LOSSES: usize = 6;

/// The last good estimate is at least this factor below the worst condition.
const GOOD: f64 = 2.0;

impl Uncalibrated {
    /// Errors: [`Error::Unusable`] where there is no quantity, where there are fewer rows than quantities, or where a setting or a
    /// standard deviation is not what it may be.
    pub fn new(quantities: Vec<Quantity>, rows: Vec<Row>, settings: Settings) -> Result<Self, Error> {
        check(&quantities, &rows, &settings).map_err(Error::Unusable)?;
        let n = quantities.len();
        Ok(Uncalibrated {
            limits: quantities.iter().map(|quantity| quantity.limits).collect(),
            phase: Phase::default(),
            explorer: None,
            estimate: None,
            good: None,
            losses: 0,
            unmeasured: Vec::new(),
            readings: Vec::new(),
            errors: Vec::new(),
            moved: vec![0.0; n],
            velocity: vec![0.0; n],
            seen: Vec::new(),
            aim: Aim::default(),
            bounds: JointBounds::default(),
            tasks: [TaskRows::default()],
            solver: MotionSolver::new(0.0),
            motion: vec![0.0; n],
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
        (self.good, self.losses) = (None, 0);
        self.unmeasured = (0..m).collect();
        self.readings.clear();
        self.errors.clear();
        Ok(())
    }

    /// What is known of the errors and their slopes; `None` while exploring for the first time.
    pub fn estimate(&self) -> Option<&Estimate> {
        self.estimate.as_ref()
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
        self.motion.fill(0.0);
        if matches!(self.phase, Phase::Stopped(_)) {
            return Ok(Command { motion: &self.motion, phase: &self.phase });
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
        Ok(Command { motion: &self.motion, phase: &self.phase })
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
        self.bounds.update(&self.limits, readings, &self.velocity, dt);
        self.seen.clear();
        self.seen.extend((0..errors.len()).filter(|row| errors[*row].is_finite()));
    }

    fn decide(&mut self, readings: &[f64], errors: &[f64], limits: &LimitRows) -> Phase {
        let (Some(estimate), None) = (&mut self.estimate, &self.explorer) else {
            return self.explore(readings, errors, limits);
        };
        let pairs = self.errors.iter().zip(errors).filter(|(before, now)| before.is_finite() && now.is_finite());
        let growth: f64 = pairs.map(|(before, now)| now.abs() - before.abs()).sum();
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
        let lesson = Lesson { motion: &self.moved, before: &self.errors, now: errors, seen };
        learn(self.settings.update, self.settings.curvature, estimate, &lesson);
        // The first error of a row is no surprise to its slopes.
        unmeasured.retain(|&row| {
            let is_seen = errors[row].is_finite();
            if is_seen {
                estimate.reset(row, errors[row]);
            }
            !is_seen
        });
        self.servo(readings, errors, limits)
    }

    fn explore(&mut self, readings: &[f64], errors: &[f64], limits: &LimitRows) -> Phase {
        let n = readings.len();
        if self.explorer.is_none() {
            if self.seen.len() < errors.len() {
                let [seen, all] = [self.seen.len(), errors.len()];
                return Phase::Waiting(format!("{seen} of {all} rows are seen; exploring begins with all"));
            }
            if let Some([first, second]) = coinciding(&self.rows, errors) {
                return Phase::Stopped(Stop::Undetermined(format!(
                    "cameras {first} and {second} see the same and leave one point of view: put them apart"
                )));
            }
            self.explorer = Some(Explorer::new(&self.settings.exploration, &self.quantities, readings, errors));
        }
        let Some(explorer) = &mut self.explorer else { return Phase::Exploring };
        match explorer.next(&self.settings, &self.rows, readings, errors) {
            Next::Towards(there) => {
                self.tasks[0].clear(n);
                for (i, (there, here)) in there.iter().zip(readings).enumerate() {
                    self.tasks[0].push((0..n).map(|k| if k == i { 1.0 } else { 0.0 }), there - here, 1.0);
                }
                self.motion.copy_from_slice(&self.solver.solve(&self.tasks, limits, &self.bounds).motion);
                Phase::Exploring
            }
            Next::Done(mut estimate) => {
                let (condition, worst) = (estimate.condition(), self.settings.worst_condition);
                if condition.is_nan() || condition > worst {
                    return Phase::Stopped(Stop::Undetermined(format!(
                        "the exploratory motions look alike, with a condition number of {condition:.0} above {worst:.0}: \
                         see from more sides, or more features"
                    )));
                }
                self.explorer = None;
                self.seen.iter().for_each(|&row| estimate.reset(row, errors[row]));
                self.estimate = Some(*estimate);
                self.servo(readings, errors, limits)
            }
            Next::Failed(reason) => Phase::Stopped(Stop::Undetermined(reason)),
        }
    }

    fn servo(&mut self, readings: &[f64], errors: &[f64], limits: &LimitRows) -> Phase {
        let n = readings.len();
        let Some(estimate) = &mut self.estimate else { return Phase::Exploring };
        let restraint = self.settings.trust.map_or(0.0, |trust| trust.restraint);
        let determined = self.aim.update(n, estimate, &self.seen, restraint);
        let condition = if determined { self.aim.condition } else { f64::INFINITY };
        let worst = self.settings.worst_condition;
        if !determined || condition > worst {
            return self.lost(readings, errors, limits);
        }
        if worst.is_finite() && condition < worst / GOOD && self.seen.len() == errors.len() {
            match &mut self.good {
                Some(good) => good.clone_from(estimate),
                none => *none = Some(estimate.clone()),
            }
        }
        let mut share = self.settings.gain;
        if let Some(trust) = &self.settings.trust {
            share *= self.aim.share(estimate, &self.seen, share, trust, 0.5 * self.settings.divergence);
        }
        let swallowed = |gain: f64, factor: f64| {
            let mut all = self.aim.motion.iter().zip(&self.quantities);
            all.all(|(motion, quantity)| gain * motion.abs() <= factor * quantity.dead_band)
        };
        // What is left is of the size of a dead band: a whole step gets nearer than a share of one, which would be swallowed.
        if swallowed(share, 2.0) {
            share = 1.0;
        }
        let converged = self.aim.removable() <= n as f64 + 2.0 * (2.0 * n as f64).sqrt() || swallowed(1.0, 1.0);
        self.tasks[0].clear(n);
        for &row in &self.seen {
            let slopes = estimate.slopes(row).iter().copied();
            self.tasks[0].push(slopes, -estimate.error(row), estimate.variance(row).sqrt());
        }
        if restraint > 0.0 {
            let sd = self.aim.damping.sqrt().recip();
            (0..n).for_each(|i| self.tasks[0].push((0..n).map(|k| if k == i { 1.0 } else { 0.0 }), 0.0, sd));
        }
        self.tasks[0].share(0, share);
        self.motion.copy_from_slice(&self.solver.solve(&self.tasks, limits, &self.bounds).motion);
        for (motion, quantity) in self.motion.iter_mut().zip(&self.quantities) {
            if motion.abs() < quantity.dead_band {
                *motion = 0.0;
            }
        }
        if converged { Phase::Converged } else { Phase::Servoing }
    }

    /// The Jacobian does not determine a motion any more.
    fn lost(&mut self, readings: &[f64], errors: &[f64], limits: &LimitRows) -> Phase {
        let [seen, all] = [self.seen.len(), errors.len()];
        if seen < all {
            return Phase::Waiting(format!("{seen} of {all} rows are seen, which do not determine a motion"));
        }
        self.losses += 1;
        match self.good.take() {
            _ if self.losses > LOSSES => Phase::Stopped(Stop::Undetermined(
                "the Jacobian lost its rank again and again: see from more sides, or more features".to_owned(),
            )),
            Some(mut good) => {
                self.seen.iter().for_each(|&row| good.reset(row, errors[row]));
                self.estimate = Some(good);
                self.servo(readings, errors, limits)
            }
            None => {
                self.estimate = None;
                self.explore(readings, errors, limits)
            }
        }
    }
}
