//! Symmetric eigenproblems of two matrices.
use nalgebra::{DMatrix, DVector};

/// All (λ, v) with A v = λ B v and vᵀ B v = 1, for symmetric A and positive definite B, in falling order of λ; `None`
/// where B is not positive definite.
pub(crate) fn generalized(a: &DMatrix<f64>, b: &DMatrix<f64>) -> Option<Vec<(f64, DVector<f64>)>> {
    if a.is_empty() {
        return Some(Vec::new());
    }
    // L⁻¹ A L⁻ᵀ w = λ w with B = L Lᵀ and v = L⁻ᵀ w.
    let l = b.clone().cholesky()?.unpack();
    let half = l.solve_lower_triangular(a)?;
    let whole = l.solve_lower_triangular(&half.transpose())?;
    let eigen = ((&whole + whole.transpose()) * 0.5).symmetric_eigen();
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|&i, &j| eigen.eigenvalues[j].total_cmp(&eigen.eigenvalues[i]));
    let vector = |i: usize| l.tr_solve_lower_triangular(&eigen.eigenvectors.column(i));
    order.into_iter().map(|i| Some((eigen.eigenvalues[i], vector(i)?))).collect()
}

/// The symmetric part of diag(d)^p A diag(d)^p.
pub(crate) fn scaled(a: &DMatrix<f64>, d: &[f64], power: f64) -> DMatrix<f64> {
    let s: Vec<f64> = d.iter().map(|d| d.powf(power)).collect();
    DMatrix::from_fn(a.nrows(), a.ncols(), |i, j| 0.5 * (a[(i, j)] + a[(j, i)]) * s[i] * s[j])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_solve_the_generalized_problem() {
        let a = DMatrix::from_row_slice(3, 3, &[4.0, 1.0, 0.5, 1.0, 2.0, -0.3, 0.5, -0.3, 1.0]);
        let b = DMatrix::from_row_slice(3, 3, &[2.0, 0.4, 0.0, 0.4, 1.0, 0.1, 0.0, 0.1, 3.0]);
        let pairs = generalized(&a, &b).unwrap();
        assert!(pairs.windows(2).all(|pair| pair[0].0 >= pair[1].0));
        for (lambda, v) in pairs {
            assert!((&a * &v - &b * &v * lambda).norm() < 1e-12);
            assert!((v.dot(&(&b * &v)) - 1.0).abs() < 1e-12);
        }
    }
}
