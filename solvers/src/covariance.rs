//! How well the data determine what was estimated.
use crate::derivative::Derivative;
use crate::graph::{FactorKey, Graph, Role};
use crate::layout::Layout;
use crate::linear::LinearSolver;
use crate::workspace::Take;
use crate::{Error, Key, Solver};
use nalgebra::{DMatrix, DVectorView, DVectorViewMut};
use std::ops::Range;

/// Per free node, derivatives over its columns.
type Derivatives = [(u32, DMatrix<f64>)];

/// The covariance H⁻¹ of a graph where its nodes are now, to be asked for its blocks.
///
/// A block is over steps of its nodes, in their units, with zeros for what is held. It is that of the linearised problem
/// (Laplace's approximation), with robust losses as the weights that they give now. Only what is asked for is solved: with
/// blocks eliminated, a block costs two triangular solves of what remains, however many samples there are.
///
/// ```
/// use handeye_solvers::{Covariance, Graph, Vector};
/// let mut graph = Graph::new();
/// let x = graph.free(Vector::<2>::zeros());
/// graph.prior(x, &Vector::<2>::zeros(), &[0.5, 2.0]);
/// let covariance = Covariance::new(&graph)?.of(x);
/// assert!((covariance[(0, 0)] - 0.25).abs() < 1e-12 && (covariance[(1, 1)] - 4.0).abs() < 1e-12);
/// # Ok::<(), handeye_solvers::Error>(())
/// ```
pub struct Covariance<'a> {
    graph: &'a Graph,
    solver: Solver,
    y: Vec<f64>,
}

/// Information of a direction, as a share of what its coordinates would have alone, that is indistinguishable from none.
const OPEN: f64 = 1e-13;

impl<'a> Covariance<'a> {
    /// Linearises and factorises once. [`Error::Singular`] where the data leave some direction open.
    pub fn new(graph: &'a Graph) -> Result<Self, Error> {
        Self::with(graph, Solver::new(graph))
    }

    /// The same with the solver of a minimiser, which saves laying everything out again.
    pub fn with(graph: &'a Graph, mut solver: Solver) -> Result<Self, Error> {
        solver.fit(graph);
        let layout = &solver.workspace.layout;
        let is_open = |node: usize| graph.nodes[node].role == Role::Free && layout.places[node].active > 0;
        let is_untouched = |node: usize| is_open(node) && layout.column_of(node as u32).is_none();
        if layout.columns > 0 && (0..graph.nodes.len()).any(is_untouched) {
            return Err(Error::Singular);
        }
        factorize(graph, &mut solver)?;
        let y = vec![0.0; solver.buffers.b.len()];
        Ok(Covariance { graph, solver, y })
    }

    /// Covariance of a node's step; of a derived node, G Σ Gᵀ of what it is derived from.
    pub fn of<V>(&mut self, node: Key<V>) -> DMatrix<f64> {
        self.between(node, node)
    }

    /// Covariance between the steps of two nodes: rows are coordinates of `a`, columns those of `b`.
    pub fn between<A, B>(&mut self, a: Key<A>, b: Key<B>) -> DMatrix<f64> {
        let layout = &self.solver.workspace.layout;
        let mut derivative = Derivative::new(self.graph, layout);
        let (of_a, of_b) = (derivative.of(a.index), derivative.of(b.index));
        let (wanted, given) = (columns(layout, &of_a), columns(layout, &of_b));
        let mut result = DMatrix::zeros(self.graph.nodes[a.index()].tangent, self.graph.nodes[b.index()].tangent);
        for coordinate in 0..result.ncols() {
            self.solve_for(&of_b, coordinate, &given, &wanted);
            multiply(&of_a, &wanted, &self.y, result.column_mut(coordinate));
        }
        result
    }

    /// The parts of a node's covariance that errors of each group of factors account for: Σ Jᵀ J Σ, with J the whitened derivatives of a
    /// group. H is the sum of Jᵀ J over all factors, so the parts of groups that hold all of them add up to the covariance.
    ///
    /// ```
    /// use handeye_solvers::{Covariance, Graph, Vector};
    /// let mut graph = Graph::new();
    /// let x = graph.free(Vector::<1>::zeros());
    /// let [rough, fine] = [2.0, 1.0].map(|sigma| vec![graph.prior(x, &Vector::<1>::zeros(), &[sigma])]);
    /// let parts = Covariance::new(&graph)?.due_to(x, &[rough, fine]);
    /// assert!((parts[0][(0, 0)] - 0.16).abs() < 1e-12 && (parts[1][(0, 0)] - 0.64).abs() < 1e-12);
    /// # Ok::<(), handeye_solvers::Error>(())
    /// ```
    pub fn due_to<V>(&mut self, node: Key<V>, groups: &[Vec<FactorKey>]) -> Vec<DMatrix<f64>> {
        let tangent = self.graph.nodes[node.index()].tangent;
        let layout = &self.solver.workspace.layout;
        let mut derivative = Derivative::new(self.graph, layout);
        let of_node = derivative.of(node.index);
        let given = columns(layout, &of_node);
        let mut of_factor = |&factor: &FactorKey| {
            let (residual, of) = derivative.of_factor(factor);
            let columns = columns(layout, &of);
            (of, columns, DMatrix::zeros(residual.len(), tangent))
        };
        let mut factors: Vec<Vec<_>> = groups.iter().map(|group| group.iter().map(&mut of_factor).collect()).collect();
        let mut wanted: Vec<Range<usize>> =
            factors.iter().flatten().flat_map(|(_, columns, _)| columns.iter().cloned()).collect();
        wanted.sort_unstable_by_key(|columns| columns.start);
        wanted.dedup();
        for coordinate in 0..if wanted.is_empty() { 0 } else { tangent } {
            self.solve_for(&of_node, coordinate, &given, &wanted);
            for (of, columns, moved) in factors.iter_mut().flatten() {
                multiply(of, columns, &self.y, moved.column_mut(coordinate));
            }
        }
        let sum = |group: &Vec<(_, _, DMatrix<f64>)>| {
            group.iter().fold(DMatrix::zeros(tangent, tangent), |sum, (_, _, moved)| sum + moved.tr_mul(moved))
        };
        factors.iter().map(sum).collect()
    }

    /// Whitened derivatives J of a factor where the nodes are now, by the [`Key::index`] of the free nodes that it depends on: a row per
    /// coordinate of its residual, a column per coordinate of the node's step that is not held. H is the sum of Jᵀ J.
    pub fn jacobian(&self, factor: FactorKey) -> Vec<(usize, DMatrix<f64>)> {
        let mut derivative = Derivative::new(self.graph, &self.solver.workspace.layout);
        derivative.of_factor(factor).1.into_iter().map(|(node, j)| (node as usize, j)).collect()
    }

    /// Leaves Σ gᵀ in `y`, with g the derivatives of a coordinate, in the columns that are `wanted`.
    fn solve_for(&mut self, of: &Derivatives, coordinate: usize, given: &[Range<usize>], wanted: &[Range<usize>]) {
        self.y.fill(0.0);
        for ((_, matrix), columns) in of.iter().zip(given) {
            for (y, g) in self.y[columns.clone()].iter_mut().zip(matrix.row(coordinate).iter()) {
                *y += g;
            }
        }
        self.solver.linear.solve_part(&mut self.y, given, wanted);
    }

    /// Gives the solver back.
    pub fn into_solver(self) -> Solver {
        self.solver
    }
}

/// Linearises where the nodes are now, and factorises H. [`Error::Singular`] where the factors leave some direction open.
pub(crate) fn factorize(graph: &Graph, solver: &mut Solver) -> Result<(), Error> {
    let Solver { workspace, linear, buffers } = solver;
    if buffers.b.is_empty() {
        return Err(Error::NothingFree);
    }
    let cost = workspace.linearize(graph, &graph.values, Take::All);
    if !cost.is_finite() {
        return Err(graph.first_not_finite(cost));
    }
    workspace.diagonal(&mut buffers.diagonal);
    buffers.damping.fill(0.0);
    if !linear.factorize(workspace, &buffers.damping) || smallest(linear.as_mut(), &buffers.diagonal) < OPEN {
        return Err(Error::Singular);
    }
    Ok(())
}

/// Adds the product of derivatives and y.
fn multiply(of: &Derivatives, columns: &[Range<usize>], y: &[f64], mut product: DVectorViewMut<'_, f64>) {
    for ((_, matrix), columns) in of.iter().zip(columns) {
        let part = DVectorView::from_slice(&y[columns.clone()], columns.len());
        product.gemv(1.0, matrix, &part, 1.0);
    }
}

fn columns(layout: &Layout, of: &Derivatives) -> Vec<Range<usize>> {
    of.iter()
        .map(|(node, matrix)| {
            let first = layout.column(*node);
            first..first + matrix.ncols()
        })
        .collect()
}

/// The smallest eigenvalue of S H S with S = diag(H)^(-1/2), by inverse iteration from a fixed start. A direction that is
/// open stands out by ten orders of magnitude, so that a few rounds find it.
fn smallest(linear: &mut dyn LinearSolver, diagonal: &[f64]) -> f64 {
    let root: Vec<f64> = diagonal.iter().map(|d| d.sqrt()).collect();
    let mut v: Vec<f64> = (0..root.len()).map(|i| 1.0 + 0.5 * (i as f64 * 2.4).sin()).collect();
    let mut smallest = 1.0;
    for _ in 0..4 {
        let norm = v.iter().map(|v| v * v).sum::<f64>().sqrt();
        v.iter_mut().zip(&root).for_each(|(v, root)| *v *= root / norm);
        linear.solve(&mut v);
        v.iter_mut().zip(&root).for_each(|(v, root)| *v *= root);
        let grown = v.iter().map(|v| v * v).sum::<f64>().sqrt();
        smallest = if grown.is_finite() { 1.0 / grown } else { 0.0 };
    }
    smallest
}
