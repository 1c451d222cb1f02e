//! The controller: explores, servoes, and stops where it must.
use super::checks::check;
use super::estimate::{Estimate, dot};
use super::exploration::{Explorer, Next};
use super::foresight::{Ahead, Foresight};
use super::learning::{Lesson, learn};
use super::settings::Settings;
use super::signals::{Command, Phase, Quantity, Row, Stop};
use super::trust::Aim;
use super::views::coinciding;
use crate::Error;
use crate::rig::Limits;
use crate::servo::{Active, Constraint, JointBounds, LimitRows, MotionSolver, Step, TaskRows};

/// Servoing without a rig: quantities are moved so that rows of errors become 0. Kept from step to step.
pub struct Uncalibrated {
    settings: Settings,
    quantities: Vec<Quantity>,
    limits: Vec<Limits>,
    rows: Vec<Row>,
    phase: Phase,
    /// What a model says, which then takes the place of exploring.
    ahead: Option<Ahead>,
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
    /// Rows of which the exploration found out nothing.
    dropped: Vec<usize>,
    aim: Aim,
    bounds: JointBounds,
    tasks: [TaskRows; 1],
    solver: MotionSolver,
    motion: Vec<f64>,
    active: Vec<Active>,
    conflict: Vec<Constraint>,
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
            ahead: None,
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
            dropped: Vec::new(),
            aim: Aim::default(),
            bounds: JointBounds::default(),
            tasks: [TaskRows::default()],
            solver: MotionSolver::new(0.0),
            motion: vec![0.0; n],
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
        self.bounds.update(&self.limits, readings, &self.velocity, dt);
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
                self.solve(limits);
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
                self.dropped = explorer.dropped().collect();
                self.explorer = None;
                self.seen.retain(|row| !self.dropped.contains(row));
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
        if worst.is_finite() && condition < worst / GOOD && self.seen.len() + self.dropped.len() == errors.len() {
            match &mut self.good {
                Some(good) => good.clone_from(estimate),
                none => *none = Some(estimate.clone()),
            }
        }
        let removable = self.aim.removable();
        let longest = self.settings.trust.map_or(f64::INFINITY, |trust| trust.motion);
        let middle = match &mut self.ahead {
            Some(ahead) => ahead.refine(estimate, readings, &self.seen, longest, &mut self.aim),
            None => None,
        };
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
        let converged = removable <= n as f64 + 2.0 * (2.0 * n as f64).sqrt() || swallowed(1.0, 1.0);
        self.tasks[0].clear(n);
        for &row in &self.seen {
            let slopes = middle.unwrap_or(estimate).slopes(row);
            let wanted = if middle.is_some() { dot(slopes, &self.aim.motion) } else { -estimate.error(row) };
            let sd = middle.unwrap_or(estimate).variance(row).sqrt();
            self.tasks[0].push(slopes.iter().copied(), wanted, sd);
        }
        if restraint > 0.0 {
            let sd = self.aim.damping.sqrt().recip();
            (0..n).for_each(|i| self.tasks[0].push((0..n).map(|k| if k == i { 1.0 } else { 0.0 }), 0.0, sd));
        }
        self.tasks[0].share(0, share);
        self.solve(limits);
        for (motion, quantity) in self.motion.iter_mut().zip(&self.quantities) {
            if motion.abs() < quantity.dead_band {
                *motion = 0.0;
            }
        }
        if converged { Phase::Converged } else { Phase::Servoing }
    }

    fn solve(&mut self, limits: &LimitRows) {
        let Step { motion, active, conflict, .. } = self.solver.solve(&self.tasks, limits, &self.bounds);
        self.motion.copy_from_slice(motion);
        self.active.extend_from_slice(active);
        self.conflict.extend_from_slice(conflict);
    }

    /// The Jacobian does not determine a motion any more.
    fn lost(&mut self, readings: &[f64], errors: &[f64], limits: &LimitRows) -> Phase {
        let [seen, all] = [self.seen.len(), errors.len()];
        if seen + self.dropped.len() < all {
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
                (self.estimate, self.ahead) = (None, None);
                self.dropped.clear();
                self.seen.clear();
                self.seen.extend((0..errors.len()).filter(|row| errors[*row].is_finite()));
                self.explore(readings, errors, limits)
            }
        }
    }
}
