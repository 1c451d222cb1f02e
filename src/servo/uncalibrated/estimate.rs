//! What is known of the errors and of how they change with what is controlled: a Kalman filter per row.
use super::whole_pixels::{self, ROUNDED, beside_rounding, between};
use crate::Error;
use nalgebra::DMatrix;

/// Errors, their slopes, and the covariance of both; rows are independent of each other.
///
/// A row's state is (e, j). A motion d turns it into (e + j·d + w·d / 2, j + w), with w normal of covariance (κ |d| s)² S: s is the root mean
/// square of the row's slopes and κ the curvature. S = (1 - β) I + β n Jᵀ J / |J|²: slopes along directions that hardly show change less, as
/// most of a change mixes and scales rows. With S = I, what a large motion teaches would be put down to just these directions.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    n: usize,
    /// Per row: the error [px] and its slopes.
    states: Vec<f64>,
    /// Per row: covariance of the state.
    covariances: Vec<f64>,
    /// Per row: variance of the noise [px²], mean square of the slopes.
    variances: Vec<f64>,
    scales: Vec<f64>,
    /// Per row, whether it is seen in whole pixels.
    whole: Vec<bool>,
    /// S, with J as explored.
    shape: Vec<f64>,
    /// κ, as far as it is known by now.
    pub(super) curvature: f64,
    work: Vec<f64>,
    /// S d.
    bent: Vec<f64>,
}

/// β.
const ALIKE: f64 = 0.94;

/// How far a target wanders in one step, as a share of a row's standard deviation: what is seen of it is averaged over the last few steps,
/// which suits trackers that round and trackers that scatter.
const WANDER: f64 = 0.5;

/// Noise below this is taken for this [px].
const LEAST_SD: f64 = 1e-6;

impl Estimate {
    /// From slopes by rows, and for each row the covariance of its slopes, n x n. `sds`: standard deviation of each row's noise [px];
    /// `curvature`: κ. Errors are 0 until they are measured.
    ///
    /// Errors: [`Error::Unusable`] where shapes do not fit, or numbers are not finite.
    pub fn new(
        sds: &[f64],
        slopes: &DMatrix<f64>,
        covariances: &[DMatrix<f64>],
        curvature: f64,
    ) -> Result<Self, Error> {
        let n = slopes.ncols();
        let (size, m) = (n + 1, sds.len());
        let is_shaped = |covariance: &DMatrix<f64>| covariance.shape() == (n, n);
        if n == 0 || slopes.nrows() != m || covariances.len() != m || !covariances.iter().all(is_shaped) {
            let (rows, found) = (slopes.nrows(), covariances.len());
            return Err(Error::Unusable(format!(
                "{m} standard deviations, {rows} rows of {n} slopes and {found} covariances: as many of each are needed, covariances of \
                 {n} by {n}"
            )));
        }
        let mut numbers = sds
            .iter()
            .chain(slopes.iter())
            .chain(covariances.iter().flat_map(|covariance| covariance.iter()))
            .chain([&curvature]);
        if numbers.any(|number| !number.is_finite()) {
            return Err(Error::Unusable("an estimate needs finite numbers".to_owned()));
        }
        let mut estimate = Estimate {
            n,
            states: vec![0.0; m * size],
            covariances: vec![0.0; m * size * size],
            variances: sds.iter().map(|sd| sd.max(LEAST_SD).powi(2)).collect(),
            scales: Vec::new(),
            whole: vec![false; m],
            shape: shape(slopes),
            curvature,
            work: vec![0.0; n],
            bent: vec![0.0; n],
        };
        for (row, covariance) in covariances.iter().enumerate() {
            let of_slopes = slopes.row(row);
            estimate.scales.push(of_slopes.norm_squared() / n as f64);
            estimate.states[row * size + 1..(row + 1) * size]
                .copy_from_slice(&of_slopes.iter().copied().collect::<Vec<_>>());
            let entries = &mut estimate.covariances[row * size * size..(row + 1) * size * size];
            for i in 0..n {
                for j in 0..n {
                    entries[(i + 1) * size + j + 1] = covariance[(i, j)];
                }
            }
        }
        Ok(estimate)
    }

    /// Number of quantities.
    pub(super) fn n(&self) -> usize {
        self.n
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.variances.len()
    }

    /// True where there is none.
    pub fn is_empty(&self) -> bool {
        self.variances.is_empty()
    }

    /// Error of a row as far as known [px].
    pub fn error(&self, row: usize) -> f64 {
        self.states[row * (self.n + 1)]
    }

    /// Slopes of a row.
    pub fn slopes(&self, row: usize) -> &[f64] {
        let size = self.n + 1;
        &self.states[row * size + 1..(row + 1) * size]
    }

    /// Variance of a row's noise [px²].
    pub fn variance(&self, row: usize) -> f64 {
        self.variances[row]
    }

    /// Takes a row for one that is seen in whole pixels, or not.
    pub(super) fn see_whole(&mut self, row: usize, is_whole: bool) {
        self.whole[row] = is_whole;
    }

    /// Mean square of a row's slopes when they were explored.
    pub(super) fn scale(&self, row: usize) -> f64 {
        self.scales[row]
    }

    /// Covariance of a row's slopes.
    pub fn covariance(&self, row: usize) -> DMatrix<f64> {
        let size = self.n + 1;
        let entries = &self.covariances[row * size * size..];
        DMatrix::from_fn(self.n, self.n, |i, j| entries[(i + 1) * size + j + 1])
    }

    /// Variance of a row's change by a motion, from what is not known of its slopes [px²].
    pub(super) fn doubt(&self, row: usize, motion: &[f64]) -> f64 {
        let size = self.n + 1;
        let entries = &self.covariances[row * size * size..(row + 1) * size * size];
        let along = |i: usize| dot(&entries[(i + 1) * size + 1..(i + 2) * size], motion);
        motion.iter().enumerate().map(|(i, motion)| motion * along(i)).sum()
    }

    /// Up to how much some rows' errors change by a motion, in sum [px]: by slopes, and as many standard deviations of what is not known of them.
    pub(super) fn reach(&self, rows: &[usize], motion: &[f64], confidence: f64) -> f64 {
        let of = |&row: &usize| dot(self.slopes(row), motion).abs() + confidence * self.doubt(row, motion).sqrt();
        rows.iter().map(of).sum()
    }

    /// Condition number of the slopes over the rows' standard deviations.
    pub fn condition(&self) -> f64 {
        let scaled = DMatrix::from_fn(self.len(), self.n, |row, i| self.slopes(row)[i] / self.variances[row].sqrt());
        let values = scaled.singular_values();
        if self.len() < self.n { f64::INFINITY } else { values.max() / values.min() }
    }

    /// Sum of the squared errors of some rows over their variances.
    pub(super) fn left(&self, rows: &[usize]) -> f64 {
        rows.iter().map(|&row| self.error(row).powi(2) / self.variances[row]).sum()
    }

    /// By how much errors of some rows have changed otherwise than a motion lets expect: mean square over the variance of a difference. 1 of
    /// rows that were not seen before [px].
    pub(super) fn noise(&self, rows: &[usize], motion: &[f64], before: &[f64], now: &[f64]) -> f64 {
        let surprise = |row: &usize| {
            let change = now[*row] - before.get(*row)?;
            let square = (change - dot(self.slopes(*row), motion)).powi(2) / (2.0 * self.variances[*row]);
            square.is_finite().then_some(square)
        };
        let (sum, count) =
            rows.iter().filter_map(surprise).fold((0.0, 0.0), |(sum, n), square| (sum + square, n + 1.0));
        if count > 0.0 { sum / count } else { 1.0 }
    }

    /// Directions of unit length at right angles to each other, from the one that shows most in some rows to the one that shows least, each with
    /// what it shows: root mean square of the slopes along it over the rows' standard deviations. `None` where they are not found.
    pub(super) fn directions(&self, rows: &[usize]) -> Option<Vec<(Vec<f64>, f64)>> {
        let scaled = |i: usize, k: usize| self.slopes(rows[i])[k] / self.variances[rows[i]].sqrt();
        let found = DMatrix::from_fn(rows.len(), self.n, scaled).svd(false, true);
        let shows = found.singular_values.iter().map(|value| value / (rows.len() as f64).sqrt());
        Some(found.v_t?.row_iter().map(|direction| direction.iter().copied().collect()).zip(shows).collect())
    }

    /// Variance by which a row's target wanders in a step [px²].
    fn wander(&self, row: usize) -> f64 {
        if self.whole[row] { whole_pixels::WANDER } else { WANDER * WANDER * self.variances[row] }
    }

    /// Everything has moved, and slopes have changed by a curvature on the way.
    pub(super) fn moved(&mut self, motion: &[f64], curvature: f64) {
        let (n, size) = (self.n, self.n + 1);
        let square: f64 = dot(motion, motion);
        self.bent.iter_mut().zip(self.shape.chunks(n)).for_each(|(bent, line)| *bent = dot(line, motion));
        let bend = dot(&self.bent, motion);
        for row in 0..self.variances.len() {
            let wander = self.wander(row);
            let state = &mut self.states[row * size..(row + 1) * size];
            state[0] += dot(&state[1..], motion);
            let entries = &mut self.covariances[row * size * size..(row + 1) * size * size];
            let spread = curvature * curvature * square * self.scales[row];
            let mut own = entries[0] + 0.25 * spread * bend + wander;
            for i in 0..n {
                let across = entries[i + 1];
                let along = dot(&entries[(i + 1) * size + 1..(i + 2) * size], motion);
                own += motion[i] * (2.0 * across + along);
                self.work[i] = across + along + 0.5 * spread * self.bent[i];
            }
            entries[0] = own;
            for i in 0..n {
                (entries[i + 1], entries[(i + 1) * size]) = (self.work[i], self.work[i]);
                let line = &mut entries[(i + 1) * size + 1..(i + 2) * size];
                line.iter_mut().zip(&self.shape[i * n..]).for_each(|(entry, shape)| *entry += spread * shape);
            }
        }
    }

    /// An error was measured [px]. Of whole pixels it is known to lie within half a pixel, and where it was known better already, nothing new.
    pub(super) fn measured(&mut self, row: usize, error: f64) {
        let size = self.n + 1;
        let state = &mut self.states[row * size..(row + 1) * size];
        let entries = &mut self.covariances[row * size * size..(row + 1) * size * size];
        let [mut total, mut surprise, mut told] = [entries[0] + self.variances[row], error - state[0], 1.0];
        if self.whole[row] {
            total = entries[0] + beside_rounding(self.variances[row]);
            let sd = total.sqrt();
            let [mean, variance] = between((surprise - 0.5) / sd, (surprise + 0.5) / sd);
            (surprise, told) = (sd * mean, 1.0 - variance);
        }
        self.work.copy_from_slice(&entries[1..size]);
        let own = entries[0] / total;
        state[0] += own * surprise;
        for (i, &across) in self.work.iter().enumerate() {
            state[i + 1] += across / total * surprise;
            let line = &mut entries[(i + 1) * size + 1..(i + 2) * size];
            line.iter_mut().zip(&self.work).for_each(|(entry, other)| *entry -= told * across * other / total);
        }
        entries[0] *= 1.0 - told * own;
        for i in 1..size {
            entries[i] *= 1.0 - told * own;
            entries[i * size] = entries[i];
        }
    }

    /// Takes an error for what it is measured to be [px], and its noise for independent of the slopes.
    pub(super) fn reset(&mut self, row: usize, error: f64) {
        let size = self.n + 1;
        self.states[row * size] = error;
        let entries = &mut self.covariances[row * size * size..(row + 1) * size * size];
        for i in 1..size {
            (entries[i], entries[i * size]) = (0.0, 0.0);
        }
        entries[0] = self.variances[row];
    }

    /// Takes over a row's error [px] and slopes that were found from whole pixels, and their covariance over the variance of each.
    pub(super) fn relearn(&mut self, row: usize, state: &[f64], covariance: &DMatrix<f64>) {
        let (size, variance) = (self.n + 1, ROUNDED + beside_rounding(self.variances[row]));
        self.states[row * size..(row + 1) * size].copy_from_slice(state);
        let entries = &mut self.covariances[row * size * size..(row + 1) * size * size];
        entries.iter_mut().zip(covariance.iter()).for_each(|(entry, covariance)| *entry = variance * covariance);
    }

    /// What shall be seen has moved: a row's error with it [px].
    pub(super) fn shift(&mut self, row: usize, by: f64) {
        self.states[row * (self.n + 1)] += by;
    }

    /// Counts a row's errors as less certain by what is not known of its slopes along a motion.
    pub(super) fn doubt_along(&mut self, row: usize, motion: &[f64]) {
        self.variances[row] += self.doubt(row, motion);
    }

    /// Adds to a row's slopes a share of what a model says they have changed by.
    pub(super) fn carry(&mut self, row: usize, share: f64, [before, now]: [&[f64]; 2]) {
        let size = self.n + 1;
        let slopes = &mut self.states[row * size + 1..(row + 1) * size];
        let changes = before.iter().zip(now).map(|(before, now)| share * (now - before));
        slopes.iter_mut().zip(changes).for_each(|(slope, change)| *slope += change);
    }

    /// What a row's error is expected to be after a motion [px], and the variance of what is then measured [px²].
    pub fn foresee(&self, row: usize, motion: &[f64]) -> [f64; 2] {
        [self.error(row) + dot(self.slopes(row), motion), self.variance_along(row, motion)]
    }

    /// Variance of a row that is measured after a motion [px²].
    pub fn variance_along(&self, row: usize, motion: &[f64]) -> f64 {
        self.variance_bent(row, motion, self.bend(motion))
    }

    /// The same, of a motion's [`Estimate::bend`].
    pub(super) fn variance_bent(&self, row: usize, motion: &[f64], bend: f64) -> f64 {
        let size = self.n + 1;
        let entries = &self.covariances[row * size * size..(row + 1) * size * size];
        let across = dot(&entries[1..size], motion);
        entries[0]
            + 2.0 * across
            + self.doubt(row, motion)
            + self.scales[row] * bend
            + (1.0 + WANDER * WANDER) * self.variances[row]
    }

    /// Variance of a row's change by a motion, from slopes that change on the way, over the mean square of its slopes.
    pub(super) fn bend(&self, motion: &[f64]) -> f64 {
        let along: f64 = motion.iter().zip(self.shape.chunks(self.n)).map(|(d, line)| d * dot(line, motion)).sum();
        0.25 * self.curvature.powi(2) * dot(motion, motion) * along
    }

    /// Counts each of a row's slopes as less certain by a variance.
    pub(super) fn loosen(&mut self, row: usize, variance: f64) {
        let size = self.n + 1;
        let entries = &mut self.covariances[row * size * size..(row + 1) * size * size];
        (1..size).for_each(|i| entries[i * size + i] += variance);
    }

    /// Forgets: the covariance of all slopes grows by a factor.
    pub(super) fn forget(&mut self, factor: f64) {
        let size = self.n + 1;
        for line in self.covariances.chunks_mut(size).enumerate().filter(|(i, _)| i % size != 0).map(|(_, line)| line) {
            line[1..].iter_mut().for_each(|entry| *entry *= factor);
        }
    }

    /// Changes a row's slopes by a multiple of a motion.
    pub(super) fn tilt(&mut self, row: usize, factor: f64, motion: &[f64]) {
        let size = self.n + 1;
        let slopes = &mut self.states[row * size + 1..(row + 1) * size];
        slopes.iter_mut().zip(motion).for_each(|(slope, motion)| *slope += factor * motion);
    }
}

/// S of the slopes.
fn shape(slopes: &DMatrix<f64>) -> Vec<f64> {
    let (n, square) = (slopes.ncols(), slopes.norm_squared());
    let seen = if square > 0.0 { slopes.transpose() * slopes * (n as f64 / square) } else { DMatrix::identity(n, n) };
    (DMatrix::identity(n, n) * (1.0 - ALIKE) + seen * ALIKE).as_slice().to_vec()
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
