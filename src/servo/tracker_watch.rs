//! Which trackers are believed.
use super::uncalibrated::Estimate;
use nalgebra::{DMatrix, DVector};

/// A watch over trackers, two rows of errors each: those that disagree with the others are left out.
///
/// One that jumps or freezes differs from what the last motion let expect by far more than the others do. One that drifts shows in that no
/// motion brings its error to 0 together with theirs. Both are judged against the other trackers of the same camera, so that slopes which are
/// wrong for all of a camera, as when it was moved, accuse none. Most of those that a camera sees are right: where more would be left out, the
/// slopes are wrong, and all are believed.
#[derive(Debug, Default)]
pub(super) struct TrackerWatch {
    doubted: Vec<Option<Doubt>>,
    /// The camera of each tracker.
    cameras: Vec<usize>,
    /// Where the joints were at the last judgement [rad or m].
    joints: Vec<f64>,
}

/// A tracker that is left out.
#[derive(Clone, Copy, Debug, Default)]
struct Doubt {
    /// Measurements in a row that agree with the others again.
    agrees: usize,
    /// Never to be believed again.
    for_good: bool,
}

/// A tracker is doubted where its squared surprise is this many times its variance, and this many times that of the median tracker: 2 degrees
/// of freedom exceed it in 1 of 300,000.
const SURPRISED: f64 = 25.0;
const BESIDE_OTHERS: f64 = 8.0;

/// The same for what no motion takes away.
const LEFT: f64 = 25.0;
const BESIDE_OTHERS_LEFT: f64 = 3.0;

/// Agreement again: within this many variances, so many times in a row; of errors whose standard deviation is at most so many of their noise.
const AGREES: f64 = 9.0;
const TIMES: usize = 5;
const VAGUE: f64 = 10.0;

/// Rows beyond those that determine the motion, without which nobody can be accused.
const SPARE: usize = 4;

impl TrackerWatch {
    /// Of trackers in these cameras, all believed.
    pub fn new(cameras: Vec<usize>) -> Self {
        TrackerWatch { doubted: vec![None; cameras.len()], cameras, joints: Vec::new() }
    }

    /// Trackers that are left out.
    pub fn left_out(&self) -> impl Iterator<Item = usize> {
        self.doubted.iter().enumerate().filter(|(_, doubt)| doubt.is_some()).map(|(tracker, _)| tracker)
    }

    /// Leaves a tracker out for good.
    pub fn give_up(&mut self, tracker: usize) {
        self.doubted[tracker] = Some(Doubt { agrees: 0, for_good: true });
    }

    /// Replaces the errors of trackers that are not believed by NaN. `estimate`: what was known before they were measured.
    pub fn judge(&mut self, estimate: Option<&Estimate>, joints: &[f64], errors: &mut [f64]) {
        let (Some(estimate), true) = (estimate, self.joints.len() == joints.len()) else {
            self.joints.clear();
            return;
        };
        let motion: Vec<f64> = joints.iter().zip(&self.joints).map(|(now, before)| now - before).collect();
        let surprise =
            |tracker: usize| surprise(estimate, tracker, &motion, [errors[2 * tracker], errors[2 * tracker + 1]]);
        let surprises: Vec<f64> = (0..self.doubted.len()).map(surprise).collect();
        let believed = |tracker: usize| self.doubted[tracker].is_none() && surprises[tracker].is_finite();
        let others: Vec<(usize, f64)> =
            (0..surprises.len()).filter(|&tracker| believed(tracker)).map(|i| (i, surprises[i])).collect();
        let spare = |left: usize| 2 * left >= joints.len() + SPARE;
        let mut left = others.len();
        for &(tracker, surprise) in &others {
            let accused = surprise > SURPRISED && surprise > BESIDE_OTHERS * self.usual(&others, tracker);
            if accused && spare(left - 1) {
                self.doubted[tracker] = Some(Doubt::default());
                left -= 1;
            }
        }
        self.believe_most(errors);
        self.judge_together(estimate, joints.len(), errors);
        for tracker in self.doubted.iter().enumerate().filter(|(_, doubt)| doubt.is_some()).map(|(tracker, _)| tracker)
        {
            errors[2 * tracker..2 * tracker + 2].fill(f64::NAN);
        }
    }

    /// Leaves out those whose errors do not go together with the others'.
    fn judge_together(&mut self, estimate: &Estimate, n: usize, errors: &[f64]) {
        loop {
            let believed: Vec<usize> = (0..self.doubted.len())
                .filter(|&tracker| self.doubted[tracker].is_none() && errors[2 * tracker].is_finite())
                .collect();
            if 2 * believed.len() < n + SPARE + 2 {
                return;
            }
            let Some((motion, left)) = left_together(estimate, &believed, n) else { return };
            let all: Vec<(usize, f64)> = believed.iter().copied().zip(left).collect();
            let Some(&(worst, left)) = all.iter().max_by(|a, b| a.1.total_cmp(&b.1)) else { return };
            if left < LEFT || left < BESIDE_OTHERS_LEFT * self.usual(&all, worst) {
                return self.believe_again(estimate, &motion, errors);
            }
            self.doubted[worst] = Some(Doubt::default());
            if self.believe_most(errors) {
                return;
            }
        }
    }

    /// Believes all trackers of a camera again where half of those that it sees, or more, are doubted; true where there is such a camera.
    fn believe_most(&mut self, errors: &[f64]) -> bool {
        let mut any = false;
        for camera in 0..=self.cameras.iter().copied().max().unwrap_or(0) {
            let seen = |tracker: &usize| self.cameras[*tracker] == camera && errors[2 * tracker].is_finite();
            let seen: Vec<usize> = (0..self.doubted.len()).filter(seen).collect();
            let may_err = |tracker: &&usize| self.doubted[**tracker].is_some_and(|doubt| !doubt.for_good);
            let doubted: Vec<usize> = seen.iter().filter(may_err).copied().collect();
            if !doubted.is_empty() && 2 * doubted.len() >= seen.len() {
                doubted.iter().for_each(|&tracker| self.doubted[tracker] = None);
                any = true;
            }
        }
        any
    }

    /// Believes trackers again whose errors are those that the motion asked for by the others takes away, where that says something.
    fn believe_again(&mut self, estimate: &Estimate, motion: &[f64], errors: &[f64]) {
        let back: Vec<f64> = motion.iter().map(|motion| -motion).collect();
        for (tracker, place) in self.doubted.iter_mut().enumerate() {
            let Some(doubt) = place.as_mut().filter(|doubt| !doubt.for_good) else { continue };
            let (mut misfit, mut vague) = (0.0, false);
            for (row, error) in errors.iter().enumerate().skip(2 * tracker).take(2) {
                let expected: f64 = estimate.slopes(row).iter().zip(&back).map(|(slope, back)| slope * back).sum();
                let variance = estimate.variance_along(row, motion);
                misfit += (error - expected).powi(2) / variance;
                vague |= variance > VAGUE * VAGUE * estimate.variance(row);
            }
            doubt.agrees = if misfit <= AGREES && !vague { doubt.agrees + 1 } else { 0 };
            if doubt.agrees >= TIMES {
                *place = None;
            }
        }
    }

    /// What the median tracker of the same camera shows, at least what is expected of 2 degrees of freedom.
    fn usual(&self, shown: &[(usize, f64)], tracker: usize) -> f64 {
        let same = shown.iter().filter(|(other, _)| self.cameras[*other] == self.cameras[tracker]);
        let mut same: Vec<f64> = same.map(|(_, value)| *value).collect();
        same.sort_by(f64::total_cmp);
        same.get(same.len() / 2).copied().unwrap_or(0.0).max(2.0)
    }

    /// Takes note of where the next motion begins.
    pub fn moves_from(&mut self, joints: &[f64]) {
        self.joints.clear();
        self.joints.extend_from_slice(joints);
    }
}

/// Squared surprise of a tracker over its variance, mean of both rows times 2; NaN where it was not seen.
fn surprise(estimate: &Estimate, tracker: usize, motion: &[f64], errors: [f64; 2]) -> f64 {
    let of = |axis: usize| {
        let [expected, variance] = estimate.foresee(2 * tracker + axis, motion);
        (errors[axis] - expected).powi(2) / variance
    };
    of(0) + of(1)
}

/// The motion that takes the errors away best, and for each tracker how much of its squared error over its variance no motion takes away, as a
/// χ² of 2 degrees of freedom. Slopes that are not known well widen the variance by what they leave open along the motion.
fn left_together(estimate: &Estimate, trackers: &[usize], n: usize) -> Option<(Vec<f64>, Vec<f64>)> {
    let rows: Vec<usize> = trackers.iter().flat_map(|&tracker| [2 * tracker, 2 * tracker + 1]).collect();
    let mut sds: Vec<f64> = rows.iter().map(|&row| estimate.variance(row).sqrt()).collect();
    let mut found = None;
    for _ in 0..2 {
        let slopes = DMatrix::from_fn(rows.len(), n, |i, k| estimate.slopes(rows[i])[k] / sds[i]);
        let errors = DVector::from_fn(rows.len(), |i, _| estimate.error(rows[i]) / sds[i]);
        let factors = slopes.qr();
        let basis = factors.q();
        let motion: DVector<f64> = -factors.r().solve_upper_triangular(&(basis.transpose() * &errors))?;
        sds = rows.iter().map(|&row| estimate.variance_along(row, motion.as_slice()).sqrt()).collect();
        found = Some((basis, errors, motion));
    }
    let (basis, errors, motion) = found?;
    let rest = &errors - &basis * (basis.transpose() * &errors);
    let of = |tracker: usize| {
        let q = basis.rows(2 * tracker, 2);
        let own = DMatrix::identity(2, 2) - q * q.transpose();
        let rest = rest.rows(2 * tracker, 2).into_owned();
        Some(rest.dot(&(own.try_inverse()? * &rest)))
    };
    let left = (0..trackers.len()).map(of).collect::<Option<Vec<f64>>>()?;
    Some((motion.as_slice().to_vec(), left))
}
