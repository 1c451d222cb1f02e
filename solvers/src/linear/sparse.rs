//! Sparse supernodal Cholesky factorisation, analysed once per structure.
use super::LinearSolver;
use crate::Workspace;
use crate::layout::Block;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMat, SymbolicSparseColMat};
use faer::{Conj, MatMut, Par, Side};

/// H + D = P L Lᵀ Pᵀ with an ordering that keeps L sparse.
pub struct Sparse {
    symbolic: SymbolicCholesky<usize>,
    /// The upper triangle.
    matrix: SparseColMat<usize, f64>,
    /// (block, its column j, where that goes in the matrix, how many numbers of it)
    copies: Vec<(Block, usize, usize, usize)>,
    diagonal: Vec<usize>,
    factor: Vec<f64>,
    memory: MemBuffer,
}

impl Sparse {
    /// Analyses the pattern of a workspace's system.
    pub fn new(workspace: &Workspace) -> Self {
        let layout = &workspace.layout;
        let active = |node: u32| usize::from(layout.places[node as usize].active);
        let (mut starts, mut rows) = (vec![0], Vec::new());
        let (mut copies, mut diagonal) = (Vec::new(), Vec::new());
        // Blocks are sorted by column node, then row node, so columns come out in order with ascending rows.
        for group in layout.blocks.chunk_by(|a, b| a.column == b.column) {
            for j in 0..active(group[0].column) {
                for block in group {
                    let len = if block.row == block.column { j + 1 } else { active(block.row) };
                    copies.push((*block, j, rows.len(), len));
                    let first = layout.column(block.row);
                    rows.extend(first..first + len);
                }
                diagonal.push(rows.len() - 1);
                starts.push(rows.len());
            }
        }
        let n = layout.columns;
        let entries = rows.len();
        let pattern = SymbolicSparseColMat::new_checked(n, n, starts, None, rows);
        let symbolic = factorize_symbolic_cholesky(
            pattern.as_ref(),
            Side::Upper,
            SymmetricOrdering::Amd,
            CholeskySymbolicParams::default(),
        )
        .expect("a pattern that fits into memory can be analysed");
        let scratch = symbolic
            .factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default())
            .or(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        Sparse {
            factor: vec![0.0; symbolic.len_val()],
            memory: MemBuffer::new(scratch),
            matrix: SparseColMat::new(pattern, vec![0.0; entries]),
            symbolic,
            copies,
            diagonal,
        }
    }
}

impl LinearSolver for Sparse {
    fn name(&self) -> &'static str {
        "sparse Cholesky"
    }

    fn factorize(&mut self, workspace: &Workspace, damping: &[f64]) -> bool {
        let places = &workspace.layout.places;
        let values = self.matrix.val_mut();
        for &(ref block, j, to, len) in &self.copies {
            let from = j * usize::from(places[block.row as usize].active);
            values[to..to + len].copy_from_slice(&workspace.block(block)[from..from + len]);
        }
        for (&at, d) in self.diagonal.iter().zip(damping) {
            values[at] += d;
        }
        self.symbolic
            .factorize_numeric_llt(
                &mut self.factor,
                self.matrix.as_ref(),
                Side::Upper,
                Default::default(),
                Par::Seq,
                MemStack::new(&mut self.memory),
                Default::default(),
            )
            .is_ok()
    }

    fn solve(&mut self, y: &mut [f64]) {
        let n = y.len();
        LltRef::<usize, f64>::new(&self.symbolic, &self.factor).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(y, n, 1),
            Par::Seq,
            MemStack::new(&mut self.memory),
        );
    }
}
