//! What is known of the joints beside the pixels, as a quadratic; and which directions only that determines.
use nalgebra::{DMatrix, DVector};

/// ½ (q - mean)ᵀ W (q - mean).
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Information {
    pub mean: Vec<f64>,
    /// W by rows, n x n: readings and limits together.
    pub matrix: Vec<f64>,
    /// The part of the diagonal that comes from limits: it decides what the pixels leave open, and must not move anything else.
    pub weak: Vec<f64>,
}

/// A direction is open where the pixels carry less information than was known before.
const OPEN: f64 = 1.0;

impl Information {
    pub fn square(&self) -> DMatrix<f64> {
        DMatrix::from_row_slice(self.mean.len(), self.mean.len(), &self.matrix)
    }

    /// The same without limits.
    pub fn readings(&self) -> Information {
        let n = self.mean.len();
        let mut readings = Information { weak: vec![0.0; n], ..self.clone() };
        self.weak.iter().enumerate().for_each(|(i, weak)| readings.matrix[i * n + i] -= weak);
        readings
    }

    /// The same with limits counting in open directions alone, and those directions; `hessian`: H of the pixels.
    ///
    /// Directions v with vᵀ H v < vᵀ W v are open; with vᵀ W v = 1 and P = Σ v vᵀ W the projection onto them along the others, what
    /// is left of the weak part D is Pᵀ D P.
    pub fn settled(&self, hessian: &DMatrix<f64>) -> (Information, Vec<Vec<f64>>) {
        let n = self.mean.len();
        let open = self.open(hessian);
        let full = self.square();
        let projection = open.iter().fold(DMatrix::zeros(n, n), |sum, v| sum + v * (v.transpose() * &full));
        let weak = DMatrix::from_diagonal(&DVector::from_column_slice(&self.weak));
        let settled = &full - &weak + projection.transpose() * &weak * &projection;
        // Symmetric up to rounding, so that rows are columns.
        let settled = Information { mean: self.mean.clone(), matrix: settled.as_slice().to_vec(), weak: vec![0.0; n] };
        (settled, open.into_iter().map(|v| v.normalize().as_slice().to_vec()).collect())
    }

    /// Open directions, the least known first.
    fn open(&self, hessian: &DMatrix<f64>) -> Vec<DVector<f64>> {
        // S = L⁻¹ H L⁻ᵀ with W = L Lᵀ has an eigenvalue under 1 there.
        let Some(factor) = self.square().cholesky() else { return Vec::new() };
        let lower = factor.l();
        let Some(half) = lower.solve_lower_triangular(hessian) else { return Vec::new() };
        let Some(whole) = lower.solve_lower_triangular(&half.transpose()) else { return Vec::new() };
        // None is open where even the least eigenvalue is above 1: S - 1 is positive definite.
        let n = hessian.nrows();
        if (&whole - DMatrix::identity(n, n) * OPEN).cholesky().is_some() {
            return Vec::new();
        }
        let eigen = ((&whole + whole.transpose()) * 0.5).symmetric_eigen();
        let mut order: Vec<usize> = (0..n).filter(|&k| eigen.eigenvalues[k] < OPEN).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        let direction = |k: usize| lower.tr_solve_lower_triangular(&eigen.eigenvectors.column(k).into_owned());
        order.into_iter().filter_map(direction).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // Pixels that see x + y to 1 mrad, and limits of 1 rad: x - y is open, and what limits say of x + y is dropped.
    #[test]
    fn limits_count_in_open_directions_alone() {
        let hessian = DMatrix::from_element(2, 2, 1e6);
        let limits = Information { mean: vec![0.0; 2], matrix: vec![1.0, 0.0, 0.0, 1.0], weak: vec![1.0; 2] };
        let (settled, open) = limits.settled(&hessian);
        assert_eq!(open.len(), 1);
        assert!((open[0][0] + open[0][1]).abs() < 1e-9 && (open[0][0].abs() - 0.5_f64.sqrt()).abs() < 1e-9);
        let expected = [0.5, -0.5, -0.5, 0.5];
        assert!(settled.matrix.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-6));
        let readings = Information { weak: vec![0.0; 2], ..limits };
        assert_eq!(readings.settled(&hessian).0.matrix, readings.matrix);
    }
}
