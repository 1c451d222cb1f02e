//! Dense Cholesky factorisation.
use super::{LinearSolver, scatter_lower};
use crate::Workspace;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::{MatMut, MatRef, Par};

/// H + D = L Lᵀ in one dense matrix.
pub struct Dense {
    factor: Factorization,
}

impl Dense {
    /// For the system of a workspace.
    pub fn new(workspace: &Workspace) -> Self {
        Dense { factor: Factorization::new(workspace.layout.columns) }
    }
}

impl LinearSolver for Dense {
    fn name(&self) -> &'static str {
        "dense Cholesky"
    }

    fn factorize(&mut self, workspace: &Workspace, damping: &[f64]) -> bool {
        let layout = &workspace.layout;
        let n = layout.columns;
        self.factor.matrix.fill(0.0);
        let span = |node: u32| (layout.column(node), usize::from(layout.places[node as usize].active));
        for block in &layout.blocks {
            let data = workspace.block(block);
            scatter_lower(&mut self.factor.matrix, n, data, span(block.row), span(block.column));
        }
        for (i, d) in damping.iter().enumerate() {
            self.factor.matrix[i * (n + 1)] += d;
        }
        self.factor.factorize()
    }

    fn solve(&mut self, y: &mut [f64]) {
        self.factor.solve(y);
    }
}

/// A symmetric positive definite matrix, its lower triangle stored by columns, and then its Cholesky factor in its place.
pub(super) struct Factorization {
    pub matrix: Vec<f64>,
    n: usize,
    memory: MemBuffer,
}

impl Factorization {
    pub fn new(n: usize) -> Self {
        let scratch = llt::factor::cholesky_in_place_scratch::<f64>(n, Par::Seq, Default::default())
            .or(llt::solve::solve_in_place_scratch::<f64>(n, 1, Par::Seq));
        Factorization { matrix: vec![0.0; n * n], n, memory: MemBuffer::new(scratch) }
    }

    pub fn factorize(&mut self) -> bool {
        let matrix = MatMut::from_column_major_slice_mut(&mut self.matrix, self.n, self.n);
        let stack = MemStack::new(&mut self.memory);
        llt::factor::cholesky_in_place(matrix, Default::default(), Par::Seq, stack, Default::default()).is_ok()
    }

    pub fn solve(&mut self, y: &mut [f64]) {
        let l = MatRef::from_column_major_slice(&self.matrix, self.n, self.n);
        let y = MatMut::from_column_major_slice_mut(y, self.n, 1);
        llt::solve::solve_in_place(l, y, Par::Seq, MemStack::new(&mut self.memory));
    }
}
