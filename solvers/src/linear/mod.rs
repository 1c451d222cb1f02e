//! Linear solvers for the normal equations, behind one trait and chosen from their structure.
mod dense;
mod independent;
mod schur;
mod sparse;

pub use dense::Dense;
pub use schur::Schur;
pub use sparse::Sparse;

use crate::Workspace;
use std::ops::Range;

/// Solves (H + D) x = y for the H of a linearised workspace and a diagonal D >= 0.
pub trait LinearSolver: Send {
    /// Its name, for reports.
    fn name(&self) -> &'static str;

    /// Factorises H + D, where `damping` is the diagonal of D. False where that is not positive definite.
    fn factorize(&mut self, workspace: &Workspace, damping: &[f64]) -> bool;

    /// Solves in place with the last factorisation.
    fn solve(&mut self, y: &mut [f64]);

    /// Solves in place where `y` is zero outside the columns of `given` and only the columns of `wanted` are needed; the others
    /// may hold anything afterwards. A solver that eliminates blocks passes over the rest of them.
    fn solve_part(&mut self, y: &mut [f64], given: &[Range<usize>], wanted: &[Range<usize>]) {
        let _ = (given, wanted);
        self.solve(y);
    }

    /// First columns of the blocks that are eliminated, ascending, and the columns of one block.
    fn eliminated(&self) -> (&[usize], usize) {
        (&[], 0)
    }
}

/// Largest number of columns that a dense factorisation is used for.
const DENSE: usize = 600;

/// Dense where everything is in one small block, batched Schur complement where many small blocks of one size can be
/// eliminated and what remains is small, and sparse otherwise.
pub fn choose(workspace: &Workspace) -> Box<dyn LinearSolver> {
    match Schur::new(workspace) {
        Some(schur) if schur.pays_off() => Box::new(schur),
        _ if workspace.layout.columns <= DENSE => Box::new(Dense::new(workspace)),
        _ => Box::new(Sparse::new(workspace)),
    }
}

/// Column-major copy of a block into a dense matrix at (row, column), and below the diagonal only.
fn scatter_lower(
    matrix: &mut [f64],
    n: usize,
    block: &[f64],
    (row, rows): (usize, usize),
    (column, columns): (usize, usize),
) {
    for j in 0..columns {
        for i in 0..rows {
            let (r, c) = (row + i, column + j);
            let (r, c) = if r >= c { (r, c) } else { (c, r) };
            matrix[r + c * n] = block[i + j * rows];
        }
    }
}
