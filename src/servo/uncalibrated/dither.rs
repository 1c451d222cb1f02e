//! Dither: motions by which trackers of whole pixels tell more than a pixel.
use super::controller::Uncalibrated;
use super::estimate::{Estimate, dot};
use super::settings::Settings;
use super::signals::Phase;
use crate::servo::LimitRows;
use nalgebra::DMatrix;

/// Places around where errors are noise, which are visited once. Where things stand still, whole pixels are the same again and again; where they
/// move by about a pixel, what rounding leaves out differs from place to place and is averaged, and slopes are learned where they matter.
///
/// A place lies to one or the other side along all directions at once: a two-level design, in which all directions are at right angles to each
/// other and to the mean, and then the same places on the other side of the middle, so that what bends evenly does not tilt slopes.
pub(super) struct Dither {
    start: Vec<f64>,
    /// From the one that shows most to the one that shows least, and how far to go along each.
    directions: Vec<(Vec<f64>, f64)>,
    /// Of each place that is left, whether it is on the other side along each direction; the next one is last.
    left: Vec<Vec<bool>>,
    /// Where it is going to, and steps since.
    there: Option<Vec<f64>>,
    waits: usize,
    /// Readings and errors where it has been.
    visited: Vec<(Vec<f64>, Vec<f64>)>,
}

/// Errors may grow by this share of [`Settings::divergence`] along each direction.
const GROWTH: f64 = 0.25;

/// How near a place must be, as a share of the way to it from the start, and steps that it is waited for before it is the last.
const NEAR: f64 = 0.1;
const PATIENCE: usize = 20;

impl Dither {
    /// Around where quantities are, by [`Settings::dither`] along each of the directions of what some rows show; `None` where they are not found.
    pub fn new(settings: &Settings, estimate: &Estimate, rows: &[usize], at: &[f64]) -> Option<Self> {
        let n = at.len();
        let with_size = |(along, _): (Vec<f64>, f64)| {
            let squares: f64 = rows.iter().map(|&row| dot(estimate.slopes(row), &along).powi(2)).sum();
            let size = settings.dither / (squares / rows.len() as f64).sqrt();
            (along, size.min(settings.exploration.largest))
        };
        let directions = estimate.directions(rows)?.into_iter().map(with_size).collect();
        let places = (n + 1).next_power_of_two();
        let side = |place: usize, i: usize| !((i + 1) & place).count_ones().is_multiple_of(2);
        let sides = |other: bool| (0..places).map(move |place| (0..n).map(|i| side(place, i) ^ other).collect());
        let left = sides(true).rev().chain(sides(false).rev()).collect();
        Some(Dither { start: at.to_vec(), directions, left, there: None, waits: 0, visited: Vec::new() })
    }

    /// Takes in what is seen where things are now; the next place to go to, or `None` after the last. Places are nearer where errors may grow by too
    /// much along a direction, which is known better with each of them.
    fn next(
        &mut self,
        settings: &Settings,
        estimate: &Estimate,
        rows: &[usize],
        (at, errors): (&[f64], &[f64]),
    ) -> Option<Vec<f64>> {
        if let Some(there) = &self.there {
            let square = |a: &[f64]| a.iter().zip(there).map(|(a, there)| (a - there).powi(2)).sum::<f64>();
            self.waits += 1;
            if square(at) > NEAR * NEAR * square(&self.start) && self.waits < PATIENCE {
                return Some(there.clone());
            }
            if self.waits >= PATIENCE {
                self.left.clear();
            }
        }
        self.visited.push((at.to_vec(), errors.to_vec()));
        self.waits = 0;
        let sides = self.left.pop()?;
        let confidence = settings.trust.map_or(0.0, |trust| trust.confidence);
        let mut there = self.start.clone();
        for ((along, wanted), is_other) in self.directions.iter().zip(sides) {
            let size = wanted.min(GROWTH * settings.divergence / estimate.reach(rows, along, confidence));
            let way = if is_other { -size } else { size };
            there.iter_mut().zip(along).for_each(|(there, along)| *there += way * along);
        }
        self.there = Some(there.clone());
        Some(there)
    }

    /// Errors where things are now and their slopes, from all places by least squares: per row, with the covariance of each over its noise.
    fn found(&self, rows: &[usize]) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
        let (now, _) = self.visited.last()?;
        let from_now = |i: usize, k: usize| if k == 0 { 1.0 } else { self.visited[i].0[k - 1] - now[k - 1] };
        let places = DMatrix::from_fn(self.visited.len(), now.len() + 1, from_now);
        let errors = DMatrix::from_fn(self.visited.len(), rows.len(), |i, k| self.visited[i].1[rows[k]]);
        let covariance = (places.transpose() * &places).try_inverse()?;
        Some(((&covariance * places.transpose() * errors).transpose(), covariance))
    }
}

impl Uncalibrated {
    /// Goes to the next place. After the last, errors and slopes are what all of them say, and a whole step is made by them.
    pub(super) fn dither(&mut self, readings: &[f64], errors: &[f64], limits: &LimitRows) -> Phase {
        let (Some(mut dither), Some(estimate)) = (self.dither.take(), &mut self.estimate) else {
            return Phase::Exploring;
        };
        let is_seen = |(_, before): &(Vec<f64>, Vec<f64>)| self.seen.iter().all(|row| before[*row].is_finite());
        if !dither.visited.iter().all(is_seen) {
            return self.servo(self.settings.gain, readings, errors, limits);
        }
        if let Some(there) = dither.next(&self.settings, estimate, &self.seen, (readings, errors)) {
            self.dither = Some(dither);
            self.go_towards(&there, readings, limits);
            return Phase::Exploring;
        }
        if let Some((states, covariance)) = dither.found(&self.seen) {
            for (state, &row) in states.row_iter().zip(&self.seen) {
                let state: Vec<f64> = state.iter().copied().collect();
                estimate.relearn(row, &state, &covariance);
            }
        }
        // All that is to be seen here was seen: what is left is taken away at once.
        self.servo(1.0, readings, errors, limits)
    }
}
