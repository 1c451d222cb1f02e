//! Which combinations of numbers the data leave open, or only a prior determines.
use crate::eigen::{generalized, scaled};
use crate::graph::{Graph, Role};
use crate::workspace::{Take, Workspace};
use crate::{Error, Solver};
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// A direction that the data determine less than a prior does, or not at all.
#[derive(Clone, Debug, PartialEq)]
pub struct WeakDirection {
    /// Whether anything determines it.
    pub kind: Weakness,
    /// Standard deviation from the data alone over that from the priors alone: more than 1, infinite where the data say
    /// nothing.
    pub sd_ratio: f64,
    /// Coordinates that move together, the largest weight first and 1.
    pub components: Vec<Component>,
}

/// What determines a weak direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Weakness {
    /// Nothing.
    Open,
    /// A prior more than the data.
    Prior,
}

/// One coordinate of a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Component {
    /// The node, see [`Key::index`](crate::Key::index).
    pub node: usize,
    /// Which number of the node's step.
    pub coordinate: usize,
    /// How far it moves, in its own unit.
    pub weight: f64,
}

/// A pseudo-prior on everything, ε diag H, that keeps open problems solvable.
const EPSILON: f64 = 1e-12;

/// Weights below this share of the largest are left out.
const SMALLEST_WEIGHT: f64 = 1e-6;

impl WeakDirection {
    /// Finds them where the nodes are now, the open ones first, then by falling ratio.
    ///
    /// `nuisance` are nodes (by [`Key::index`](crate::Key::index)) that directions are not looked for in, such as samples:
    /// they follow the others as the data want; `None` takes those that the linear solver eliminates. A direction that moves
    /// one nuisance node alone is still found. Takes time cubic in the columns that are kept.
    ///
    /// With H = D + P of the data and the priors, directions u of D u = ν H u with ν < 1/2 are weak, after the nuisance
    /// nodes are marginalised: inverses are compared, which every linear solver gives.
    pub fn find(graph: &Graph, solver: &mut Solver, nuisance: Option<&[usize]>) -> Result<Vec<Self>, Error> {
        solver.fit(graph);
        if solver.buffers.b.is_empty() {
            return Err(Error::NothingFree);
        }
        let mut search = Search::new(graph, solver, nuisance)?;
        let mut found = search.kept()?;
        found.extend(search.nuisance());
        found.extend(untouched(graph, &solver.workspace));
        found.sort_by(|a, b| a.kind.cmp(&b.kind).then(b.sd_ratio.total_cmp(&a.sd_ratio)));
        Ok(found)
    }

    fn new(kind: Weakness, sd_ratio: f64, weights: impl Iterator<Item = (usize, usize, f64)>) -> Self {
        let mut components: Vec<Component> =
            weights.map(|(node, coordinate, weight)| Component { node, coordinate, weight }).collect();
        components.sort_by(|a, b| b.weight.abs().total_cmp(&a.weight.abs()));
        let largest = components.first().map_or(1.0, |first| first.weight);
        components.iter_mut().for_each(|component| component.weight /= largest);
        components.retain(|component| component.weight.abs() >= SMALLEST_WEIGHT);
        WeakDirection { kind, sd_ratio, components }
    }
}

/// Free coordinates of nodes that no factor touches: each is open by itself.
fn untouched(graph: &Graph, workspace: &Workspace) -> Vec<WeakDirection> {
    let layout = &workspace.layout;
    let is_open = |node: &usize| graph.nodes[*node].role == Role::Free && layout.column_of(*node as u32).is_none();
    let coordinates = (0..graph.nodes.len()).filter(is_open).flat_map(|node| {
        let place = &graph.nodes[node];
        let free = place.free.clone().unwrap_or_else(|| (0..place.tangent as u16).collect());
        free.into_iter().map(move |coordinate| (node, usize::from(coordinate), 1.0))
    });
    coordinates.map(|one| WeakDirection::new(Weakness::Open, f64::INFINITY, std::iter::once(one))).collect()
}

struct Search<'a> {
    graph: &'a Graph,
    solver: &'a mut Solver,
    /// diag H, what everything is scaled by.
    diagonal: Vec<f64>,
    /// Columns of the nodes that are kept, and of those that are not.
    kept: Vec<Range<usize>>,
    nuisance: Vec<Range<usize>>,
}

impl<'a> Search<'a> {
    fn new(graph: &'a Graph, solver: &'a mut Solver, nuisance: Option<&[usize]>) -> Result<Self, Error> {
        let cost = solver.workspace.linearize(graph, &graph.values, Take::All);
        if !cost.is_finite() {
            return Err(graph.first_not_finite(cost));
        }
        let mut diagonal = vec![0.0; solver.buffers.b.len()];
        solver.workspace.diagonal(&mut diagonal);
        let floor = EPSILON * diagonal.iter().fold(1e-300, |most: f64, d| most.max(*d));
        diagonal.iter_mut().for_each(|d| *d = d.max(floor));
        let layout = &solver.workspace.layout;
        let (eliminated, _) = solver.linear.eliminated();
        let is_nuisance = |node: u32, column: usize| match nuisance {
            Some(nodes) => nodes.contains(&(node as usize)),
            None => eliminated.binary_search(&column).is_ok(),
        };
        let (mut kept, mut dropped) = (Vec::new(), Vec::new());
        for &(node, column) in &layout.free {
            let columns = column..column + usize::from(layout.places[node as usize].active);
            if is_nuisance(node, column) { dropped.push(columns) } else { kept.push(columns) }
        }
        Ok(Search { graph, solver, diagonal, kept, nuisance: dropped })
    }

    /// Directions of the nodes that are kept.
    fn kept(&mut self) -> Result<Vec<WeakDirection>, Error> {
        let columns: Vec<usize> = self.kept.iter().cloned().flatten().collect();
        if columns.is_empty() {
            return Ok(Vec::new());
        }
        let doubled = self.marginal(Take::All, 2.0)?;
        let all = self.marginal(Take::All, 1.0)?;
        // Open: doubling the pseudo-prior halves the covariance.
        let open = generalized(&all, &doubled).ok_or(Error::Singular)?.into_iter().filter(|(ratio, _)| *ratio >= 1.5);
        let open: Vec<DVector<f64>> = open.map(|(_, dual)| dual).collect();
        let mut found = self.judge_open(&columns, &open);
        let data = self.marginal(Take::Data, 1.0)?;
        for (ratio, dual) in generalized(&data, &all).ok_or(Error::Singular)? {
            if ratio > 2.0 {
                let weights = self.weights(&columns, &(&all * dual));
                found.push(WeakDirection::new(Weakness::Prior, (ratio - 1.0).sqrt(), weights.into_iter()));
            }
        }
        Ok(found)
    }

    /// Tells what nothing determines from what a prior does that is weaker than the pseudo-prior. Both are known exactly,
    /// where their sum with the data is rounded.
    fn judge_open(&mut self, columns: &[usize], duals: &[DVector<f64>]) -> Vec<WeakDirection> {
        let full: Vec<DVector<f64>> = duals
            .iter()
            .map(|dual| {
                let mut x = DVector::zeros(self.diagonal.len());
                for (&column, d) in columns.iter().zip(dual.iter()) {
                    x[column] = d * self.diagonal[column].sqrt();
                }
                self.solver.linear.solve(x.as_mut_slice());
                x
            })
            .collect();
        self.solver.workspace.linearize(self.graph, &self.graph.values, Take::Priors);
        let products: Vec<DVector<f64>> = full.iter().map(|x| self.solver.workspace.multiply(x)).collect();
        let k = full.len();
        let prior = DMatrix::from_fn(k, k, |i, j| full[i].dot(&products[j]));
        let pseudo = DMatrix::from_fn(k, k, |i, j| {
            (0..self.diagonal.len()).map(|c| EPSILON * self.diagonal[c] * full[i][c] * full[j][c]).sum()
        });
        let Some(pairs) = generalized(&prior, &pseudo) else { return Vec::new() };
        let judge = |(ratio, mix): (f64, DVector<f64>)| {
            let kind = if ratio > SMALLEST_WEIGHT { Weakness::Prior } else { Weakness::Open };
            let mut direction = DVector::zeros(self.diagonal.len());
            full.iter().zip(mix.iter()).for_each(|(x, m)| direction += x * *m);
            let weights = columns.iter().map(|&column| self.weight(column, direction[column]));
            WeakDirection::new(kind, f64::INFINITY, weights)
        };
        pairs.into_iter().map(judge).collect()
    }

    /// Directions that move one nuisance node alone.
    fn nuisance(&mut self) -> Vec<WeakDirection> {
        let mut blocks = |take| {
            self.solver.workspace.linearize(self.graph, &self.graph.values, take);
            let block = |columns: &Range<usize>| self.solver.workspace.diagonal_block(columns.start);
            self.nuisance.iter().map(block).collect::<Vec<DMatrix<f64>>>()
        };
        let (data, priors) = (blocks(Take::Data), blocks(Take::Priors));
        let mut found = Vec::new();
        for (columns, (data, prior)) in self.nuisance.iter().zip(data.iter().zip(&priors)) {
            let d = &self.diagonal[columns.clone()];
            let mut data = scaled(data, d, -0.5);
            (0..d.len()).for_each(|i| data[(i, i)] += EPSILON);
            for (ratio, primal) in generalized(&scaled(prior, d, -0.5), &data).into_iter().flatten() {
                let information = primal.dot(&(&data * &primal)) / primal.norm_squared();
                let is_null = information < 2.0 * EPSILON;
                let kind = match (ratio > 1.0 || is_null, is_null && ratio <= SMALLEST_WEIGHT) {
                    (_, true) => Weakness::Open,
                    (true, false) => Weakness::Prior,
                    (false, false) => continue,
                };
                let weights =
                    columns.clone().zip(primal.iter()).map(|(c, p)| self.weight(c, p / self.diagonal[c].sqrt()));
                let sd_ratio = if is_null { f64::INFINITY } else { ratio.sqrt() };
                found.push(WeakDirection::new(kind, sd_ratio, weights));
            }
        }
        found
    }

    /// The covariance of the kept nodes with everything else marginalised, scaled by the root of diag H on both sides.
    fn marginal(&mut self, take: Take, pseudo: f64) -> Result<DMatrix<f64>, Error> {
        let Solver { workspace, linear, buffers } = &mut *self.solver;
        workspace.linearize(self.graph, &self.graph.values, take);
        for (damping, d) in buffers.damping.iter_mut().zip(&self.diagonal) {
            *damping = pseudo * EPSILON * d;
        }
        if !linear.factorize(workspace, &buffers.damping) {
            return Err(Error::Singular);
        }
        let columns: Vec<usize> = self.kept.iter().cloned().flatten().collect();
        let mut covariance = DMatrix::zeros(columns.len(), columns.len());
        let y = &mut buffers.step;
        for (j, &column) in columns.iter().enumerate() {
            y.fill(0.0);
            y[column] = 1.0;
            linear.solve_part(y, std::slice::from_ref(&(column..column + 1)), &self.kept);
            for (i, &row) in columns.iter().enumerate() {
                covariance[(i, j)] = y[row];
            }
        }
        let d: Vec<f64> = columns.iter().map(|&column| self.diagonal[column]).collect();
        Ok(scaled(&covariance, &d, 0.5))
    }

    fn weights(&self, columns: &[usize], scaled: &DVector<f64>) -> Vec<(usize, usize, f64)> {
        columns.iter().zip(scaled.iter()).map(|(&c, s)| self.weight(c, s / self.diagonal[c].sqrt())).collect()
    }

    /// (node, coordinate, weight) of a column.
    fn weight(&self, column: usize, weight: f64) -> (usize, usize, f64) {
        let free = &self.solver.workspace.layout.free;
        let (node, first) = free[free.partition_point(|&(_, first)| first <= column) - 1];
        let coordinates = &self.graph.nodes[node as usize].free;
        let rank = column - first;
        (node as usize, coordinates.as_ref().map_or(rank, |free| usize::from(free[rank])), weight)
    }
}
