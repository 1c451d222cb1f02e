//! Branches: the minima that joints were found at, with covariance, open directions and probability.
use super::information::Information;
use super::pixel_error::PixelError;
use super::sighting::Telling;
use handeye_solvers::Pose;
use nalgebra::DMatrix;

/// Joints that explain what was seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Branch {
    /// One reading per joint, inside its limits [rad or m].
    pub joints: Vec<f64>,
    /// Covariance of their error [rad² or m²]. In open directions it is that of the prior, or of joints anywhere inside the limits. What
    /// the rig itself is off by is not in it.
    pub covariance: DMatrix<f64>,
    /// Unit directions of the joints that the pixels say less about than was known before; empty where the pixels determine all.
    pub open: Vec<Vec<f64>>,
    /// `world_from_tip` with these joints.
    pub pose: Pose,
    /// Root mean square of the pixel distances that are left [px]; 0 without pixels.
    pub rms_px: f64,
    /// Root mean square of the distances of depth cameras' points that are left [m]; 0 without points.
    pub rms_points_m: f64,
    /// How probable it is among the branches that were found: exp(-cost) √det(covariance), as a Gaussian around each has it.
    pub probability: f64,
}

/// A minimum of the cost in the joints.
#[derive(Clone, Debug)]
pub(super) struct Minimum {
    pub joints: Vec<f64>,
    pose: Pose,
    /// Inverse covariance.
    precision: DMatrix<f64>,
    open: Vec<Vec<f64>>,
    squares: [f64; 2],
    /// Of pixels and points alone.
    pub seen: f64,
    /// The whole cost there, of what was seen, readings and beliefs.
    pub misfit: f64,
    /// -ln of what its probability is in proportion to, but for the volume.
    pub cost: f64,
}

/// Minima whose joints all differ by less are one [rad or m]: refining ends far nearer to the minimum, but for directions that are
/// nearly open.
pub(super) const APART: f64 = 1e-2;

/// Branches less probable than this are left out.
const HOPELESS: f64 = 1e-9;

impl Minimum {
    /// Where `error` has looked last. `information`: what was known there beside the pixels, `open`: what it alone determines.
    pub fn new(
        error: &PixelError,
        misfit: f64,
        joints: Vec<f64>,
        (information, open): (&Information, Vec<Vec<f64>>),
    ) -> Self {
        Minimum {
            pose: error.tip(),
            precision: error.square() + information.square(),
            open,
            squares: error.squares,
            seen: error.seen,
            misfit,
            cost: misfit,
            joints,
        }
    }

    /// Takes over the probability of another that is the same.
    pub fn merge(&mut self, other: &Minimum) {
        let (least, most) = (self.cost.min(other.cost), self.cost.max(other.cost));
        self.misfit = self.misfit.min(other.misfit);
        self.cost = least - (least - most).exp().ln_1p();
    }
}

/// Branches of minima, most probable first.
pub(super) fn branches(minima: Vec<Minimum>, seen: &Telling) -> Vec<Branch> {
    let counts = [seen.pixels.len(), seen.points.len()];
    let least = minima.iter().map(|minimum| minimum.cost).fold(f64::INFINITY, f64::min);
    let branch = |minimum: Minimum| {
        let n = minimum.joints.len();
        let factor = minimum.precision.cholesky();
        let volume = factor.as_ref().map_or(0.0, |factor| 1.0 / factor.l_dirty().diagonal().product());
        let unknown = || DMatrix::from_diagonal_element(n, n, f64::INFINITY);
        let covariance = factor.map_or_else(unknown, |factor| factor.inverse());
        let covariance = (&covariance + covariance.transpose()) * 0.5;
        let rms = |kind: usize| (minimum.squares[kind] / counts[kind].max(1) as f64).sqrt();
        Branch {
            rms_px: rms(0),
            rms_points_m: rms(1),
            open: minimum.open,
            covariance,
            pose: minimum.pose,
            probability: (least - minimum.cost).exp() * volume,
            joints: minimum.joints,
        }
    };
    let mut branches: Vec<Branch> = minima.into_iter().map(branch).collect();
    let sum: f64 = branches.iter().map(|branch| branch.probability).sum();
    let all = branches.len() as f64;
    let normal = sum > 0.0 && sum.is_finite();
    branches.iter_mut().for_each(|one| one.probability = if normal { one.probability / sum } else { 1.0 / all });
    branches.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    branches.retain(|branch| branch.probability > HOPELESS);
    branches
}
