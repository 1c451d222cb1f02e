//! Batched Schur complement: many small blocks of one size are eliminated, what they share remains.
//!
//! With H = [E W; Wᵀ S] and E block-diagonal, blocks L Lᵀ = E_k and V_k = L⁻¹ W_k give the reduced system
//! (S - Σ V_kᵀ V_k) x = y_s - Σ V_kᵀ L⁻¹ y_k, after which x_k = L⁻ᵀ (L⁻¹ y_k - V_k x).
use super::dense::Factorization;
use super::independent::independent;
use super::{LinearSolver, scatter_lower};
use crate::Workspace;
use crate::layout::Block;
use crate::product::add_scaled;
use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::{Accum, MatMut, MatRef, Par};
use std::ops::Range;

/// Rows of V that one matrix product takes.
const BATCH: usize = 512;

/// The largest number of columns that may remain.
const REMAINING: usize = 600;

/// Eliminates the free nodes of one size that no factor ties to each other.
pub struct Schur {
    /// Columns of one eliminated block.
    size: usize,
    /// First column of every eliminated block in the system.
    eliminated: Vec<usize>,
    /// E_k.
    diagonal: Vec<Block>,
    /// W_k: (k, block, first remaining column, its columns, whether the block has the eliminated node's coordinates as rows).
    coupling: Vec<Coupling>,
    /// (first column in the system, first remaining column, columns) of every remaining node.
    remaining: Vec<(usize, usize, usize)>,
    /// Blocks between remaining nodes with the spans of their rows and columns.
    rest: Vec<(Block, Span, Span)>,
    /// L_k by columns, and V by rows of k: (size k + i) of V is one row of `n` numbers.
    factors: Vec<f64>,
    v: Vec<f64>,
    n: usize,
    reduced: Factorization,
    reduced_y: Vec<f64>,
}

/// (first remaining column, columns)
type Span = (usize, usize);

struct Coupling {
    k: usize,
    block: Block,
    column: usize,
    columns: usize,
    by_rows: bool,
}

impl Schur {
    /// Finds the size that eliminates most columns; `None` where there is none, or where too much would remain.
    pub fn new(workspace: &Workspace) -> Option<Self> {
        let layout = &workspace.layout;
        let active = |node: u32| usize::from(layout.places[node as usize].active);
        let (size, chosen) = independent(layout)?;
        let n = layout.columns - size * chosen.len();
        if n == 0 || n > REMAINING {
            return None;
        }
        let mut place = vec![(false, 0); layout.places.len()];
        let (mut eliminated, mut remaining, mut next) = (Vec::new(), Vec::new(), 0);
        for &(node, column) in &layout.free {
            if chosen.binary_search(&node).is_ok() {
                place[node as usize] = (true, eliminated.len());
                eliminated.push(column);
            } else {
                place[node as usize] = (false, next);
                remaining.push((column, next, active(node)));
                next += active(node);
            }
        }
        let (mut diagonal, mut coupling, mut rest) = (vec![None; eliminated.len()], Vec::new(), Vec::new());
        for &block in &layout.blocks {
            match (place[block.row as usize], place[block.column as usize]) {
                ((true, k), (true, _)) => diagonal[k] = Some(block),
                ((true, k), (false, column)) => {
                    coupling.push(Coupling { k, block, column, columns: active(block.column), by_rows: true });
                }
                ((false, column), (true, k)) => {
                    coupling.push(Coupling { k, block, column, columns: active(block.row), by_rows: false });
                }
                ((false, row), (false, column)) => {
                    rest.push((block, (row, active(block.row)), (column, active(block.column))));
                }
            }
        }
        coupling.sort_by_key(|coupling| coupling.k);
        let rows = size * eliminated.len();
        Some(Schur {
            size,
            diagonal: diagonal.into_iter().collect::<Option<_>>()?,
            factors: vec![0.0; rows * size],
            v: vec![0.0; rows * n],
            eliminated,
            coupling,
            remaining,
            rest,
            n,
            reduced: Factorization::new(n),
            reduced_y: vec![0.0; n],
        })
    }

    /// Whether eliminating is less work than factorising everything at once: V is stored and multiplied in full, so most
    /// blocks should be tied to much of what remains.
    pub(super) fn pays_off(&self) -> bool {
        let blocks = self.eliminated.len();
        let tied: usize = self.coupling.iter().map(|coupling| coupling.columns).sum();
        blocks >= 8 && blocks * self.size > self.n / 2 && 5 * tied > blocks * self.n
    }

    /// Fills V with W and turns it into L⁻¹ W.
    fn eliminate(&mut self, workspace: &Workspace, damping: &[f64]) -> bool {
        let (m, n) = (self.size, self.n);
        self.v.fill(0.0);
        for coupling in &self.coupling {
            let block = workspace.block(&coupling.block);
            for i in 0..m {
                let row = &mut self.v[(coupling.k * m + i) * n + coupling.column..][..coupling.columns];
                for (j, value) in row.iter_mut().enumerate() {
                    *value = if coupling.by_rows { block[i + j * m] } else { block[j + i * coupling.columns] };
                }
            }
        }
        for (k, block) in self.diagonal.iter().enumerate() {
            let l = &mut self.factors[k * m * m..(k + 1) * m * m];
            l.copy_from_slice(workspace.block(block));
            for i in 0..m {
                l[i * (m + 1)] += damping[self.eliminated[k] + i];
            }
            if !cholesky(l, m) {
                return false;
            }
            let rows = &mut self.v[k * m * n..(k + 1) * m * n];
            for i in 0..m {
                let (before, row) = rows.split_at_mut(i * n);
                let row = &mut row[..n];
                for j in 0..i {
                    add_scaled(row, -l[i + j * m], &before[j * n..(j + 1) * n]);
                }
                let inverse = 1.0 / l[i * (m + 1)];
                row.iter_mut().for_each(|x| *x *= inverse);
            }
        }
        true
    }
}

impl LinearSolver for Schur {
    fn name(&self) -> &'static str {
        "batched Schur complement"
    }

    fn factorize(&mut self, workspace: &Workspace, damping: &[f64]) -> bool {
        if !self.eliminate(workspace, damping) {
            return false;
        }
        let n = self.n;
        self.reduced.matrix.fill(0.0);
        for &(ref block, row, column) in &self.rest {
            scatter_lower(&mut self.reduced.matrix, n, workspace.block(block), row, column);
        }
        for &(column, start, len) in &self.remaining {
            for i in 0..len {
                self.reduced.matrix[(start + i) * (n + 1)] += damping[column + i];
            }
        }
        for batch in self.v.chunks(BATCH * n) {
            let v = MatRef::from_row_major_slice(batch, batch.len() / n, n);
            matmul(
                MatMut::from_column_major_slice_mut(&mut self.reduced.matrix, n, n),
                BlockStructure::TriangularLower,
                Accum::Add,
                v.transpose(),
                BlockStructure::Rectangular,
                v,
                BlockStructure::Rectangular,
                -1.0,
                Par::Seq,
            );
        }
        self.reduced.factorize()
    }

    fn solve(&mut self, y: &mut [f64]) {
        let all = 0..y.len();
        self.solve_part(y, std::slice::from_ref(&all), std::slice::from_ref(&all));
    }

    fn solve_part(&mut self, y: &mut [f64], given: &[Range<usize>], wanted: &[Range<usize>]) {
        for &(column, start, len) in &self.remaining {
            self.reduced_y[start..start + len].copy_from_slice(&y[column..column + len]);
        }
        for columns in given {
            self.blocks(columns).for_each(|k| self.eliminate_right_side(k, y));
        }
        self.reduced.solve(&mut self.reduced_y);
        for columns in wanted {
            self.blocks(columns).for_each(|k| self.substitute_back(k, y));
        }
        for &(column, start, len) in &self.remaining {
            y[column..column + len].copy_from_slice(&self.reduced_y[start..start + len]);
        }
    }

    fn eliminated(&self) -> (&[usize], usize) {
        (&self.eliminated, self.size)
    }
}

impl Schur {
    /// The eliminated blocks that some of these columns belong to.
    fn blocks(&self, columns: &Range<usize>) -> Range<usize> {
        self.eliminated.partition_point(|&first| first + self.size <= columns.start)
            ..self.eliminated.partition_point(|&first| first < columns.end)
    }

    /// y_k becomes L⁻¹ y_k, and the remaining right side loses V_kᵀ L⁻¹ y_k.
    fn eliminate_right_side(&mut self, k: usize, y: &mut [f64]) {
        let (m, n) = (self.size, self.n);
        let (l, own) = (&self.factors[k * m * m..(k + 1) * m * m], &mut y[self.eliminated[k]..][..m]);
        for i in 0..m {
            let known: f64 = (0..i).map(|j| l[i + j * m] * own[j]).sum();
            own[i] = (own[i] - known) / l[i * (m + 1)];
            add_scaled(&mut self.reduced_y, -own[i], &self.v[(k * m + i) * n..][..n]);
        }
    }

    /// y_k becomes L⁻ᵀ (y_k - V_k x).
    fn substitute_back(&self, k: usize, y: &mut [f64]) {
        let (m, n) = (self.size, self.n);
        let (l, own) = (&self.factors[k * m * m..(k + 1) * m * m], &mut y[self.eliminated[k]..][..m]);
        for i in (0..m).rev() {
            let row = &self.v[(k * m + i) * n..][..n];
            let shared: f64 = row.iter().zip(&self.reduced_y).map(|(v, x)| v * x).sum();
            let known: f64 = (i + 1..m).map(|j| l[j + i * m] * own[j]).sum();
            own[i] = (own[i] - shared - known) / l[i * (m + 1)];
        }
    }
}

/// Cholesky factor of a small matrix in its lower triangle, stored by columns.
fn cholesky(a: &mut [f64], n: usize) -> bool {
    for j in 0..n {
        let pivot = a[j * (n + 1)] - (0..j).map(|k| a[j + k * n] * a[j + k * n]).sum::<f64>();
        if !(pivot > 0.0 && pivot.is_finite()) {
            return false;
        }
        let root = pivot.sqrt();
        a[j * (n + 1)] = root;
        for i in j + 1..n {
            let sum: f64 = (0..j).map(|k| a[i + k * n] * a[j + k * n]).sum();
            a[i + j * n] = (a[i + j * n] - sum) / root;
        }
    }
    true
}
