//! How well the numbers of a rig are known together, and what more detections would make of that.
use super::super::deviations::Honest;
use super::super::evaluate::median;
use super::super::gauge;
use super::super::graph::{Freedom, State};
use super::super::numbers::{Numbers, Part};
use super::super::outliers::Verdict;
use crate::Error;
use handeye_solvers::Covariance;
use nalgebra::{Cholesky, DMatrix, Dyn, SymmetricEigen};

/// A Gaussian belief about the free numbers of a rig, and the positions of the tip that it is judged by.
#[derive(Clone, Debug)]
pub(super) struct Knowledge {
    /// Covariance of the numbers, of the part that errors of the recording account for.
    sigma: DMatrix<f64>,
    /// F of M = F Fᵀ, the mean of Jᵀ J over the workspace: tr(M Σ) is the mean variance of the tip. Of the numbers that move the tip,
    /// which come first.
    root: DMatrix<f64>,
    /// Σ F.
    spread: DMatrix<f64>,
    /// J: how the tip moves with the numbers, 3 rows for every position of the workspace.
    tips: Vec<DMatrix<f64>>,
}

/// What a fit leaves uncertain.
pub(super) struct Uncertainty {
    pub numbers: Numbers,
    /// Covariance of the numbers.
    pub sigma: DMatrix<f64>,
    /// The part of it that errors of the recording account for: no motion changes what comes from what was given or measured beside it.
    pub by_data: DMatrix<f64>,
}

impl Uncertainty {
    /// Of the final problem, with the frames of base and tip held, as calibrate has the deviation of the tip.
    pub fn new(honest: &Honest<'_>, freedom: &Freedom, state: &State, verdict: &Verdict) -> Result<Self, Error> {
        let free = &gauge::with_frames_held(&honest.setup, freedom);
        if !gauge::is_tip_learned(&honest.setup, free) {
            return Err(Error::Unusable(
                "the tip does not follow from anything that was learned, for its poses were read or the whole chain was held: there \
                 is no uncertainty of it that more motions would shrink"
                    .into(),
            ));
        }
        let is_open = |error| {
            Error::NotEnoughData(format!(
                "the recording leaves something of the rig open, so that no motion can be weighed against another ({error}): \
                 calibrate says what, and what would help"
            ))
        };
        let built = honest.build(free, state, verdict);
        let mut covariance = Covariance::new(&built.graph).map_err(is_open)?;
        let numbers = Numbers::new(free);
        let sigma = numbers.covariance(&built, &mut covariance);
        let mut by_data = sigma.clone();
        for &factor in built.known.iter().flatten() {
            let moved = &sigma * numbers.jacobian(&built, &covariance, factor).transpose();
            by_data.gemm(-1.0, &moved, &moved.transpose(), 1.0);
        }
        Ok(Uncertainty { numbers, sigma, by_data })
    }
}

impl Knowledge {
    /// `tips`: how the tip moves with the numbers, at positions of the workspace.
    pub fn new(uncertainty: &Uncertainty, tips: Vec<DMatrix<f64>>) -> Self {
        let moving = |(part, _): &(Part, usize)| matches!(part, Part::Base | Part::Chain);
        let n = uncertainty.numbers.iter().take_while(moving).count();
        let mut mean = DMatrix::zeros(n, n);
        for tip in tips.iter().map(|tip| tip.columns(0, n)) {
            mean.gemm_tr(1.0 / tips.len() as f64, &tip, &tip, 1.0);
        }
        let SymmetricEigen { eigenvalues, eigenvectors: mut root } = mean.symmetric_eigen();
        root.column_iter_mut().zip(&eigenvalues).for_each(|(mut column, value)| column *= value.max(0.0).sqrt());
        let sigma = uncertainty.by_data.clone();
        let spread = sigma.columns(0, n) * &root;
        Knowledge { sigma, root, spread, tips }
    }

    /// Standard deviation of the tip: median over the workspace.
    pub fn tip(&self) -> f64 {
        median_deviation(&self.tips, &self.sigma)
    }

    /// By how much detections would lower the mean variance of the tip: tr(S⁻¹ A Σ M Σ Aᵀ) = |L⁻¹ A Σ F|² with S = I + A Σ Aᵀ = L Lᵀ,
    /// for whitened detections whose derivatives by the numbers are the rows of A.
    pub fn gain(&self, rows: &DMatrix<f64>) -> f64 {
        let solved = self.innovation(rows).and_then(|s| s.l().solve_lower_triangular(&(rows * &self.spread)));
        solved.map_or(0.0, |solved| solved.norm_squared())
    }

    /// Takes detections in: Σ - Σ Aᵀ S⁻¹ A Σ.
    pub fn learn(&mut self, rows: &DMatrix<f64>) {
        let solved = self.innovation(rows).and_then(|s| s.l().solve_lower_triangular(&(rows * &self.sigma)));
        if let Some(w) = solved {
            self.sigma.gemm_tr(-1.0, &w, &w, 1.0);
            self.spread = self.sigma.columns(0, self.root.nrows()) * &self.root;
        }
    }

    /// S, factorised.
    fn innovation(&self, rows: &DMatrix<f64>) -> Option<Cholesky<f64, Dyn>> {
        let mut s = rows * &self.sigma * rows.transpose();
        (0..s.nrows()).for_each(|i| s[(i, i)] += 1.0);
        s.cholesky()
    }
}

/// Root of the trace of the tip's covariance: median over positions.
pub(super) fn median_deviation(tips: &[DMatrix<f64>], sigma: &DMatrix<f64>) -> f64 {
    let deviation = |tip: &DMatrix<f64>| (tip * sigma).dot(tip).max(0.0).sqrt();
    median(&mut tips.iter().map(deviation).collect::<Vec<_>>())
}
