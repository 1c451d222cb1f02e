//! Where a graph would go without some of its factors, without solving again for each.
use crate::chunks::parents;
use crate::covariance::factorize;
use crate::derivative::Derivative;
use crate::graph::{Graph, Node, Role};
use crate::layout::Layout;
use crate::{Error, FactorKey, Solver};
use nalgebra::{DMatrix, DVector};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// The Gauss-Newton step without a group of factors, for each of many groups, from one factorisation of the whole graph.
///
/// With δ = -H⁻¹ b the step of the whole graph from where its nodes are now, Σ = H⁻¹, and J and r what a group adds to H = Σ JᵀJ
/// and b = Σ Jᵀr, the step without the group is (Sherman, Morrison and Woodbury)
///
///   (H - JᵀJ)⁻¹ (Jᵀr - b) = δ + Σ Jᵀ (I - J Σ Jᵀ)⁻¹ (r + J δ)
///
/// Of Σ, only the rows and columns of the nodes that the group is on are needed. Robust losses are the weights that they give now.
///
/// ```
/// use handeye_solvers::{Graph, LeaveOut, Vector};
/// let mut graph = Graph::new();
/// let x = graph.free(Vector::<1>::new(2.0));
/// let readings = [1.0, 2.0, 6.0].map(|reading| vec![graph.prior(x, &Vector::<1>::new(reading), &[1.0])]);
/// let leave_out = LeaveOut::new(&graph, &readings, &[x.index()])?;
/// let step = leave_out.step(2).expect("the other two determine x");
/// assert!((step[0][0] - (1.5 - 2.0)).abs() < 1e-12);
/// # Ok::<(), handeye_solvers::Error>(())
/// ```
pub struct LeaveOut<'a> {
    graph: &'a Graph,
    layout: Layout,
    wanted: Vec<u32>,
    groups: Vec<Group<'a>>,
    /// δ, over the columns of the system.
    delta: Vec<f64>,
    /// First place of a shared node's columns in `covariance`.
    places: BTreeMap<u32, usize>,
    /// Σ of the columns of all shared nodes.
    covariance: DMatrix<f64>,
}

/// Some factors, and the free nodes that they are on.
struct Group<'a> {
    factors: &'a [FactorKey],
    /// Nodes that no other factor is on: without the group, nothing depends on them.
    alone: Vec<u32>,
    /// Nodes that other groups are on too or that are wanted, and the others.
    shared: Vec<u32>,
    own: Vec<u32>,
    /// Σ of all shared and then the own columns (rows) with the own ones (columns).
    of_own: DMatrix<f64>,
}

/// Least pivot of I - J Σ Jᵀ, the share of the information in a direction that is not the group's, that is told from none: Σ is known
/// to the rounding times the condition of H.
const NONE_LEFT: f64 = 1e-10;

impl<'a> LeaveOut<'a> {
    /// Linearises and factorises once, where the nodes are now.
    ///
    /// `groups`: factors that are left out together, each in one group at most. `wanted`: the free nodes whose steps are asked for, by
    /// [`Key::index`](crate::Key::index). Solves with H once per coordinate of the nodes that groups are on: where the linear solver
    /// eliminates the nodes of one group alone, a solution takes as long however many groups there are, and otherwise it grows with them.
    ///
    /// [`Error::Singular`] where all factors together leave some direction open.
    pub fn new(graph: &'a Graph, groups: &'a [Vec<FactorKey>], wanted: &[usize]) -> Result<Self, Error> {
        let mut solver = Solver::new(graph);
        factorize(graph, &mut solver)?;
        let mut delta = vec![0.0; solver.buffers.b.len()];
        solver.workspace.gradient(&mut delta);
        delta.iter_mut().for_each(|b| *b = -*b);
        solver.linear.solve(&mut delta);
        let wanted: Vec<u32> = wanted.iter().map(|&node| node as u32).collect();
        let layout = &solver.workspace.layout;
        let (mut groups, shared) = sort(graph, layout, groups, &wanted);
        let (mut places, mut rows) = (BTreeMap::new(), Vec::new());
        for node in shared {
            let columns = columns(layout, node);
            places.insert(node, rows.iter().map(Range::len).sum());
            rows.push(columns);
        }
        for group in &mut groups {
            let own: Vec<Range<usize>> =
                group.own.iter().map(|&node| columns(&solver.workspace.layout, node)).collect();
            group.of_own = inverse(&mut solver, &[&rows[..], &own].concat(), &own);
        }
        let covariance = inverse(&mut solver, &rows, &rows);
        Ok(LeaveOut { graph, layout: solver.workspace.layout, wanted, groups, delta, places, covariance })
    }

    /// The step of each wanted node without the factors of a group, over all coordinates of its step, with zeros for what is held or
    /// has no factor left; `None` where the other factors leave some direction open.
    pub fn step(&self, group: usize) -> Option<Vec<DVector<f64>>> {
        let group = &self.groups[group];
        let eliminated: usize = group.alone.iter().map(|&node| columns(&self.layout, node).len()).sum();
        let others = group.shared.iter().chain(&group.own);
        let other_columns: Vec<usize> = others.clone().flat_map(|&node| columns(&self.layout, node)).collect();
        let t = other_columns.len();
        // Nodes that are alone go where the group wants them: in R of [J_alone J r] = Q R, the rows below theirs are what the group
        // says of the others.
        let stacked = self.stacked(group, eliminated + t);
        if t == 0 || stacked.is_empty() {
            return Some(self.wanted.iter().map(|&node| self.step_of(node, group, &[], &DVector::zeros(0))).collect());
        }
        let triangle = stacked.qr().unpack_r();
        let rows = triangle.nrows().saturating_sub(eliminated);
        let j = triangle.view((eliminated, eliminated), (rows, t));
        let r = triangle.view((eliminated, eliminated + t), (rows, 1));
        let shared = self.covariance.nrows();
        let first = |node: &u32| self.places[node];
        let of_shared =
            group.shared.iter().flat_map(|node| (0..columns(&self.layout, *node).len()).map(move |k| first(node) + k));
        let places: Vec<usize> = of_shared.chain(shared..shared + group.of_own.ncols()).collect();
        let sigma = DMatrix::from_fn(t, t, |i, j| self.entry(group, places[i], places[j]));
        let left = DMatrix::identity(rows, rows) - j * sigma * j.transpose();
        let left =
            left.cholesky().filter(|left| left.l_dirty().diagonal().iter().all(|pivot| pivot * pivot > NONE_LEFT))?;
        let delta = DVector::from_iterator(t, other_columns.iter().map(|&column| self.delta[column]));
        let pull = j.tr_mul(&left.solve(&(r + j * delta))).column(0).into_owned();
        Some(self.wanted.iter().map(|&node| self.step_of(node, group, &places, &pull)).collect())
    }

    /// δ + Σ `pull`, of one node.
    fn step_of(&self, node: u32, group: &Group<'_>, places: &[usize], pull: &DVector<f64>) -> DVector<f64> {
        let Node { tangent, free, .. } = &self.graph.nodes[node as usize];
        let mut step = DVector::zeros(*tangent);
        let Some(&first) = self.places.get(&node).filter(|_| !group.alone.contains(&node)) else { return step };
        for (k, column) in columns(&self.layout, node).enumerate() {
            let coordinate = free.as_ref().map_or(k, |free| usize::from(free[k]));
            let pulled =
                places.iter().zip(pull.iter()).map(|(&place, pull)| self.entry(group, first + k, place) * pull);
            step[coordinate] = self.delta[column] + pulled.sum::<f64>();
        }
        step
    }

    /// Σ of two columns by their places: those of the shared nodes, and then the group's own.
    fn entry(&self, group: &Group<'_>, a: usize, b: usize) -> f64 {
        let shared = self.covariance.nrows();
        match (a.checked_sub(shared), b.checked_sub(shared)) {
            (_, Some(own)) => group.of_own[(a, own)],
            (Some(own), None) => group.of_own[(b, own)],
            (None, None) => self.covariance[(a, b)],
        }
    }

    /// [J r] of a group, with the columns of its nodes in order: alone, shared, own.
    fn stacked(&self, group: &Group<'_>, width: usize) -> DMatrix<f64> {
        let mut derivative = Derivative::new(self.graph, &self.layout);
        let (mut starts, mut start) = (BTreeMap::new(), 0);
        for &node in group.alone.iter().chain(&group.shared).chain(&group.own) {
            starts.insert(node, start);
            start += columns(&self.layout, node).len();
        }
        let all: Vec<_> = group.factors.iter().map(|&factor| derivative.of_factor(factor)).collect();
        let mut stacked = DMatrix::zeros(all.iter().map(|(r, _)| r.len()).sum(), width + 1);
        let mut row = 0;
        for (r, blocks) in all {
            for (node, block) in blocks {
                stacked.view_mut((row, starts[&node]), block.shape()).copy_from(&block);
            }
            stacked.view_mut((row, width), (r.len(), 1)).copy_from_slice(&r);
            row += r.len();
        }
        stacked
    }
}

fn columns(layout: &Layout, node: u32) -> Range<usize> {
    let first = layout.column(node);
    first..first + usize::from(layout.places[node as usize].active)
}

/// Σ of some columns (the rows) with others (the columns).
fn inverse(solver: &mut Solver, rows: &[Range<usize>], columns: &[Range<usize>]) -> DMatrix<f64> {
    let wanted: Vec<usize> = rows.iter().cloned().flatten().collect();
    let given: Vec<usize> = columns.iter().cloned().flatten().collect();
    let mut result = DMatrix::zeros(wanted.len(), given.len());
    let y = &mut solver.buffers.step;
    for (column, mut of) in given.into_iter().zip(result.column_iter_mut()) {
        y.fill(0.0);
        y[column] = 1.0;
        solver.linear.solve_part(y, std::slice::from_ref(&(column..column + 1)), rows);
        of.iter_mut().zip(&wanted).for_each(|(to, &row)| *to = y[row]);
    }
    result
}

/// What is on a free node.
#[derive(Clone, Copy)]
enum On {
    Nothing,
    /// Factors of one group and, maybe, of none.
    Group(usize, bool),
    /// Factors of no group.
    Others,
    Groups,
}

/// The groups without their blocks of Σ, and the nodes that are shared.
fn sort<'a>(
    graph: &Graph,
    layout: &Layout,
    groups: &'a [Vec<FactorKey>],
    wanted: &[u32],
) -> (Vec<Group<'a>>, BTreeSet<u32>) {
    let roots = roots(graph, layout);
    let nodes = |factor: &FactorKey| {
        let nodes = graph.factors[factor.pool as usize].nodes(factor.place as usize);
        nodes.iter().flat_map(|&node| roots[node as usize].iter().copied())
    };
    let group_of: BTreeMap<FactorKey, usize> =
        groups.iter().enumerate().flat_map(|(group, keys)| keys.iter().map(move |key| (*key, group))).collect();
    let mut on = vec![On::Nothing; graph.nodes.len()];
    for factor in &graph.order {
        let group = group_of.get(factor);
        for node in nodes(factor) {
            let on = &mut on[node as usize];
            *on = match (*on, group) {
                (On::Nothing, Some(&group)) => On::Group(group, false),
                (On::Others, Some(&group)) => On::Group(group, true),
                (On::Nothing | On::Others, None) => On::Others,
                (On::Group(one, _), None) => On::Group(one, true),
                (On::Group(one, others), Some(&group)) if one == group => On::Group(one, others),
                (On::Group(..) | On::Groups, _) => On::Groups,
            };
        }
    }
    let is_of_many = |node: &u32| matches!(on[*node as usize], On::Groups);
    let in_system = wanted.iter().copied().filter(|&node| layout.column_of(node).is_some());
    let shared: BTreeSet<u32> = (0..on.len() as u32).filter(is_of_many).chain(in_system).collect();
    let sorted = groups.iter().map(|factors| {
        let all: BTreeSet<u32> = factors.iter().flat_map(nodes).collect();
        let (alone, others): (Vec<u32>, Vec<u32>) =
            all.into_iter().partition(|&node| matches!(on[node as usize], On::Group(_, false)));
        let (shared, own) = others.into_iter().partition(|node| shared.contains(node));
        Group { factors, alone, shared, own, of_own: DMatrix::zeros(0, 0) }
    });
    (sorted.collect(), shared.clone())
}

/// Of each node, the free ones that it depends on, itself among them.
fn roots(graph: &Graph, layout: &Layout) -> Vec<Vec<u32>> {
    let mut roots: Vec<Vec<u32>> = Vec::with_capacity(graph.nodes.len());
    for (node, one) in graph.nodes.iter().enumerate() {
        roots.push(match one.role {
            _ if layout.places[node].active == 0 => Vec::new(),
            Role::Held => Vec::new(),
            Role::Free => vec![node as u32],
            Role::Derived(derived) => {
                let of_parents = parents(graph, derived).iter().flat_map(|&parent| &roots[parent as usize]);
                BTreeSet::from_iter(of_parents.copied()).into_iter().collect()
            }
        });
    }
    roots
}
