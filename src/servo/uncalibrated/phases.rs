//! What each phase does: exploring, servoing, and what follows where the Jacobian is lost.
use super::controller::Uncalibrated;
use super::dither::Dither;
use super::estimate::{Estimate, dot};
use super::exploration::{Explorer, Next};
use super::settings::Update;
use super::signals::{Phase, Stop};
use super::views::coinciding;
use crate::servo::{LimitRows, Step};

/// Times that a lost Jacobian is replaced, by the last good one and by a fresh exploration in turns, before it is given up.
const LOSSES: usize = 6;

/// The last good estimate is at least this factor below the worst condition.
const GOOD: f64 = 2.0;

impl Uncalibrated {
    pub(super) fn explore(&mut self, readings: &[f64], errors: &[f64], limits: &LimitRows) -> Phase {
        let n = readings.len();
        if self.explorer.is_none() {
            // Rows that are lost when it is explored again may be lost for good.
            let (seen, all) = (self.seen.len(), errors.len());
            let needed = if self.losses == 0 { all } else { n };
            if seen < needed {
                return Phase::Waiting(format!("{seen} of {all} rows are seen; exploring begins with {needed}"));
            }
            if self.losses == 0
                && let Some([first, second]) = coinciding(&self.rows, errors)
            {
                return Phase::Stopped(Stop::Undetermined(format!(
                    "cameras {first} and {second} see the same and leave one point of view: put them apart"
                )));
            }
            self.explorer = Some(Explorer::new(&self.settings.exploration, &self.quantities, readings, errors));
        }
        let Some(explorer) = &mut self.explorer else { return Phase::Exploring };
        match explorer.next(&self.settings, &self.rows, readings, errors) {
            Next::Towards(there) => {
                self.go_towards(&there, readings, limits);
                Phase::Exploring
            }
            Next::Done(mut estimate) => {
                let (condition, worst) = (estimate.condition(), self.settings.worst_condition);
                let is_poor = condition.is_nan() || condition > worst;
                if is_poor {
                    let reason = format!(
                        "the exploratory motions look alike, with a condition number of {condition:.0} above {worst:.0}: \
                         see from more sides, or more features"
                    );
                    return self.has_not_found_out(reason, readings, errors, limits);
                }
                self.dropped = explorer.dropped().collect();
                self.explorer = None;
                self.seen.retain(|row| !self.dropped.contains(row));
                self.seen.iter().for_each(|&row| estimate.reset(row, errors[row]));
                self.estimate = Some(*estimate);
                self.servo(self.settings.gain, readings, errors, limits)
            }
            Next::Failed(reason) => self.has_not_found_out(reason, readings, errors, limits),
        }
    }

    /// Takes away a share of the errors, as far as that is safe.
    pub(super) fn servo(&mut self, gain: f64, readings: &[f64], errors: &[f64], limits: &LimitRows) -> Phase {
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
            Some(ahead) => ahead.refine(estimate, (readings, &self.limits), &self.seen, longest, &mut self.aim),
            None => None,
        };
        let mut share = gain;
        let mut slack = 0.0;
        if let Some(trust) = &self.settings.trust {
            let safe = self.aim.share(estimate, middle, &self.seen, share, trust, 0.5 * self.settings.divergence);
            (share, slack) = (share * safe.share, safe.slack);
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
        let adapts = !matches!(self.settings.update, Update::Keep) && self.losses < LOSSES;
        // Where something holds the motion back, it may be the Jacobian that asks for the wrong one.
        let is_excused = swallowed(1.0, 1.0) || !self.moved_as_told;
        let (left, noise) = (estimate.left(&self.seen), self.noise);
        if adapts && self.stall.judge(left, self.seen.len(), noise, is_excused) {
            return self.explore_anew(readings, errors, limits);
        }
        let is_free = adapts && !is_excused && !self.is_held && middle.is_none();
        let may_dither = is_free && converged && self.settings.dither > 0.0 && !self.has_dithered;
        if may_dither && self.seen.iter().all(|&row| self.whole.are_of(row)) {
            self.has_dithered = true;
            self.dither = Dither::new(&self.settings, estimate, &self.seen, readings);
            return self.dither(readings, errors, limits);
        }
        let mut trial = None;
        if let Some(trust) = &self.settings.trust
            && is_free
            && self.stall.tries(left, removable, self.seen.len(), n)
        {
            let longest = self.settings.exploration.largest;
            trial = self.aim.trial(estimate, &self.seen, trust, longest, slack);
        }
        if let Some(trial) = &trial {
            self.aim.motion.iter_mut().zip(trial).for_each(|(motion, trial)| *motion = share * *motion + trial);
            share = 1.0;
        }
        self.tasks[0].clear(n);
        for &row in &self.seen {
            let slopes = middle.unwrap_or(estimate).slopes(row);
            let wanted =
                if middle.is_some() || trial.is_some() { dot(slopes, &self.aim.motion) } else { -estimate.error(row) };
            let sd = middle.unwrap_or(estimate).variance(row).sqrt();
            self.tasks[0].push(slopes.iter().copied(), wanted, sd);
        }
        if restraint > 0.0 && trial.is_none() {
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

    /// Explores where it is, along the directions that show from most to least: each is then known by what it shows itself, where motions of
    /// single quantities leave those that hardly show in the errors of the others.
    fn explore_anew(&mut self, readings: &[f64], errors: &[f64], limits: &LimitRows) -> Phase {
        let directions = self.estimate.as_ref().and_then(|estimate| estimate.directions(&self.seen));
        self.stall.explores();
        self.losses += 1;
        (self.estimate, self.ahead) = (None, None);
        self.dropped_before = std::mem::take(&mut self.dropped);
        let settings = &self.settings.exploration;
        self.explorer = directions
            .map(|directions| Explorer::to_both_sides(&directions, settings, &self.quantities, readings, errors));
        self.explore(readings, errors, limits)
    }

    /// Exploring has led to nothing. Where it was done anew, what was known before stands, without the rows that it was done without and those
    /// whose trackers were lost meanwhile.
    fn has_not_found_out(&mut self, reason: String, readings: &[f64], errors: &[f64], limits: &LimitRows) -> Phase {
        let Some(good) = self.good.take_if(|_| self.losses > 0) else {
            return Phase::Stopped(Stop::Undetermined(reason));
        };
        self.dropped = std::mem::take(&mut self.dropped_before);
        let lost: Vec<usize> = self.explorer.iter().flat_map(Explorer::dropped).collect();
        lost.into_iter().for_each(|row| self.give_up(row));
        self.seen.retain(|row| !self.dropped.contains(row));
        self.go_back_to(good, readings, errors, limits)
    }

    fn go_back_to(&mut self, mut good: Estimate, readings: &[f64], errors: &[f64], limits: &LimitRows) -> Phase {
        self.seen.iter().for_each(|&row| good.reset(row, errors[row]));
        (self.estimate, self.explorer) = (Some(good), None);
        self.servo(self.settings.gain, readings, errors, limits)
    }

    /// Moves to where quantities shall be.
    pub(super) fn go_towards(&mut self, there: &[f64], readings: &[f64], limits: &LimitRows) {
        let n = readings.len();
        self.tasks[0].clear(n);
        for (i, (there, here)) in there.iter().zip(readings).enumerate() {
            self.tasks[0].push((0..n).map(|k| if k == i { 1.0 } else { 0.0 }), there - here, 1.0);
        }
        self.solve(limits);
    }

    fn solve(&mut self, limits: &LimitRows) {
        let Step { motion, active, conflict, .. } = self.solver.solve(&self.tasks, limits, &self.bounds);
        self.motion.copy_from_slice(motion);
        self.active.extend_from_slice(active);
        self.is_held = !self.active.is_empty();
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
            Some(good) => self.go_back_to(good, readings, errors, limits),
            None => {
                (self.estimate, self.ahead) = (None, None);
                self.dropped_before = std::mem::take(&mut self.dropped);
                self.seen.clear();
                self.seen.extend((0..errors.len()).filter(|row| errors[*row].is_finite()));
                self.explore(readings, errors, limits)
            }
        }
    }
}
