//! Exploratory motions: what is commanded, and the Jacobian that they show.
use super::estimate::{Estimate, dot};
use super::settings::{Exploration, Settings};
use super::signals::{Quantity, Row};
use nalgebra::{DMatrix, DVector};

/// An exploration under way. Waypoints are visited one after the other; each is the start plus a motion along one direction.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Explorer {
    directions: Vec<Vec<f64>>,
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

/// How near a waypoint must be, as a share of the motion to it.
const NEAR: f64 = 0.05;

/// Steps that trackers are waited for before the exploration goes on without them.
const LOST: usize = 5;

/// Steps that a waypoint, and trackers there, are waited for.
const PATIENCE: usize = 200;

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
    /// From where quantities and errors are now.
    pub fn new(settings: &Exploration, quantities: &[Quantity], at: &[f64], errors: &[f64]) -> Self {
        let n = quantities.len();
        let one = |i: usize| {
            let limits = &quantities[i].limits;
            let below = limits.lower.map_or(f64::INFINITY, |lower| at[i] - lower);
            let above = limits.upper.map_or(f64::INFINITY, |upper| upper - at[i]);
            // Where the motion may have to be enlarged, to the side with more room.
            let reach = if settings.clarity > 0.0 { settings.largest } else { settings.size };
            let way = if below < reach && above > below { 1.0 } else { -1.0 };
            (0..n).map(|k| if k == i { way } else { 0.0 }).collect()
        };
        let directions =
            if settings.directions.is_empty() { (0..n).map(one).collect() } else { settings.directions.clone() };
        Explorer {
            directions,
            start: at.to_vec(),
            errors: errors.to_vec(),
            motions: Vec::new(),
            changes: Vec::new(),
            size: settings.size,
            slack: quantities.iter().map(|quantity| quantity.dead_band.powi(2)).sum::<f64>().sqrt(),
            waits: 0,
            missing: 0,
            dropped: vec![false; errors.len()],
        }
    }

    /// Rows whose trackers were lost on the way, of which nothing is known.
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
        let there = arrived;
        if self.waits == 1 || !there && self.waits < PATIENCE {
            return Next::Towards(waypoint);
        }
        if k == self.directions.len() {
            return self.estimate(rows, curvature);
        }
        let motion: Vec<f64> = at.iter().zip(&self.start).map(|(now, start)| now - start).collect();
        let change = errors.iter().zip(&self.errors).zip(&self.dropped);
        let change: Vec<f64> = change.map(|((now, start), dropped)| if *dropped { 0.0 } else { now - start }).collect();
        if change.iter().any(|change| !change.is_finite()) {
            return Next::Failed("a tracker was lost while exploring".to_owned());
        }
        let clarity = clarity(&change, rows);
        if clarity < settings.clarity && self.size < settings.largest {
            // As far as it takes, judged by what was seen so far; at most four times as far, as that may be noise.
            let factor = (1.2 * settings.clarity / clarity).clamp(1.5, 4.0);
            self.size = (self.size * factor).min(settings.largest);
        } else {
            self.motions.push(motion);
            self.changes.push(change);
            self.size = settings.size;
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

/// Root mean square of changes over their rows' standard deviations.
fn clarity(change: &[f64], rows: &[Row]) -> f64 {
    let squares: f64 =
        change.iter().zip(rows).map(|(change, row)| (change / row.sd.max(f64::MIN_POSITIVE)).powi(2)).sum();
    (squares / rows.len().max(1) as f64).sqrt()
}
