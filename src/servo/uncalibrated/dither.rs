//! Dither: motions by which trackers of whole pixels tell more than a pixel.
use super::controller::Uncalibrated;
use super::estimate::{Estimate, dot};
use super::settings::Settings;
use super::signals::Phase;
use crate::servo::LimitRows;
use nalgebra::DMatrix;

/// Places around where errors are noise, which are visited once. Where things stand still, whole pixels are the same again and again; where they
/// move by about a pixel, what rounding leaves out differs from place to place and is averaged, and slopes are learned where they matter.
pub(super) struct Dither {
    start: Vec<f64>,
    /// From the start to the places, the next one last.
    offsets: Vec<Vec<f64>>,
    /// Readings and errors where it has been.
    visited: Vec<(Vec<f64>, Vec<f64>)>,
    waits: usize,
    /// By how much the errors may grow at the places [px].
    growth: f64,
}

/// Errors may grow by this share of [`Settings::divergence`] along each direction, and along all.
const GROWTH: f64 = 0.4;

/// How far the first place is, as a share of the others.
const FIRST: f64 = 0.5;

/// How near a place must be, as a share of the way to it from the start, and steps that it is waited for.
const NEAR: f64 = 0.1;
const PATIENCE: usize = 20;

impl Dither {
    /// Around where quantities are, by [`Settings::dither`] along each of the directions of what some rows show; `None` where they are not found.
    ///
    /// A place lies to one or the other side along all directions at once: a two-level design of as many places as the next power of two,
    /// in which all directions are at right angles to each other and to the mean. The first place is half as far, and the others are nearer
    /// where errors grow there by more than they should.
    pub fn new(settings: &Settings, estimate: &Estimate, rows: &[usize], at: &[f64]) -> Option<Self> {
        let n = at.len();
        let slopes = DMatrix::from_fn(rows.len(), n, |i, k| estimate.slopes(rows[i])[k]);
        let shown = slopes.svd(false, true);
        let directions = shown.v_t?;
        let confidence = settings.trust.map_or(0.0, |trust| trust.confidence);
        let motion = |i: usize| {
            let along: Vec<f64> = directions.row(i).iter().copied().collect();
            let growth = |&row: &usize| {
                dot(estimate.slopes(row), &along).abs() + confidence * estimate.doubt(row, &along).sqrt()
            };
            let growth: f64 = rows.iter().map(growth).sum();
            let wanted = settings.dither * (rows.len() as f64).sqrt() / shown.singular_values[i];
            let size = wanted.min(GROWTH * settings.divergence / growth).min(settings.exploration.largest);
            along.iter().map(|along| size * along).collect()
        };
        let motions: Vec<Vec<f64>> = (0..n).map(motion).collect();
        let places = (n + 1).next_power_of_two();
        let offset = |place: usize| {
            let side = |i: usize| if ((i + 1) & place).count_ones().is_multiple_of(2) { 1.0 } else { -1.0 };
            (0..n).map(|k| (0..n).map(|i| side(i) * motions[i][k]).sum()).collect()
        };
        let mut offsets: Vec<Vec<f64>> = (0..places).rev().map(offset).collect();
        offsets.iter_mut().last()?.iter_mut().for_each(|offset| *offset *= FIRST);
        let growth = GROWTH * settings.divergence;
        Some(Dither { start: at.to_vec(), offsets, visited: Vec::new(), waits: 0, growth })
    }

    /// Takes in what is seen where things are now; the next place to go to, or `None` after the last.
    fn next(&mut self, at: &[f64], errors: &[f64]) -> Option<Vec<f64>> {
        let place = |offset: &Vec<f64>| self.start.iter().zip(offset).map(|(start, offset)| start + offset).collect();
        if let Some(offset) = self.offsets.last().filter(|_| !self.visited.is_empty()) {
            let there: Vec<f64> = place(offset);
            let away: f64 = there.iter().zip(at).map(|(there, here)| (there - here).powi(2)).sum();
            self.waits += 1;
            if away > NEAR * NEAR * dot(offset, offset) && self.waits < PATIENCE {
                return Some(there);
            }
            self.offsets.pop();
        }
        self.visited.push((at.to_vec(), errors.to_vec()));
        self.waits = 0;
        if let [(_, start), (_, first)] = &self.visited[..] {
            let change = |(start, now): (&f64, &f64)| Some(now.abs() - start.abs()).filter(|change| change.is_finite());
            let grown: f64 = start.iter().zip(first).filter_map(change).sum();
            let share = (self.growth * FIRST / grown.max(f64::MIN_POSITIVE)).min(1.0);
            self.offsets.iter_mut().flatten().for_each(|offset| *offset *= share);
        }
        self.offsets.last().map(place)
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
    /// Goes to the next place. After the last, errors and slopes are what all of them say.
    pub(super) fn dither(&mut self, readings: &[f64], errors: &[f64], limits: &LimitRows) -> Phase {
        let (Some(mut dither), Some(estimate)) = (self.dither.take(), &mut self.estimate) else {
            return Phase::Exploring;
        };
        let is_seen = |(_, before): &(Vec<f64>, Vec<f64>)| self.seen.iter().all(|row| before[*row].is_finite());
        if !dither.visited.iter().all(is_seen) {
            return self.servo(readings, errors, limits);
        }
        if let Some(there) = dither.next(readings, errors) {
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
        self.servo(readings, errors, limits)
    }
}
