//! Exploratory motions: what is commanded, and the Jacobian that they show.
use super::estimate::{Estimate, dot};
use super::settings::{Exploration, Settings};
use super::signals::{Quantity, Row};
use nalgebra::{DMatrix, DVector};

/// An exploration under way. Waypoints are visited one after the other; each is the start plus a motion along one direction.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Explorer {
    directions: Vec<Vec<f64>>,
    /// How far there is room along each, and how far the first motion goes.
    rooms: Vec<f64>,
    sizes: Vec<f64>,
    /// Where it started, and the errors there [px].
    start: Vec<f64>,
    errors: Vec<f64>,
    /// Motions from the start, and the changes of the errors [px].
    motions: Vec<Vec<f64>>,
    changes: Vec<Vec<f64>>,
    /// Along the present direction; one direction past the last is the way back.
    size: f64,
    /// How far from a waypoint dead bands may leave it.
    slack: f64,
    waits: usize,
    /// Steps for which a row was missing where everything else was ready, and the rows that were given up for it.
    missing: usize,
    dropped: Vec<bool>,
}

/// Standard deviations of what is seen that a motion need not exceed where slopes are known: they are then known to 5 %.
const CLEAR: f64 = 30.0;

/// How near a waypoint must be, as a share of the motion to it.
const NEAR: f64 = 0.05;

/// Steps that trackers are waited for before the exploration goes on without them.
const LOST: usize = 5;

/// Steps that a waypoint is waited for.
const PATIENCE: usize = 200;

/// A row has drifted where it comes back to the start off by this many variances, and by this many times those of the median row: others are
/// off too where the arm did not come back. 1 degree of freedom exceeds the first in 1 of 2,000,000.
const DRIFTED: f64 = 25.0;
const BESIDE_OTHERS: f64 = 8.0;

/// What comes next.
pub(super) enum Next {
    /// To go somewhere [unit of each quantity].
    Towards(Vec<f64>),
    /// Back where it started: this is known.
    Done(Box<Estimate>),
    /// It cannot be known, for this reason.
    Failed(String),
}

impl Explorer {
    /// From where quantities and errors are now, along the directions of the settings.
    pub fn new(settings: &Exploration, quantities: &[Quantity], at: &[f64], errors: &[f64]) -> Self {
        let n = quantities.len();
        // Where the motion may have to be enlarged, to the side with more room.
        let reach = if settings.clarity > 0.0 { settings.largest } else { settings.size };
        let one = |i: usize| {
            let down: Vec<f64> = (0..n).map(|k| if k == i { -1.0 } else { 0.0 }).collect();
            let up: Vec<f64> = down.iter().map(|along| -along).collect();
            let [below, above] = [room(&down, quantities, at), room(&up, quantities, at)];
            if below < reach && above > below { up } else { down }
        };
        let directions =
            if settings.directions.is_empty() { (0..n).map(one).collect() } else { settings.directions.clone() };
        let sizes = vec![settings.size; directions.len()];
        Self::along((directions, sizes), quantities, at, errors)
    }

    /// To both sides along each of some directions, as far as there is room: what bends evenly then cancels. No farther than it takes to tell what
    /// is seen from noise, as far as known from [`Estimate::directions`]. Where there is no room along one of them, as [`Explorer::new`].
    pub fn to_both_sides(
        directions: &[(Vec<f64>, f64)],
        settings: &Exploration,
        quantities: &[Quantity],
        at: &[f64],
        errors: &[f64],
    ) -> Self {
        let (mut sides, mut sizes) = (Vec::new(), Vec::new());
        for (along, shows) in directions {
            let size = settings.size.min(CLEAR / shows);
            let both = [1.0, -1.0].map(|way| along.iter().map(|a| way * a).collect::<Vec<f64>>());
            sides.extend(both.into_iter().filter(|along| room(along, quantities, at) >= size));
            if sides.len() == sizes.len() {
                return Explorer::new(settings, quantities, at, errors);
            }
            sizes.resize(sides.len(), size);
        }
        Self::along((sides, sizes), quantities, at, errors)
    }

    fn along(
        (directions, sizes): (Vec<Vec<f64>>, Vec<f64>),
        quantities: &[Quantity],
        at: &[f64],
        errors: &[f64],
    ) -> Self {
        Explorer {
            rooms: directions.iter().map(|along| room(along, quantities, at)).collect(),
            size: sizes.first().copied().unwrap_or(0.0),
            directions,
            sizes,
            start: at.to_vec(),
            errors: errors.to_vec(),
            motions: Vec::new(),
            changes: Vec::new(),
            slack: quantities.iter().map(|quantity| quantity.dead_band.powi(2)).sum::<f64>().sqrt(),
            waits: 0,
            missing: 0,
            dropped: errors.iter().map(|error| !error.is_finite()).collect(),
        }
    }

    /// Rows whose trackers were lost on the way or did not come back to where they had been, of which nothing is known.
    pub fn dropped(&self) -> impl Iterator<Item = usize> {
        self.dropped.iter().enumerate().filter(|(_, dropped)| **dropped).map(|(row, _)| row)
    }

    /// From what is seen where things are now.
    pub fn next(&mut self, settings: &Settings, rows: &[Row], at: &[f64], errors: &[f64]) -> Next {
        let (curvature, settings) = (settings.curvature, &settings.exploration);
        let k = self.motions.len();
        let waypoint = self.waypoint();
        let away: f64 = waypoint.iter().zip(at).map(|(there, here)| (there - here).powi(2)).sum();
        let arrived = away.sqrt() <= self.slack.max(NEAR * self.size);
        let is_seen = errors.iter().zip(&self.dropped).all(|(error, dropped)| *dropped || error.is_finite());
        self.waits += 1;
        if arrived && !is_seen {
            self.missing += 1;
            if self.missing < LOST {
                return Next::Towards(waypoint);
            }
            self.dropped.iter_mut().zip(errors).for_each(|(dropped, error)| *dropped |= !error.is_finite());
            let left = self.dropped.iter().filter(|dropped| !**dropped).count();
            if left < at.len() {
                let n = at.len();
                return Next::Failed(format!(
                    "trackers were lost while exploring: the {left} rows that are left do not determine {n} quantities"
                ));
            }
        }
        self.missing = 0;
        if self.waits == 1 || !arrived && self.waits < PATIENCE {
            return Next::Towards(waypoint);
        }
        if k == self.directions.len() {
            return self.close(rows, at, errors, curvature);
        }
        let motion = self.motion(at);
        let change = errors.iter().zip(&self.errors).zip(&self.dropped);
        let change: Vec<f64> = change.map(|((now, start), dropped)| if *dropped { 0.0 } else { now - start }).collect();
        if change.iter().any(|change| !change.is_finite()) {
            return Next::Failed("a tracker was lost while exploring".to_owned());
        }
        let clarity = clarity(&change, rows, &self.dropped);
        let largest = settings.largest.min(self.rooms[k].max(self.sizes[k]));
        if clarity < settings.clarity && self.size < largest {
            // As far as it takes, judged by what was seen so far; at most four times as far, as that may be noise.
            let factor = (1.2 * settings.clarity / clarity).clamp(1.5, 4.0);
            self.size = (self.size * factor).min(largest);
        } else {
            self.motions.push(motion);
            self.changes.push(change);
            self.size = self.sizes.get(k + 1).copied().unwrap_or(self.size);
        }
        self.waits = 1;
        Next::Towards(self.waypoint())
    }

    /// What shall be seen has moved, and all errors with it [px].
    pub fn shift(&mut self, changes: &[f64]) {
        self.errors.iter_mut().zip(changes).for_each(|(error, change)| *error += change);
    }

    fn waypoint(&self) -> Vec<f64> {
        match self.directions.get(self.motions.len()) {
            Some(direction) => {
                self.start.iter().zip(direction).map(|(start, along)| start + self.size * along).collect()
            }
            None => self.start.clone(),
        }
    }

    fn motion(&self, at: &[f64]) -> Vec<f64> {
        at.iter().zip(&self.start).map(|(now, start)| now - start).collect()
    }

    /// Back at the start, every row shall be where it was: those that are not are dropped.
    fn close(&mut self, rows: &[Row], at: &[f64], errors: &[f64], curvature: f64) -> Next {
        let next = self.estimate(rows, curvature);
        let Next::Done(estimate) = &next else { return next };
        let motion = self.motion(at);
        let off = |row: usize| {
            let expected = dot(estimate.slopes(row), &motion);
            let variance = 2.0 * estimate.variance(row) + expected * expected;
            (errors[row] - self.errors[row] - expected).powi(2) / variance
        };
        let off: Vec<(usize, f64)> =
            (0..rows.len()).filter(|&row| !self.dropped[row]).map(|row| (row, off(row))).collect();
        let mut sorted: Vec<f64> = off.iter().map(|(_, off)| *off).collect();
        sorted.sort_by(f64::total_cmp);
        let usual = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
        for (row, off) in off {
            self.dropped[row] |= off > DRIFTED.max(BESIDE_OTHERS * usual);
        }
        if self.dropped().next().is_none() { next } else { self.estimate(rows, curvature) }
    }

    /// Least squares over all motions: O J = D, with rows of O the motions and of D the changes.
    fn estimate(&self, rows: &[Row], curvature: f64) -> Next {
        let (n, k) = (self.start.len(), self.motions.len());
        let motions = DMatrix::from_fn(k, n, |motion, i| self.motions[motion][i]);
        let change = |motion: usize, row: usize| if self.dropped[row] { 0.0 } else { self.changes[motion][row] };
        let changes = DMatrix::from_fn(k, rows.len(), change);
        let Some(inverse) = (motions.transpose() * &motions).try_inverse() else {
            return Next::Failed("the exploratory motions do not move every quantity".to_owned());
        };
        let from_changes = inverse * motions.transpose();
        let slopes = (&from_changes * changes).transpose();
        // Noise of each end, and of the start, which all motions share; and a bend of half the curvature along each motion.
        let ones = &from_changes * DVector::from_element(k, 1.0);
        let noise = &from_changes * from_changes.transpose() + &ones * ones.transpose();
        let bends = DMatrix::from_diagonal(&DVector::from_iterator(
            k,
            self.motions.iter().map(|motion| (0.5 * curvature * dot(motion, motion)).powi(2)),
        ));
        let bend = &from_changes * bends * from_changes.transpose();
        let covariance = |(row, seen): (usize, &Row)| {
            let scale = slopes.row(row).norm_squared() / n as f64;
            &noise * seen.sd.powi(2) + &bend * scale
        };
        let covariances: Vec<DMatrix<f64>> = rows.iter().enumerate().map(covariance).collect();
        let sds: Vec<f64> = rows.iter().map(|row| row.sd).collect();
        match Estimate::new(&sds, &slopes, &covariances, curvature) {
            Ok(estimate) => Next::Done(Box::new(estimate)),
            Err(_) => Next::Failed("the exploratory motions gave slopes that are not finite".to_owned()),
        }
    }
}

/// How far the limits let things move along a direction.
fn room(along: &[f64], quantities: &[Quantity], at: &[f64]) -> f64 {
    let of = |((along, quantity), at): ((&f64, &Quantity), &f64)| {
        let end = if *along > 0.0 { quantity.limits.upper } else { quantity.limits.lower };
        match end {
            Some(end) if *along != 0.0 => ((end - at) / along).max(0.0),
            _ => f64::INFINITY,
        }
    };
    along.iter().zip(quantities).zip(at).map(of).fold(f64::INFINITY, f64::min)
}

/// Root mean square of changes over their rows' standard deviations, of rows that are not dropped.
fn clarity(change: &[f64], rows: &[Row], dropped: &[bool]) -> f64 {
    let known = change.iter().zip(rows).zip(dropped).filter(|(_, dropped)| !**dropped);
    let square = |change: f64, sd: f64| (change / sd.max(f64::MIN_POSITIVE)).powi(2);
    let (sum, n) = known.fold((0.0, 0.0), |(sum, n), ((change, row), _)| (sum + square(*change, row.sd), n + 1.0));
    (sum / f64::max(n, 1.0)).sqrt()
}
