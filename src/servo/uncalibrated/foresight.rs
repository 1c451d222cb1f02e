//! What a model, right or outdated, says of the errors before anything has moved.
use super::estimate::{Estimate, dot};
use super::trust::Aim;
use crate::rig::Limits;
use nalgebra::DMatrix;

/// A model of rows of errors: the rig as it once was learned. It may be wrong; what is measured corrects it.
pub trait Foresight: Send {
    /// Errors [px] and their slopes where the quantities are `at`: one error per row, and as many slopes as quantities for each row in turn.
    fn predict(&mut self, at: &[f64], errors: &mut Vec<f64>, slopes: &mut Vec<f64>);

    /// Where the quantities would have to be for all errors to be 0, near to where they are; `None` where the model knows of no such place. It
    /// is where the search for a motion begins, beside the first-order motion.
    fn solution(&mut self, at: &[f64]) -> Option<Vec<f64>>;

    /// How well the slopes are known there: for each row the covariance of its slopes. `errors`: as they are measured there [px], NaN where a
    /// row is not seen.
    fn doubts(&mut self, at: &[f64], errors: &[f64]) -> Vec<DMatrix<f64>>;
}

/// A model, and what it said where things were last and where they may go.
pub(super) struct Ahead {
    pub model: Box<dyn Foresight>,
    here: Prediction,
    there: Prediction,
    /// The estimate as it would be there.
    estimate: Option<Estimate>,
    at: Vec<f64>,
    aim: Aim,
}

#[derive(Clone, Default)]
struct Prediction {
    errors: Vec<f64>,
    slopes: Vec<f64>,
}

/// Steps towards the motion that a curved model asks for, and the change below which there are no more of them, as a share of it.
const STEPS: usize = 8;
const SETTLED: f64 = 1e-3;

/// A motion that is asked for may take this many of the longest that are made.
const FAR: f64 = 2.0;

impl Ahead {
    pub fn new(model: Box<dyn Foresight>) -> Self {
        Ahead {
            model,
            here: Prediction::default(),
            there: Prediction::default(),
            estimate: None,
            at: Vec::new(),
            aim: Aim::default(),
        }
    }

    /// The first estimate, from the model alone. `None` where it says nothing of these rows, or no finite numbers.
    pub fn begin(&mut self, sds: &[f64], (at, errors): (&[f64], &[f64]), curvature: f64) -> Option<Estimate> {
        self.model.predict(at, &mut self.here.errors, &mut self.here.slopes);
        if [self.here.errors.len(), self.here.slopes.len()] != [sds.len(), sds.len() * at.len()] {
            return None;
        }
        let slopes = DMatrix::from_row_slice(sds.len(), at.len(), &self.here.slopes);
        Estimate::new(sds, &slopes, &self.model.doubts(at, errors), curvature).ok()
    }

    /// Looks from where things are now. What the slopes have changed by goes half into the estimate, which makes them those of the middle of
    /// the way; the other half follows when what was seen has been learned from ([`Ahead::carry_half`]).
    pub fn arrive(&mut self, at: &[f64], estimate: &mut Estimate) {
        std::mem::swap(&mut self.here, &mut self.there);
        self.model.predict(at, &mut self.here.errors, &mut self.here.slopes);
        self.carry_half(estimate);
    }

    pub fn carry_half(&self, estimate: &mut Estimate) {
        for row in 0..estimate.len() {
            estimate.carry(row, 0.5, [&self.there, &self.here].map(|prediction| prediction.slopes(row, estimate.n())));
        }
    }

    /// Follows the model from its own solution, or from the first-order motion of `aim`, to the motion that leaves no error which a motion could
    /// remove, and puts it into `aim`; to one that `limits` allow, where there is one. The slopes that are returned are those of the middle of
    /// the way, of which that motion is the solution. `None` where the model leads nowhere, or much farther than `longest`.
    pub fn refine(
        &mut self,
        estimate: &Estimate,
        (at, limits): (&[f64], &[Limits]),
        rows: &[usize],
        longest: f64,
        aim: &mut Aim,
    ) -> Option<&Estimate> {
        let away = |there: Vec<f64>| there.iter().zip(at).map(|(there, at)| there - at).collect::<Vec<f64>>();
        let solution = self.model.solution(at).filter(|solution| solution.len() == at.len());
        let starts = [solution.map(away), Some(aim.motion.clone())];
        let is_outside = |motion: &[f64]| {
            let mut all = at.iter().zip(motion).zip(limits);
            all.any(|((at, motion), limits)| {
                limits.lower.is_some_and(|lower| at + motion < lower)
                    || limits.upper.is_some_and(|upper| at + motion > upper)
            })
        };
        let mut best: Option<((bool, f64), Vec<f64>)> = None;
        for start in starts.into_iter().flatten() {
            if let Some((cost, motion)) = self.follow(estimate, at, rows, longest, start) {
                let rank = (is_outside(&motion), cost);
                if best.as_ref().is_none_or(|(least, _)| rank < *least) {
                    best = Some((rank, motion));
                }
            }
        }
        let (_, motion) = best?;
        self.look_along(estimate, at, &motion);
        let ahead = self.estimate.as_mut()?;
        let (after, before) = (left(ahead, ahead, rows), left(estimate, ahead, rows));
        if after.is_nan() || after >= before {
            return None;
        }
        for row in 0..ahead.len() {
            ahead.carry(row, -0.5, [&self.here, &self.there].map(|prediction| prediction.slopes(row, at.len())));
        }
        aim.motion = motion;
        Some(ahead)
    }

    /// Gauss-Newton from a motion, to what it leaves and where it leads.
    fn follow(
        &mut self,
        estimate: &Estimate,
        at: &[f64],
        rows: &[usize],
        longest: f64,
        mut motion: Vec<f64>,
    ) -> Option<(f64, Vec<f64>)> {
        for _ in 0..STEPS {
            self.look_along(estimate, at, &motion);
            if !self.aim.update(at.len(), self.estimate.as_ref()?, rows, 0.0) {
                return None;
            }
            motion.iter_mut().zip(&self.aim.motion).for_each(|(motion, more)| *motion += more);
            let square = dot(&motion, &motion);
            if square.is_nan() || square > (FAR * longest).powi(2) {
                return None;
            }
            if dot(&self.aim.motion, &self.aim.motion) <= SETTLED * SETTLED * square {
                break;
            }
        }
        self.look_along(estimate, at, &motion);
        let ahead = self.estimate.as_ref()?;
        // Minus twice the logarithm of the likelihood.
        let widths: f64 = rows.iter().map(|&row| ahead.variance(row).ln()).sum();
        Some((left(ahead, ahead, rows) + widths, motion))
    }

    /// The estimate as it would be after a motion: by the model, and by what has been learned of its slopes.
    fn look_along(&mut self, estimate: &Estimate, at: &[f64], motion: &[f64]) {
        self.at.clear();
        self.at.extend(at.iter().zip(motion).map(|(at, motion)| at + motion));
        self.model.predict(&self.at, &mut self.there.errors, &mut self.there.slopes);
        let mut ahead = estimate.clone();
        for row in 0..estimate.len() {
            let [here, there] = [&self.here, &self.there].map(|prediction| prediction.slopes(row, at.len()));
            let learned: f64 =
                estimate.slopes(row).iter().zip(here).zip(motion).map(|((all, of), d)| (all - of) * d).sum();
            let change =
                self.there.errors.get(row).zip(self.here.errors.get(row)).map_or(0.0, |(there, here)| there - here);
            ahead.shift(row, change + learned);
            ahead.carry(row, 1.0, [here, there]);
            // A camera that has moved leads where the others do, until the motions that are left are small.
            ahead.doubt_along(row, motion);
        }
        self.estimate = Some(ahead);
    }
}

/// Sum of the squared errors of one estimate over the variances of another.
fn left(errors: &Estimate, variances: &Estimate, rows: &[usize]) -> f64 {
    rows.iter().map(|&row| errors.error(row).powi(2) / variances.variance(row)).sum()
}

impl Prediction {
    fn slopes(&self, row: usize, n: usize) -> &[f64] {
        self.slopes.get(row * n..(row + 1) * n).unwrap_or_default()
    }
}
