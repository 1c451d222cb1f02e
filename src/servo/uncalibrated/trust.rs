//! How far an estimated Jacobian is followed: a motion without limits, its damping, the share of it that is safe, and what is tried where no
//! motion helps.
use super::estimate::{Estimate, dot};
use super::settings::Trust;
use nalgebra::DMatrix;

/// The damped Gauss-Newton step of an estimate's rows; kept from step to step.
#[derive(Clone, Debug, Default)]
pub(super) struct Aim {
    hessian: Vec<f64>,
    gradient: Vec<f64>,
    factor: Vec<f64>,
    /// The step.
    pub motion: Vec<f64>,
    /// δ that was added to the diagonal of H.
    pub damping: f64,
    /// A condition number of the rows, from below.
    pub condition: f64,
    /// Largest over smallest pivot of the last factors.
    pivots: f64,
    /// Σ s² / σ² over the rows.
    slopes: f64,
    /// Of each row, the error and what the step shall change it by [px].
    changes: Vec<[f64; 2]>,
}

/// A share of a motion that is safe, and by how much the sum of the errors stays below what it may grow to, at most that sum [px].
#[derive(Clone, Copy, Debug)]
pub(super) struct Safe {
    pub share: f64,
    pub slack: f64,
}

/// Least damping, as a share of the largest diagonal entry of H.
const LEAST: f64 = 1e-12;

/// Standard deviations that a trial shall teach, in the mean over the rows.
const CLEAR: f64 = 3.0;

/// Share that is sure of what a motion takes away, where that is much.
const SURE: f64 = 0.6;

/// Steps of the search for a damping that suits the length of its motion: to 3 %. A length that hardly changes, as a share, ends it.
const SEARCH: usize = 5;
const SETTLED: f64 = 1e-3;

impl Aim {
    /// Minimises |J d + e|² + ½ c Σs² |d|⁴ over the rows, which are divided by their standard deviations; c is the restraint. False where
    /// the rows do not determine a motion.
    pub fn update(&mut self, n: usize, estimate: &Estimate, rows: &[usize], restraint: f64) -> bool {
        self.normal_equations(n, estimate, rows);
        let largest = (0..n).map(|i| self.hessian[i * n + i]).fold(0.0, f64::max);
        let least = LEAST * largest;
        if !self.solve(n, least) {
            return false;
        }
        (self.damping, self.condition) = (least, self.pivots.sqrt());
        let weight = restraint * self.slopes;
        if weight > 0.0 {
            // r = |d(weight r²)|, whose right side falls with r by a power between 0 and 2: the geometric mean of both sides halves what
            // is left to it.
            let mut length = self.length();
            for _ in 0..SEARCH {
                self.damping = least + weight * length * length;
                if !self.solve(n, self.damping) {
                    return false;
                }
                let reached = self.length();
                if (reached - length).abs() <= SETTLED * length {
                    break;
                }
                length = (length * reached).sqrt();
            }
        }
        true
    }

    /// By how much the motion would reduce the sum of the squared errors over their variances.
    pub fn removable(&self) -> f64 {
        dot(&self.gradient, &self.motion)
    }

    fn length(&self) -> f64 {
        dot(&self.motion, &self.motion).sqrt()
    }

    fn normal_equations(&mut self, n: usize, estimate: &Estimate, rows: &[usize]) {
        self.hessian.clear();
        self.hessian.resize(n * n, 0.0);
        self.gradient.clear();
        self.gradient.resize(n, 0.0);
        self.slopes = 0.0;
        for &row in rows {
            let (slopes, weight) = (estimate.slopes(row), 1.0 / estimate.variance(row));
            self.slopes += weight * estimate.scale(row);
            for i in 0..n {
                let slope = weight * slopes[i];
                self.gradient[i] -= slope * estimate.error(row);
                let line = &mut self.hessian[i * n..i * n + i + 1];
                line.iter_mut().zip(slopes).for_each(|(entry, other)| *entry += slope * other);
            }
        }
    }

    /// Solves (H + δ I) d = g by Cholesky's factors.
    fn solve(&mut self, n: usize, damping: f64) -> bool {
        self.factor.clone_from(&self.hessian);
        let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
        for i in 0..n {
            self.factor[i * n + i] += damping;
            for j in 0..=i {
                let (before, line) = self.factor.split_at_mut(i * n);
                if j < i {
                    let rest = line[j] - dot(&line[..j], &before[j * n..j * n + j]);
                    line[j] = rest / before[j * n + j];
                } else {
                    let rest = line[i] - dot(&line[..i], &line[..i]);
                    (least, most) = (least.min(rest), most.max(rest));
                    if rest.is_nan() || rest <= 0.0 {
                        return false;
                    }
                    line[i] = rest.sqrt();
                }
            }
        }
        self.pivots = most / least;
        self.motion.clone_from(&self.gradient);
        for i in 0..n {
            let rest = self.motion[i] - dot(&self.factor[i * n..i * n + i], &self.motion[..i]);
            self.motion[i] = rest / self.factor[i * n + i];
        }
        for i in (0..n).rev() {
            let later: f64 = (i + 1..n).map(|k| self.factor[k * n + i] * self.motion[k]).sum();
            self.motion[i] = (self.motion[i] - later) / self.factor[i * n + i];
        }
        true
    }

    /// The share of `gain` times the motion that is safe, in (0, 1].
    ///
    /// With doubt p from the slopes' covariance and c from their curvature, the sum of the m rows' errors after a share t is wrong by at most
    /// z √(m (t² p + t⁴ c)). That shall be below `growth` [px] and what Σ |e + t λ j·d| falls by, f; of a large fall only 2 `growth` and
    /// 0.6 f count, as a Jacobian that is wrong promises too much. `middle`: whose slopes j are those of the middle of the way, where a model knows them.
    pub fn share(
        &mut self,
        estimate: &Estimate,
        middle: Option<&Estimate>,
        rows: &[usize],
        gain: f64,
        trust: &Trust,
        growth: f64,
    ) -> Safe {
        let length = gain * self.length();
        let longest = if length > trust.motion { trust.motion / length } else { 1.0 };
        let (mut doubt, mut bend, mut errors) = (0.0, 0.0, 0.0);
        self.changes.clear();
        for &row in rows {
            doubt += estimate.doubt(row, &self.motion);
            bend += estimate.scale(row);
            errors += estimate.error(row).abs();
            self.changes.push([estimate.error(row), gain * dot(middle.unwrap_or(estimate).slopes(row), &self.motion)]);
        }
        let m = rows.len() as f64;
        let doubt = m * gain * gain * doubt;
        let bend = m * gain.powi(4) * bend * estimate.bend(&self.motion);
        let slack = |share: f64| {
            let wrong = trust.confidence * (share * share * doubt + share.powi(4) * bend).sqrt();
            let there: f64 = self.changes.iter().map(|[error, change]| (error + share * change).abs()).sum();
            let fall = errors - there;
            growth + fall.min(2.0 * growth + SURE * fall) - wrong
        };
        let whole = slack(longest);
        if whole >= 0.0 {
            return Safe { share: longest, slack: whole.min(errors) };
        }
        let (mut low, mut high) = (0.0, longest);
        for _ in 0..20 {
            let middle = 0.5 * (low + high);
            if slack(middle) >= 0.0 { low = middle } else { high = middle }
        }
        Safe { share: low, slack: 0.0 }
    }

    /// A motion that is tried to learn from: along the direction whose slopes are least known beside what they are, as far as what it changes
    /// tells them from noise, to the side where errors fall as far as known. `None` where that is farther than `longest`, or than errors may grow
    /// by `slack` [px]: where slopes are well known, there is nothing to learn.
    pub fn trial(
        &self,
        estimate: &Estimate,
        rows: &[usize],
        trust: &Trust,
        longest: f64,
        slack: f64,
    ) -> Option<Vec<f64>> {
        let n = self.motion.len();
        // H + δ I = L Lᵀ; the largest of the eigenvalues of L⁻¹ P L⁻ᵀ, with P the sum of the slopes' covariances over the rows' variances.
        let factor = DMatrix::from_fn(n, n, |i, k| if k <= i { self.factor[i * n + k] } else { 0.0 });
        let mut doubts = DMatrix::zeros(n, n);
        rows.iter().for_each(|&row| doubts += estimate.covariance(row) / estimate.variance(row));
        let inverse = factor.try_inverse()?;
        let eigen = (&inverse * &doubts * inverse.transpose()).symmetric_eigen();
        let along = inverse.transpose() * eigen.eigenvectors.column(eigen.eigenvalues.imax());
        let along = along.try_normalize(0.0)?;
        let known = along.as_slice();
        let growth = estimate.reach(rows, known, trust.confidence);
        let clear = CLEAR * (rows.len() as f64 / (along.transpose() * &doubts * &along)[(0, 0)]).sqrt();
        let way = if dot(&self.gradient, known) < 0.0 { -clear } else { clear };
        (clear <= longest.min(slack / growth)).then(|| known.iter().map(|along| way * along).collect())
    }
}
