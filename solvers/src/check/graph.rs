//! Normal equations of a whole graph against differences of its residuals.
use super::differences::derivative;
use super::{Agreement, Comparison, Mismatch};
use crate::graph::{Graph, Role};
use crate::pool::squared;
use crate::workspace::Workspace;
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;

/// Compares H = Σ ρ' JᵀJ and b = Σ ρ' Jᵀr, derived nodes substituted, with J from differences of the whitened residuals.
///
/// Dense in the columns of the system and the rows of all residuals: for graphs of up to some hundred columns. Rows and
/// columns of a mismatch are those of the system: the free coordinates of the free nodes, in order.
pub fn graph(graph: &Graph) -> Result<Agreement, Mismatch> {
    let mut workspace = Workspace::new(graph);
    workspace.linearize_at(graph);
    let (found_h, found_b) = workspace.normal_equations();
    let (jacobian, errors, residual) = differences(graph, &workspace);
    let (h, b) = (jacobian.tr_mul(&jacobian), jacobian.tr_mul(&residual));
    let mut comparison = Comparison::default();
    let size: Vec<f64> = (0..b.len()).map(|i| h[(i, i)].max(found_h[(i, i)]).sqrt()).collect();
    for i in 0..b.len() {
        let uncertainty = errors[i] * residual.norm();
        comparison.entry("b", (i, 0), b[i], found_b[i], size[i] * residual.norm(), uncertainty);
        for j in 0..b.len() {
            let uncertainty = errors[i] * size[j] + errors[j] * size[i];
            comparison.entry("H", (i, j), h[(i, j)], found_h[(i, j)], size[i] * size[j], uncertainty);
        }
    }
    comparison.finish()
}

/// J by differences, the error of each of its columns, and the residuals, all with the root of ρ' where they are.
fn differences(graph: &Graph, workspace: &Workspace) -> (DMatrix<f64>, Vec<f64>, DVector<f64>) {
    let all: Vec<usize> = (0..graph.order.len()).collect();
    let at = Values::new(graph);
    let mut starts = vec![0];
    let mut residual = Vec::new();
    let mut roots = Vec::new();
    for &factor in &all {
        let r = at.residual(graph, factor);
        let key = graph.order[factor];
        let loss = graph.factors[key.pool as usize].loss(key.place as usize);
        let root = loss.evaluate(squared(&r), graph.graduation).1.sqrt();
        residual.extend(r.iter().map(|r| r * root));
        roots.push(root);
        starts.push(residual.len());
    }
    let mut jacobian = DMatrix::zeros(residual.len(), workspace.layout.columns);
    let mut errors = vec![0.0; workspace.layout.columns];
    for &(node, first) in &workspace.layout.free {
        let place = &graph.nodes[node as usize];
        let free: Vec<u16> = place.free.clone().unwrap_or_else(|| (0..place.tangent as u16).collect());
        let touched: Vec<usize> = all.iter().copied().filter(|&factor| at.depends(graph, factor, node)).collect();
        for (rank, &coordinate) in free.iter().enumerate() {
            let column = derivative(|step| {
                let mut delta = vec![0.0; place.tangent];
                delta[usize::from(coordinate)] = step;
                let moved = at.moved(graph, node, &delta);
                touched.iter().flat_map(|&factor| moved.residual(graph, factor)).collect()
            });
            let mut entries = column.into_iter();
            for &factor in &touched {
                for row in starts[factor]..starts[factor + 1] {
                    let (d, error) = entries.next().expect("a residual keeps its length");
                    jacobian[(row, first + rank)] = d * roots[factor];
                    errors[first + rank] += (error * roots[factor]).powi(2);
                }
            }
        }
    }
    (jacobian, errors.into_iter().map(f64::sqrt).collect(), DVector::from_vec(residual))
}

/// Every node's stored numbers, and the free nodes that each derived node depends on.
#[derive(Clone)]
struct Values {
    stored: Vec<Vec<f64>>,
    ancestors: BTreeMap<u32, Vec<u32>>,
}

impl Values {
    fn new(graph: &Graph) -> Self {
        let mut ancestors: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for derived in &graph.derived {
            let parents = graph.functions[derived.pool as usize].nodes(derived.place as usize);
            let mut own: Vec<u32> = parents.to_vec();
            own.extend(parents.iter().filter_map(|parent| ancestors.get(parent)).flatten());
            own.sort_unstable();
            own.dedup();
            ancestors.insert(derived.node, own);
        }
        let stored = (0..graph.nodes.len() as u32)
            .map(|node| match graph.nodes[node as usize].role {
                Role::Derived(_) => vec![0.0; graph.nodes[node as usize].ambient],
                _ => graph.stored(node),
            })
            .collect();
        Values { stored, ancestors }.derived(graph)
    }

    fn derived(mut self, graph: &Graph) -> Self {
        for derived in &graph.derived {
            let pool = &graph.functions[derived.pool as usize];
            let mut y = std::mem::take(&mut self.stored[derived.node as usize]);
            let x = self.of(pool.nodes(derived.place as usize));
            pool.evaluate(derived.place as usize, &x, &mut y, None);
            self.stored[derived.node as usize] = y;
        }
        self
    }

    fn of(&self, nodes: &[u32]) -> Vec<&[f64]> {
        nodes.iter().map(|&node| self.stored[node as usize].as_slice()).collect()
    }

    fn moved(&self, graph: &Graph, node: u32, delta: &[f64]) -> Self {
        let mut moved = self.clone();
        (graph.nodes[node as usize].retract)(&self.stored[node as usize], delta, &mut moved.stored[node as usize]);
        moved.derived(graph)
    }

    fn depends(&self, graph: &Graph, factor: usize, node: u32) -> bool {
        let key = graph.order[factor];
        let depends = |on: &u32| *on == node || self.ancestors.get(on).is_some_and(|all| all.contains(&node));
        graph.factors[key.pool as usize].nodes(key.place as usize).iter().any(depends)
    }

    fn residual(&self, graph: &Graph, factor: usize) -> Vec<f64> {
        let key = graph.order[factor];
        let pool = &graph.factors[key.pool as usize];
        pool.residual(key.place as usize, &self.of(pool.nodes(key.place as usize)))
    }
}
